// Draw a path, and somebody walks along it: the board, what may be chosen, the player, and how far from the line
// it went. Who finds the walk, the page's own network or a kernel, is a walker; see in_page.js and in_kernel.js.
import { Track } from "../motion.js";
import { LEAST, Path } from "../network/path.js";
import { field, provenance } from "../network/panel.js";
import { addStyle } from "../style.js";
import { currentTheme, watchTheme } from "../theme.js";
import { Board } from "./board.js";
import { PageWalker } from "./in_page.js";
import { SHAPES } from "./shapes.js";
import { WalkPlayer } from "./walk_player.js";

const LONGEST = 200; // metres that are walked here
const ROUNDED = 0.02; // metres that corners were cut by: what is told
const OWN = "a line of my own";

const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });

export class PathFigure {
  /** `content` as motionlab/viewer/live/draw_path_settings.py writes it; `still` is an image URL. */
  constructor(figure, content, still, walker = new PageWalker(content.live)) {
    Object.assign(this, { figure, content, still, walker, solved: null, walked: null });
    addStyle(figure);
    this.values = Object.fromEntries(content.controls.map(({ name, value }) => [name, value]));
    this.board = new Board(() => this.drawn());
    this.board.svg.dataset.lmSuppressShortcuts = ""; // JupyterLab has its own use for arrows
    this.stage = make("div", "ml-stage");
    this.build(content);
    this.unwatchTheme = watchTheme((theme) => { figure.dataset.mlTheme = theme; });
    figure.dataset.mlTheme = currentTheme();
    figure.addEventListener("motionlab:frame", () => this.markBodies());
    if (content.solved.length) this.choose(0);
    else this.board.take(SHAPES["Figure eight"]());
  }

  build({ controls, starts, solved, facts }) {
    const panel = make("div", "ml-panel");
    const grid = make("div", "ml-grid");
    this.fields = Object.fromEntries(controls.map((control) => [control.name, field(control, ["what suits the speed", ...starts], (name, value) => { this.values[name] = value; })]));
    if (solved.length) grid.append(this.chooser(solved));
    grid.append(...Object.values(this.fields));
    this.go = Object.assign(make("button", "ml-load", this.walker.invitation), { type: "button" });
    this.go.addEventListener("click", () => this.walk());
    this.halt = Object.assign(make("button", "ml-load ml-stop", "Stop"), { type: "button", disabled: true });
    this.halt.addEventListener("click", () => {
      this.halt.disabled = true;
      this.walker.stop();
    });
    this.line = make("p", "ml-status");
    this.status = make("p", "ml-status");
    this.results = make("ul", "ml-results");
    for (const told of [this.line, this.status, this.results]) told.setAttribute("aria-live", "polite");
    panel.append(grid, ...(facts.length ? [provenance(facts)] : []));
    const [left, right, both] = [make("div", "ml-side"), make("div", "ml-side"), make("div", "ml-both")];
    const buttons = make("div", "ml-buttons");
    buttons.append(this.go, this.halt);
    left.append(this.board.element, this.line, buttons, this.status);
    right.append(this.stage, this.results);
    both.append(left, right);
    this.figure.append(both, panel);
  }

  /** Which of the paths that were solved beforehand. */
  chooser(solved) {
    const box = make("label", "ml-field");
    this.choice = make("select", "ml-choice");
    [OWN, ...solved.map(({ name }) => name)].forEach((name, i) => this.choice.add(new Option(name, i - 1)));
    this.choice.setAttribute("aria-label", "Solved beforehand");
    this.choice.addEventListener("change", () => this.choose(Number(this.choice.value)));
    box.append(make("span", "ml-caption", "Solved beforehand"), this.choice);
    return box;
  }

  // -- the line -----------------------------------------------------------------------------------

  /** Take a path that was solved beforehand, and its walk; -1 for none. */
  choose(number) {
    if (number < 0) return this.board.put([]);
    const { name, points, speed, start } = this.content.solved[number];
    const { bodies, tracks, stride, fps, magnified } = this.content.walks;
    this.set("speed", speed);
    this.board.take(points); // which forgets the start of the one before
    this.set("start", start);
    this.lent = start;
    this.choice.value = number;
    const data = tracks[number];
    const track = new Track({ ...bodies[data.body], ...data, label: "solved beforehand" }, stride, fps, magnified);
    this.solved = { name, track, finished: true, error: this.path.error(track.ground(), track.rate) };
    this.show();
  }

  set(name, value) {
    if (value === null) return;
    this.values[name] = value;
    const input = this.fields[name].querySelector("input, select");
    input.value = value;
    input.dispatchEvent(new Event("input"));
  }

  /** There is another line on the board. */
  drawn() {
    this.walker.stop();
    [this.path, this.trouble, this.note] = judged(this.board.points);
    this.board.show(this.path);
    this.line.textContent = this.trouble ?? this.note;
    if (this.solved && this.values.start === this.lent) this.set("start", -1);
    Object.assign(this, { solved: null, walked: null });
    delete this.figure.dataset.walked;
    if (this.choice) this.choice.value = -1;
    this.go.disabled = !this.path || this.walking;
    this.say("");
    this.show();
  }

  // -- the walk -----------------------------------------------------------------------------------

  async walk() {
    if (this.walking || !this.path) return;
    this.setWalking(true);
    const { path, values, board: { points } } = this;
    const mine = () => this.path === path; // until another line is drawn
    const name = `walk along ${this.solved?.name ?? "a line"}`;
    this.walked = null;
    delete this.figure.dataset.walked; // tells that a walk is there, and whole
    try {
      await this.walker.walk({ ...values, path, points, name }, {
        said: (text) => this.say(text),
        grown: (track, share) => mine() && this.grown(track, share),
        done: (found) => mine() && this.done(found),
      });
    } catch (error) {
      this.say(error.message);
    }
    this.setWalking(false);
  }

  setWalking(walking) {
    this.walking = walking;
    this.halt.disabled = !walking;
    this.go.disabled = walking || !this.path;
    if (!walking) this.go.textContent = this.walker.invitation;
  }

  grown(track, share) {
    if (this.walked?.track !== track) {
      this.walked = { track, growing: true };
      this.show();
    } else this.player.grow(true);
    this.drawTraces();
    this.say(`Walking: ${10 * Math.floor(10 * share)} % of the line`);
  }

  done({ error, notes, finished }) {
    Object.assign(this.walked, { error, finished, growing: false });
    this.player.grow(false);
    this.figure.dataset.walked = "";
    this.say(notes.length ? `What could not be: ${notes.join("; ")}.` : "");
    this.sayErrors();
  }

  // -- what is seen -------------------------------------------------------------------------------

  get tracks() {
    return [this.solved, this.walked].flatMap((one) => (one ? [one.track] : []));
  }

  /** The player with the walks that there are. */
  show() {
    this.player?.dispose();
    this.player = null;
    this.stage.replaceChildren();
    const { height, floor, fps, pathColor } = this.content;
    if (this.tracks.length) {
      const look = { height, floor, fps, autoplay: true };
      this.player = new WalkPlayer(this.stage, look, this.still, this.tracks, this.path.places, pathColor, Boolean(this.walked?.growing));
    } else this.stage.append(make("p", "ml-wait", "Draw a line, choose how fast, and press walk."));
    this.drawTraces();
    this.sayErrors();
  }

  drawTraces() {
    this.board.trace(this.tracks.map((track) => [track.color, track.ground()]));
    this.markBodies();
  }

  markBodies() {
    this.board.mark(this.player ? this.tracks.map((track) => [track.color, track.onGround(this.player.frame)]) : []);
  }

  /** How far from the line each of them went. */
  sayErrors() {
    const told = [this.solved, this.walked].filter((one) => one && !one.growing);
    this.results.replaceChildren(...told.map(({ track, error, finished }) => {
      const item = make("li", "ml-name");
      item.style.setProperty("--ml-color", track.color);
      const drawn = error && error.drawn - error.curve > 0.5 ? `; ${cm(error.drawn)} from it with its corners sharp` : "";
      const far = finished ? "" : ", as far as it went";
      item.append(make("span", "", `${track.label}: ${error ? `${cm(error.curve)} from the line${far}${drawn}` : "too short to say"}`));
      return item;
    }));
    if (told.length) this.results.append(make("li", "ml-small", "Root mean square distance of the hips, after the first second."));
  }

  say(text) {
    if (this.status.textContent !== text) this.status.textContent = text;
  }

  dispose() {
    this.walker.stop();
    this.walker.dispose?.();
    this.player?.dispose();
    this.unwatchTheme();
  }
}

const cm = (value) => `${value < 10 ? value.toFixed(1) : value.toFixed(0)} cm`;

/** A Path of what was drawn, or null and what is wrong with it; and what is to be said of it. */
function judged(points) {
  if (!points.length) return [null, "Draw a line with mouse or finger, tap its corners, or take a shape above."];
  const differ = points.filter(([x, z], i) => i === 0 || x !== points[i - 1][0] || z !== points[i - 1][1]);
  if (differ.length < 2) return [null, "One point leads nowhere: set another."];
  const long = differ.reduce((sum, [x, z], i) => sum + (i ? Math.hypot(x - differ[i - 1][0], z - differ[i - 1][1]) : 0), 0);
  if (long < LEAST) return [null, `A line of ${(100 * long).toFixed(0)} cm: it must be ${100 * LEAST} cm long at least.`];
  if (long > LONGEST) return [null, `A line of ${long.toFixed(0)} m: here it may be ${LONGEST} m long at most.`];
  const path = new Path(points);
  const cut = path.farthest;
  const corners = cut > ROUNDED ? `, its corners rounded as people do, by up to ${(100 * cut).toFixed(0)} cm` : "";
  const crossed = path.crossings;
  const times = ["", "once", "twice"][crossed] ?? `${crossed} times`;
  const crossing = crossed ? `. It crosses itself ${times}: the way on is the one it was drawn in` : "";
  return [path, null, `A line of ${path.length.toFixed(1)} m${corners}${crossing}.`];
}
