// A line to go along, drawn on the ground beside the picture: who is steered goes to its beginning, along it, and stands
// at its end, unless a hand steers him elsewhere.
import { Board } from "../drawing/board.js";
import { LEAST, Path } from "../network/path.js";

const LONGEST = 100; // metres
const EVERY = 6; // frames between two looks at where he is

const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });

export class Course {
  /** `go(path)` is called with a Path to go along, or null. */
  constructor(go) {
    this.go = go;
    this.element = make("details", "ml-course");
    this.board = new Board(() => this.drawn());
    this.board.svg.dataset.lmSuppressShortcuts = ""; // JupyterLab has its own use for arrows
    this.said = make("p", "ml-status");
    this.said.setAttribute("aria-live", "polite");
    this.element.append(make("summary", "", "Draw a line, and he goes along it"), this.board.element, this.said);
    this.element.addEventListener("toggle", () => this.element.open && this.find());
    this.drawn();
  }

  /** The ground around where he is. */
  find() {
    if (!this.place || this.board.points.length) return;
    this.board.middle = [...this.place];
    this.board.cursor = [...this.place];
    this.board.look();
  }

  drawn() {
    const { points } = this.board;
    const long = points.reduce((sum, [x, z], i) => sum + (i ? Math.hypot(x - points[i - 1][0], z - points[i - 1][1]) : 0), 0);
    const path = long >= LEAST && long <= LONGEST ? new Path(points) : null;
    this.board.show(path);
    this.said.textContent = path ? `A line of ${path.length.toFixed(1)} m; he goes to where it begins, and stands at its end.`
      : long > LONGEST ? `A line of ${long.toFixed(0)} m: here it may be ${LONGEST} m long at most.`
        : "Draw with mouse or finger, tap corners, or take a shape. Keys and stick take him off it.";
    this.go(path);
  }

  /** Where characters are at a frame: [color, [x, z]], the first of whom one looks at. */
  mark(bodies, frame) {
    this.place = bodies[0][1];
    if (this.element.open && frame % EVERY === 0) this.board.mark(bodies);
  }
}
