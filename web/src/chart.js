// Lines of one value a frame below the picture, with a cursor that stands where the player is. A click
// or a drag goes there; keys have the player's slider for that.
const SVG = "http://www.w3.org/2000/svg";
const [WIDE, TALL] = [1000, 100]; // of the drawing, which is stretched over the chart
const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });

function drawn(tag, settings) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries({ "vector-effect": "non-scaling-stroke", ...settings })) made.setAttribute(name, value);
  return made;
}

export class Chart {
  /** `chart`: {label, log, lines: [{name, color, values}]}, null where there is no value. */
  constructor(player, { label, log, lines }, frames) {
    Object.assign(this, { lines, last: Math.max(frames - 1, 1) });
    const scale = log ? Math.log10 : (value) => value;
    const known = lines.flatMap(({ values }) => values.filter((value) => value !== null && (!log || value > 0)));
    const [low, high] = [Math.min(...known, ...(log ? [] : [0])), Math.max(...known)];
    this.x = (frame) => (WIDE * frame) / this.last;
    this.y = (value) => TALL - (TALL * (scale(value) - scale(low))) / (scale(high) - scale(low) || 1);
    const unit = log ? 0 : 10 ** (Math.floor(Math.log10(high - low || 1)) - 2); // what is less is no news
    this.said = (value) => short(value === null || log ? value : Math.round(value / unit) * unit);
    this.element = make("div", "ml-overtime");
    const plot = make("div", "ml-overtime-plot");
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${label}, over time: ${lines.map((line) => line.name).join(", ")}`);
    const picture = drawn("svg", { viewBox: `0 0 ${WIDE} ${TALL}`, preserveAspectRatio: "none" });
    for (const { color, values } of lines) picture.append(drawn("path", { d: this.way(values, log), stroke: color, fill: "none", "stroke-width": 1.5 }));
    this.cursor = drawn("line", { y1: 0, y2: TALL, class: "ml-overtime-now" });
    picture.append(this.cursor);
    plot.append(picture, ...[["ml-high", high], ["ml-low", low]].map(([side, value]) => make("span", side, this.said(value))));
    this.element.append(this.legend(label), plot);
    const seek = (event) => {
      if (event.type === "pointermove" && !event.buttons) return;
      const { left, width } = plot.getBoundingClientRect();
      player.scrub(Math.round((this.last * (event.clientX - left)) / width));
    };
    for (const kind of ["pointerdown", "pointermove"]) plot.addEventListener(kind, seek);
  }

  /** What is measured, and each line's name and value of now. */
  legend(label) {
    const row = make("div", "ml-overtime-names");
    this.told = this.lines.map(() => make("output", "ml-time"));
    this.told.forEach((value) => value.setAttribute("aria-live", "off"));
    const names = this.lines.map(({ name, color }, i) => {
      const chip = make("span", "ml-name", name);
      chip.style.setProperty("--ml-color", color);
      chip.append(" ", this.told[i]);
      return chip;
    });
    row.append(make("span", "ml-what", label), ...names);
    return row;
  }

  /** The path of a line, broken where there is no value. */
  way(values, log) {
    let pen = "M";
    return values.map((value, frame) => {
      if (value === null || (log && value <= 0)) return (pen = "M") && "";
      const step = `${pen}${this.x(frame).toFixed(1)} ${this.y(value).toFixed(1)}`;
      pen = "L";
      return step;
    }).join("");
  }

  show({ frame }) {
    for (const side of ["x1", "x2"]) this.cursor.setAttribute(side, this.x(frame));
    this.lines.forEach(({ values }, i) => { this.told[i].textContent = this.said(values[frame] ?? null); });
  }
}

const short = (value) => (value === null ? "" : Number(value.toPrecision(3)).toString());
