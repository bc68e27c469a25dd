// The ground seen from above, to draw a line on: with mouse or finger, by points that are tapped, by keys, or
// by taking a shape. Up is z, left is x, as for one who stands below it and looks along.
import { SHAPES, smoothed } from "./shapes.js";

const NS = "http://www.w3.org/2000/svg";
const ASPECT = 0.75; // height of the board over its width
const [NARROWEST, WIDEST] = [4, 120]; // metres that a board shows across
const CLICK = 8; // pixels within which a stroke is a tap
const JOIN = 0.4; // metres from the end of a line within which a new stroke goes on with it
const UNDO = 60; // steps back

const HELP = "Arrow keys move a cursor by 25 centimetres, with Shift by a metre; Enter sets a point, Backspace takes the last step back, Escape clears.";

export class Board {
  /** `changed()` is called when there is another line: `points`, places [x, z] in metres. */
  constructor(changed) {
    Object.assign(this, { changed, points: [], past: [], width: 8, middle: [0, 0], cursor: [0, 0] });
    this.element = document.createElement("div");
    this.element.className = "ml-drawing";
    this.svg = drawn("svg", { class: "ml-board", tabindex: 0, role: "application", "aria-roledescription": "drawing board" });
    this.ground = drawn("g", {});
    this.parts = {
      grid: drawn("path", { class: "ml-lines" }),
      axes: drawn("path", { class: "ml-lines ml-strong" }),
      casing: drawn("path", { class: "ml-casing" }),
      drawn: drawn("path", { class: "ml-drawn" }),
      curve: drawn("path", { class: "ml-curve" }),
      traces: drawn("g", {}),
      begin: drawn("circle", { class: "ml-begin", r: 0.1 }),
      end: drawn("path", { class: "ml-end" }),
      bodies: drawn("g", {}),
      cursor: drawn("path", { class: "ml-cursor" }),
    };
    this.ground.append(...Object.values(this.parts));
    this.svg.append(this.ground);
    this.scale = Object.assign(document.createElement("p"), { className: "ml-scale" });
    const view = Object.assign(document.createElement("div"), { className: "ml-ground" });
    view.append(this.svg, this.scale);
    this.element.append(this.tools(), view);
    this.listen();
    this.look();
  }

  tools() {
    const row = document.createElement("div");
    row.className = "ml-tools";
    row.setAttribute("role", "group");
    row.setAttribute("aria-label", "Lines to take, and what to do with them");
    const button = (text, label, act) => {
      const made = Object.assign(document.createElement("button"), { type: "button", className: "ml-kind", textContent: text });
      if (label) made.setAttribute("aria-label", label);
      made.addEventListener("click", act);
      row.append(made);
      return made;
    };
    for (const [name, shape] of Object.entries(SHAPES)) button(name, "", () => this.take(shape()));
    this.undoing = button("Undo", "Undo the last step", () => this.undo());
    this.clearing = button("Clear", "Clear the line", () => this.put([]));
    button("−", "Show more of the ground", () => this.zoom(1.4));
    button("+", "Show less of the ground", () => this.zoom(1 / 1.4));
    return row;
  }

  // -- the line -----------------------------------------------------------------------------------

  /** Another line, as a step that can be undone. */
  put(points) {
    this.past.push(this.points);
    this.past.splice(0, this.past.length - UNDO);
    this.points = points;
    this.changed();
  }

  /** A line that may lie anywhere: all of it is shown. */
  take(points) {
    this.put(points);
    this.fit();
  }

  undo() {
    if (!this.past.length) return;
    this.points = this.past.pop();
    this.changed();
  }

  /** A point more; a first one after a line that was drawn begins another. */
  add(point) {
    this.put([...this.points, point]);
  }

  /** Draw a line: as it was given, and as the curve (a Path, or null) that is to be walked. */
  show(path) {
    const { casing, drawn: given, curve, begin, end } = this.parts;
    const line = path ? path.places : this.points;
    given.setAttribute("d", outline(this.points));
    casing.setAttribute("d", outline(line));
    curve.setAttribute("d", outline(line));
    begin.setAttribute("visibility", this.points.length ? "visible" : "hidden");
    if (this.points.length) place(begin, this.points[0]);
    end.setAttribute("d", path ? arrow(path) : "");
    this.undoing.disabled = !this.past.length;
    this.clearing.disabled = !this.points.length;
  }

  /** Where roots were: lines of [color, [[x, z], ...]]. */
  trace(lines) {
    this.parts.traces.replaceChildren(...lines.map(([color, places]) => drawn("path", { class: "ml-trace", stroke: color, d: outline(places) })));
  }

  /** Where bodies are now: [color, [x, z]]. */
  mark(bodies) {
    this.parts.bodies.replaceChildren(...bodies.map(([color, at]) => place(drawn("circle", { class: "ml-body", r: 0.13, fill: color }), at)));
  }

  // -- what is seen -------------------------------------------------------------------------------

  /** Show the whole line. */
  fit() {
    const [low, high] = [Math.min, Math.max].map((most) => [0, 1].map((axis) => most(...this.points.map((point) => point[axis]))));
    this.middle = [0, 1].map((axis) => (low[axis] + high[axis]) / 2);
    const across = Math.max(high[0] - low[0] + 1.2, (high[1] - low[1] + 1.2) / ASPECT);
    this.width = Math.min(Math.max(across, this.width, NARROWEST), WIDEST);
    this.look();
  }

  zoom(factor) {
    this.width = Math.min(Math.max(this.width * factor, NARROWEST), WIDEST);
    this.look();
  }

  look() {
    const { width, middle: [x, z] } = this;
    const height = ASPECT * width;
    this.svg.setAttribute("viewBox", `${-width / 2} ${-height / 2} ${width} ${height}`);
    this.ground.setAttribute("transform", `scale(-1 -1) translate(${-x} ${-z})`);
    const step = [1, 2, 5, 10, 20].find((metres) => width / metres <= 16) ?? 20;
    const lines = (every) => {
      let path = "";
      for (let at = every * Math.ceil((x - width / 2) / every); at <= x + width / 2; at += every) path += `M${at} ${z - height / 2}v${height}`;
      for (let at = every * Math.ceil((z - height / 2) / every); at <= z + height / 2; at += every) path += `M${x - width / 2} ${at}h${width}`;
      return path;
    };
    this.parts.grid.setAttribute("d", lines(step));
    this.parts.axes.setAttribute("d", lines(5 * step));
    this.scale.textContent = `Seen from above; lines every ${step} m`;
    this.svg.setAttribute("aria-label", `Ground seen from above, ${width.toFixed(0)} by ${height.toFixed(0)} metres, to draw a line on. ${HELP}`);
    this.showCursor();
  }

  // -- mouse, finger, keys ------------------------------------------------------------------------

  listen() {
    this.svg.addEventListener("pointerdown", (event) => this.press(event));
    this.svg.addEventListener("pointermove", (event) => this.drag(event));
    this.svg.addEventListener("pointerup", (event) => this.release(event));
    this.svg.addEventListener("pointercancel", () => { this.stroke = undefined; this.changed(); });
    this.svg.addEventListener("keydown", (event) => this.key(event));
  }

  /** Metres on the ground below the pointer. */
  under({ clientX, clientY }) {
    const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(this.ground.getScreenCTM().inverse());
    return [x, y];
  }

  press(event) {
    if (!event.isPrimary || event.button > 0) return;
    event.preventDefault();
    this.svg.setPointerCapture(event.pointerId);
    this.svg.focus({ preventScroll: true, focusVisible: false });
    this.stroke = [this.under(event)];
    this.pressed = [event.clientX, event.clientY];
    this.far = false;
  }

  drag(event) {
    if (!this.stroke || !event.isPrimary) return;
    this.far ||= Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) > CLICK;
    if (!this.far) return;
    const several = event.getCoalescedEvents?.() ?? [];
    this.stroke.push(...(several.length ? several : [event]).map((one) => this.under(one)));
    const line = this.goesOn ? [...this.points, ...this.stroke] : this.stroke;
    for (const part of ["casing", "curve"]) this.parts[part].setAttribute("d", outline(line));
    this.parts.drawn.setAttribute("d", "");
    this.parts.end.setAttribute("d", "");
  }

  /** Whether a stroke goes on from where the line ends. */
  get goesOn() {
    const end = this.points.at(-1);
    return Boolean(end) && Math.hypot(end[0] - this.stroke[0][0], end[1] - this.stroke[0][1]) < JOIN;
  }

  release(event) {
    if (!this.stroke || !event.isPrimary) return;
    const tapped = rounded(this.stroke[0]);
    const line = this.far ? smoothed([...(this.goesOn ? [this.points.at(-1)] : []), ...this.stroke]) : null;
    const kept = this.far && this.goesOn ? this.points.slice(0, -1) : [];
    this.stroke = undefined;
    if (line) this.put([...kept, ...line]);
    else this.add(tapped);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const far = event.shiftKey ? 1 : 0.25;
    const ways = { ArrowLeft: [far, 0], ArrowRight: [-far, 0], ArrowUp: [0, far], ArrowDown: [0, -far] };
    const actions = {
      Enter: () => this.add(rounded(this.cursor)),
      " ": () => this.add(rounded(this.cursor)),
      Backspace: () => this.undo(),
      Escape: () => this.points.length && this.put([]),
      "+": () => this.zoom(1 / 1.4),
      "-": () => this.zoom(1.4),
    };
    const way = ways[event.key];
    if (way) this.cursor = this.cursor.map((at, axis) => at + way[axis]);
    else if (actions[event.key]) actions[event.key]();
    else return;
    event.preventDefault();
    event.stopPropagation(); // a notebook has its own meaning for these keys
    this.showCursor();
  }

  showCursor() {
    const [w, h] = [this.width / 2, (ASPECT * this.width) / 2].map((half) => half - 0.1);
    this.cursor = this.cursor.map((at, axis) => Math.min(Math.max(at, this.middle[axis] - [w, h][axis]), this.middle[axis] + [w, h][axis]));
    const [x, z] = this.cursor;
    this.parts.cursor.setAttribute("d", `M${x - 0.25} ${z}h0.5M${x} ${z - 0.25}v0.5`);
  }
}

function drawn(tag, attributes) {
  const made = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

function place(circle, [x, z]) {
  circle.setAttribute("cx", x);
  circle.setAttribute("cy", z);
  return circle;
}

const rounded = (point) => point.map((metres) => Math.round(100 * metres) / 100);

const outline = (places) => (places.length ? `M${places.map(([x, z]) => `${x.toFixed(3)} ${z.toFixed(3)}`).join("L")}` : "");

/** The head of an arrow at a path's end. */
function arrow(path) {
  const [end, before] = [path.at(path.length), path.at(path.length - 0.1)];
  const way = Math.atan2(end[0] - before[0], end[1] - before[1]);
  const corner = (turn) => `${(end[0] + 0.28 * Math.sin(way + turn)).toFixed(3)} ${(end[1] + 0.28 * Math.cos(way + turn)).toFixed(3)}`;
  return `M${corner(2.6)}L${end[0].toFixed(3)} ${end[1].toFixed(3)}L${corner(-2.6)}`;
}
