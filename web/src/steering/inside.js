// A look inside the running network: how likely each component of the next frame is, how far its step may go, and how
// good the futures are of which one was kept.

const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });
const degrees = (angle) => (180 * angle) / Math.PI;
const STEP = [1, 2]; // channels of the step ahead and of the turn
const MOST = [1, 60]; // m/s and degrees a second that fill a bar

/** The standard deviation of a channel of a mixture, in its units; `column` of the kept ones. */
export function spreadOf({ logWeights, means, stds, kept }, column) {
  let [mean, square] = [0, 0];
  logWeights.forEach((log, component) => {
    const [weight, m, s] = [Math.exp(log), means[component * kept + column], stds[component * kept + column]];
    mean += weight * m;
    square += weight * (s * s + m * m);
  });
  return Math.sqrt(Math.max(square - mean * mean, 0));
}

export class Inside {
  /** `normalizer` and `fps` of the network, `components` it has. */
  constructor({ normalizer, fps }, components) {
    Object.assign(this, { normalizer, fps });
    this.element = make("div", "ml-inside");
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Inside the network, as it runs");
    this.weights = this.group("Weights of the components", Array.from({ length: components }, (_, i) => `${i + 1}`));
    this.spreads = this.group("Spread of the next step", ["ahead", "turn"]);
    this.futures = make("p", "ml-small");
    this.element.append(this.futures);
  }

  group(title, names) {
    const box = make("div", "ml-bars");
    box.append(make("span", "ml-caption", title));
    const bars = names.map((name) => {
      const row = make("div", "ml-meter");
      const [fill, value] = [make("i", ""), make("span", "ml-value")];
      const track = make("span", "ml-track");
      track.append(fill);
      row.append(make("span", "", name), track, value);
      box.append(row);
      return { row, fill, value };
    });
    this.element.append(box);
    return bars;
  }

  /** Of the frame that is seen now: what LiveControl kept of it. */
  show({ next, component, energies, chosen }) {
    const { kept, std } = this.normalizer;
    [...next.logWeights].forEach((log, i) => {
      const { row, fill, value } = this.weights[i];
      const weight = Math.exp(log);
      row.classList.toggle("ml-chosen", i === component);
      fill.style.width = `${100 * weight}%`;
      value.textContent = weight.toFixed(2);
    });
    STEP.forEach((channel, i) => {
      const rate = this.fps * std[channel] * spreadOf(next, kept.indexOf(channel));
      const found = i ? degrees(rate) : rate;
      this.spreads[i].fill.style.width = `${Math.min((100 * found) / MOST[i], 100)}%`;
      this.spreads[i].value.textContent = i ? `${found.toFixed(0)}°/s` : `${found.toFixed(2)} m/s`;
    });
    const finite = energies.filter(Number.isFinite);
    this.futures.textContent = energies.length < 2 ? "One future: nothing is chosen."
      : `${energies.length} futures: the one that is kept has an energy of ${energies[chosen].toFixed(1)} nats, the worst of ${Math.max(...finite).toFixed(1)}.`;
  }
}
