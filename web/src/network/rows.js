// Rows of features in raw units, as encodings read them, and in normalised ones, as networks do.

/** `normalize` and `denormalize` of a normaliser {kept, mean, std}. */
export function normalizing({ kept, mean, std }) {
  return {
    normalize: (row) => Float32Array.from(kept, (channel) => (row[channel] - mean[channel]) / std[channel]),
    /** Channels that never vary are their mean. */
    denormalize: (values) => {
      const row = mean.slice();
      kept.forEach((channel, i) => { row[channel] += values[i] * std[channel]; });
      return row;
    },
  };
}
