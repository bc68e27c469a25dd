// A mixture of Gaussians over the next frame, and how to draw from it.

/** Numbers of the last layer to weights, means and deviations (RNN-GAN, eq. 7), all flat arrays. */
export function toMixture(numbers, input, { components, kept, skip, reach, floor }) {
  const logWeights = logSoftmax(numbers.subarray(0, components));
  const size = components * kept;
  const means = numbers.slice(components, components + size);
  const stds = numbers.slice(components + size, components + 2 * size);
  for (let at = 0; at < size; at += kept) {
    for (let i = 0; i < kept; i++) {
      means[at + i] = skip * input[i] + reach * means[at + i]; // a share of the present frame
      stds[at + i] = reach * Math.exp(stds[at + i]) + floor[i];
    }
  }
  return { logWeights, means, stds, kept };
}

/** A component, drawn by the weights. */
export function choose({ logWeights }, random, { component_temperature }) {
  const chances = logSoftmax(logWeights.map((value) => value / component_temperature)).map(Math.exp);
  let chosen = 0;
  for (let rest = random.uniform() - chances[0]; rest > 0 && chosen < chances.length - 1; rest -= chances[chosen]) chosen++;
  return chosen;
}

/** The point of a component's Gaussian that `noise` stands for, in deviations. */
export function point({ means, stds, kept }, component, noise, { temperature }) {
  const at = component * kept;
  const drawn = new Float32Array(kept);
  for (let i = 0; i < kept; i++) drawn[i] = means[at + i] + temperature * stds[at + i] * noise[i];
  return drawn;
}

/** `count` numbers of noise with a memory (motionlab/models/noise.py); the noise before may be empty. */
export function nextNoise(noise, count, random, { memory }) {
  const rest = Math.sqrt(1 - memory ** 2);
  const next = new Float64Array(count);
  for (let i = 0; i < count; i++) {
    const white = random.normal();
    next[i] = memory && noise.length ? memory * noise[i] + rest * white : white;
  }
  return next;
}

function logSoftmax(values) {
  const most = Math.max(...values);
  const total = Math.log(values.reduce((sum, value) => sum + Math.exp(value - most), 0)) + most;
  return Float64Array.from(values, (value) => value - total);
}

/** Chance that can be repeated: mulberry32, and normal numbers from it by Box and Muller. */
export class Random {
  constructor(seed) {
    this.state = seed | 0;
    for (let i = 0; i < 4; i++) this.uniform(); // neighbouring seeds part ways
  }

  /** From 0 to 1, never 0. */
  uniform() {
    this.state = (this.state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(this.state ^ (this.state >>> 15), 1 | this.state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return (((mixed ^ (mixed >>> 14)) >>> 0) + 0.5) / 4294967296;
  }

  normal() {
    if (this.spare !== undefined) {
      const kept = this.spare;
      this.spare = undefined;
      return kept;
    }
    const radius = Math.sqrt(-2 * Math.log(this.uniform()));
    const angle = 2 * Math.PI * this.uniform();
    this.spare = radius * Math.sin(angle);
    return radius * Math.cos(angle);
  }
}
