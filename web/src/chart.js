// Lines of one value a frame below the picture, with a cursor that stands where the player is. A click
// or a drag goes there; keys have the player's slider for that. If lines are motions' own, the nearest
// to a click is chosen, and its motion plays from there; keys have the names for that.
const SVG = "http://www.w3.org/2000/svg";
const [WIDE, TALL] = [1000, 100]; // of the drawing, which is stretched over the chart
const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });
const STEADY = 6; // pixels that a hand moves in a click
let groups = 0; // of names to choose from: each needs a name of its own

function drawn(tag, settings) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries({ "vector-effect": "non-scaling-stroke", ...settings })) made.setAttribute(name, value);
  return made;
}

export class Chart {
  /** `chart`: {label, log, picks, lines: [{name, color, values}]}, null where there is no value; `picks`: a line is a motion's. */
  constructor(player, { label, log, picks, lines }, frames) {
    Object.assign(this, { player, picks, lines, last: Math.max(frames - 1, 1) });
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
    this.drawn = lines.map(({ color, values }) => drawn("path", { d: this.way(values, log), stroke: color, fill: "none", "stroke-width": 1.5 }));
    picture.append(...this.drawn);
    this.cursor = drawn("line", { y1: 0, y2: TALL, class: "ml-overtime-now" });
    picture.append(this.cursor);
    plot.append(picture, ...[["ml-high", high], ["ml-low", low]].map(([side, value]) => make("span", side, this.said(value))));
    this.element.append(this.legend(label), plot);
    let from = null; // where a finger came down
    const seek = (event) => {
      if (event.type === "pointerdown") from = event;
      if (event.type === "pointermove" && !event.buttons) return;
      const { left, width } = plot.getBoundingClientRect();
      player.scrub(Math.round((this.last * (event.clientX - left)) / width));
    };
    for (const kind of ["pointerdown", "pointermove"]) plot.addEventListener(kind, seek);
    if (!picks) return;
    plot.classList.add("ml-picks");
    plot.title = "Click a line to see its motion";
    plot.addEventListener("click", (event) => {
      const dragged = Math.hypot(event.clientX - from?.clientX, event.clientY - from?.clientY) > STEADY;
      if (!dragged) this.pick(this.nearest(event, plot.getBoundingClientRect(), log));
    });
  }

  pick(number) {
    this.player.set("chosen", number);
    this.player.play();
  }

  /** Number of the line that passes nearest to a place on the screen. */
  nearest({ clientX, clientY }, { left, top, width, height }, log) {
    const away = this.lines.map(({ values }) => Math.min(...values.map((value, frame) => {
      if (value === null || (log && value <= 0)) return Infinity;
      return Math.hypot((width * this.x(frame)) / WIDE + left - clientX, (height * this.y(value)) / TALL + top - clientY);
    })));
    return away.indexOf(Math.min(...away));
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
    row.append(make("span", "ml-what", label), ...(this.picks ? [this.choices(names)] : names));
    return row;
  }

  /** The names as a choice of one: what a click on a line does, for keys. */
  choices(names) {
    const group = make("div", "ml-choices");
    group.setAttribute("role", "radiogroup");
    group.setAttribute("aria-label", this.player.payload.choose);
    groups += 1;
    this.radios = names.map((chip, number) => {
      const radio = Object.assign(document.createElement("input"), { type: "radio", name: `ml-line-${groups}` });
      radio.setAttribute("aria-label", this.lines[number].name); // without its value, which changes all the time
      radio.addEventListener("change", () => this.pick(number));
      const field = make("label", "ml-line");
      field.append(radio, chip);
      group.append(field);
      return radio;
    });
    return group;
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

  show({ frame, chosen }) {
    for (const side of ["x1", "x2"]) this.cursor.setAttribute(side, this.x(frame));
    this.lines.forEach(({ values }, i) => { this.told[i].textContent = this.said(values[frame] ?? null); });
    if (!this.picks || this.shown === chosen) return;
    this.shown = chosen;
    this.drawn.forEach((line, i) => line.classList.toggle("ml-picked", i === chosen));
    this.cursor.before(this.drawn[chosen]); // over the others
    this.radios[chosen].checked = true;
  }
}

const short = (value) => (value === null ? "" : Number(value.toPrecision(3)).toString());
