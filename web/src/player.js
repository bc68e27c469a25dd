// The motion player: puts figures, marks, camera, clock and controls together in one element.
import { Bar } from "./bar.js";
import { Orbit } from "./camera.js";
import { Chart } from "./chart.js";
import { Clock } from "./clock.js";
import { Mannequin } from "./mannequin.js";
import { LINES } from "./ground.js";
import { attend, forget } from "./loop.js";
import { Contacts, disposeAll, Path, Trail } from "./marks.js";
import { decode, ROOT_UNIT } from "./motion.js";
import { addStyle } from "./style.js";
import { sharedStage } from "./stage.js";
import { currentTheme, THEMES, watchTheme } from "./theme.js";

const REDUCED = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)");
const SLOW = 0.05; // seconds from picture to picture above which they get fewer pixels
export const TWIST = "made from points: how bones lie is known, how they are twisted about themselves is not.";
const LEAST_HEIGHT = 1.5; // metres that a view shows

export class Player {
  /**
   * Build the player inside `host`. `still` is an image URL for machines without WebGL. Tracks and
   * clock are those of the payload, unless others are given: the motion is still being made.
   */
  constructor(host, payload, still, given = null, clock = new Clock(payload.frames, payload.fps)) {
    addStyle(host);
    this.host = host;
    this.still = still;
    this.given = given;
    this.payload = payload;
    this.clock = clock;
    this.clock.speed = payload.speed ?? 1;
    this.clock.once = this.bare = payload.bare ?? false; // plays once, by what stands around it alone
    this.follow = payload.follow ?? true;
    this.overlay = payload.overlay ?? false;
    this.chosen = payload.chosen ?? 0; // the track that is seen, if one is at a time
    this.visible = false;
    this.dirty = true;
    // At least as tall as a man standing, so that a crawling body looks as small as it is.
    this.tall = Math.max(...this.tracks.map((track) => track.top() - payload.floor), LEAST_HEIGHT);
    this.build(payload);
    this.watch();
    this.sayFrame();
    // Without a finger on it, motion starts only where the reader has not asked for calm.
    this.clock.playing = Boolean(payload.autoplay) && !REDUCED?.matches;
    this.refresh();
  }

  build({ height, frames, fps, duration = `${(frames / fps).toFixed(1)} seconds` }) {
    this.view = document.createElement("div");
    this.view.className = "ml-view";
    this.view.style.height = `${height}px`;
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    const names = this.tracks.map((track) => track.label).filter(Boolean).join(", ") || "a motion";
    this.canvas.setAttribute(
      "aria-label",
      `Moving figure: ${names}, ${duration}. ${this.bare ? "" : "Space plays and pauses, arrow keys step, Home and End jump, "}` +
        `Shift with arrows turns the view, plus and minus zoom${this.bare ? "" : ", F follows, R resets"}.`,
    );
    this.labels = document.createElement("div");
    this.labels.className = "ml-labels";
    this.labels.setAttribute("aria-hidden", "true");
    this.view.append(this.canvas, this.labels);
    if (this.magnified !== 1) this.view.append(this.sayScale());
    this.bar = new Bar(this, frames, fps, this.several);
    this.chart = this.payload.chart && new Chart(this, this.payload.chart, frames);
    this.host.append(this.view, ...(this.chart ? [this.chart.element] : []), ...(this.bare ? [] : [this.bar.element]));
    this.orbit = new Orbit(this.canvas, !REDUCED?.matches);
    this.orbit.controls.addEventListener("change", () => { this.dirty = true; });
    this.view.addEventListener("keydown", (event) => this.key(event));
    this.lookFromStart();
  }

  /** A magnified body looks as any other: the lines on the floor tell how large it is. */
  sayScale() {
    const note = document.createElement("p");
    note.className = "ml-scale";
    note.textContent = `Lines on the floor: every ${inWords(LINES / this.magnified)}`;
    return note;
  }

  watch() {
    const margin = "150px"; // be ready a little before the player scrolls into the window
    this.sight = new IntersectionObserver(([entry]) => this.seen(entry.isIntersecting), { rootMargin: margin });
    this.sight.observe(this.view);
    this.resizing = new ResizeObserver(() => { this.dirty = true; });
    this.resizing.observe(this.view);
    this.unwatchTheme = watchTheme((theme) => this.paint(theme));
    this.paint(currentTheme());
  }

  seen(visible) {
    this.visible = visible;
    if (visible) this.enter();
    else this.leave();
    attend(this, visible);
  }

  /** Figures are made when they come into sight and let go when they leave it: a page may hold many players. */
  enter() {
    if (this.casts || !this.canvas.isConnected) return;
    this.stage = sharedStage(this);
    if (!this.stage) return this.sayMissing();
    // Pixels of the picture per pixel of the page: while it rests, and while it moves.
    this.fine ??= this.stage.software ? 1.5 : Math.min(globalThis.devicePixelRatio || 1, 2);
    this.coarse ??= this.stage.coarse ?? (this.stage.software ? 1 : this.fine);
    this.casts = this.tracks.map((track, i) => this.cast(track, i));
    this.dirty = true;
  }

  leave() {
    for (const actor of this.casts?.flat() ?? []) disposeAll(actor);
    this.casts = this.decoded = null;
    this.stage?.leave(this, this.canvas);
  }

  /** What was sent takes less room than what it becomes, which is there while somebody looks. */
  get tracks() { return this.given ?? (this.decoded ??= decode(this.payload)); }

  /** What is drawn of a track. */
  cast(track, i) {
    const { floor, trail = [], paths = [] } = this.payload;
    return [
      new Mannequin(track),
      ...(track.contacts ? [new Contacts(track, floor)] : []),
      ...trail.map((point) => new Trail(track, point)),
      ...paths.filter((path) => path.track == null || path.track === i).map((path) => new Path(path, floor)),
    ];
  }

  sayMissing() {
    const note = document.createElement("p");
    note.className = "ml-note";
    note.textContent = "This browser shows no WebGL, which the moving figure needs; here is a still picture of it.";
    this.canvas.remove();
    if (this.still) this.view.append(Object.assign(new Image(), { src: this.still, alt: "Still picture of the motion" }));
    this.view.append(note);
    this.tell("motionlab:missing");
  }

  // -- what the page, the widget and the controls call -------------------------------------------

  get frame() { return this.clock.frame; }
  get playing() { return this.clock.playing; }
  get speed() { return this.clock.speed; }

  setFrame(frame) {
    this.clock.seek(frame);
    this.refresh();
  }

  /** Take time in hand: go to a frame and stay there. */
  scrub(frame) {
    if (this.playing) this.pause();
    this.setFrame(frame);
  }

  play() { this.set("playing", true); }
  pause() { this.set("playing", false); }
  toggle() { this.set("playing", !this.playing); }

  /** Whether the reader can have all motions in one picture. */
  get several() { return this.tracks.length > 1 && !this.payload.choose; }

  /** Set playing, speed, follow, overlay or chosen. */
  set(name, value) {
    const owner = name === "playing" || name === "speed" ? this.clock : this;
    if (owner[name] === value) return;
    owner[name] = value;
    if (name === "follow" || name === "overlay") this.lookFromStart(true);
    this.refresh();
    this.tell("motionlab:state", { name, value });
  }

  reset() {
    this.lookFromStart();
    this.scrub(0);
  }

  /** How many times larger than they are bodies are drawn. */
  get magnified() { return this.payload.magnified ?? 1; }

  /** The tracks that can be saved: all that can be seen now. */
  get saved() { return this.payload.choose ? [this.tracks[this.chosen]] : this.tracks; }

  /** What a saved file holds, in words. */
  get savedHow() {
    const [track] = this.tracks;
    const exact = track.angles ? `root to ${inWords(ROOT_UNIT / this.magnified)}, joints to 0.01°.` : TWIST;
    return `${Number(track.rate.toPrecision(4))} frames a second, ${exact}`;
  }

  // -- time ---------------------------------------------------------------------------------------

  tick(seconds) {
    if (this.clock.tick(seconds)) {
      this.economise(seconds);
      this.refresh();
      if (!this.playing) this.tell("motionlab:ended");
    }
    if (this.orbit.controls.update()) this.dirty = true;
    if (this.stage?.gone && this.casts) {
      this.leave();
      this.enter(); // or it says that there is no other stage
    }
    if (this.dirty && this.casts) this.draw();
  }

  refresh() {
    this.dirty = true;
    this.bar.show(this);
    this.chart?.show(this);
    if (this.frame !== this.told) this.sayFrame();
  }

  sayFrame() {
    this.told = this.frame;
    this.host.dataset.frame = this.frame;
    this.tell("motionlab:frame", { frame: this.frame });
  }

  tell(type, detail) {
    this.host.dispatchEvent(new CustomEvent(type, { detail, bubbles: true }));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const second = Math.round(this.clock.fps);
    const actions = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.scrub(this.frame - 1),
      ArrowRight: () => this.scrub(this.frame + 1),
      PageUp: () => this.scrub(this.frame - second),
      PageDown: () => this.scrub(this.frame + second),
      Home: () => this.scrub(0),
      End: () => this.scrub(this.clock.frames - 1),
      f: () => this.set("follow", !this.follow),
      o: () => this.several && this.set("overlay", !this.overlay),
      r: () => this.reset(),
      "+": () => this.orbit.turn(0, 0, 1 / 1.15),
      "-": () => this.orbit.turn(0, 0, 1.15),
    };
    const turns = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    const key = this.bare && !"+-".includes(event.key) ? null : actions[event.key];
    const action = event.shiftKey && turns[event.key] ? () => this.orbit.turn(...turns[event.key]) : key;
    if (!action) return;
    event.preventDefault();
    event.stopPropagation(); // a notebook has its own meaning for these keys
    action();
    this.dirty = true;
  }

  // -- picture ------------------------------------------------------------------------------------

  /** Which tracks share a picture: each its own, all together, or the chosen one alone. */
  get cells() {
    if (this.payload.choose) return [[this.chosen]];
    return this.overlay ? [this.tracks.map((_, i) => i)] : this.tracks.map((_, i) => [i]);
  }

  /** Take the starting view; with `keepAngle` only the distance changes. */
  lookFromStart(keepAngle = false) {
    const [dx, dz] = this.tracks[0].heading();
    const arm = this.orbit.eye.position;
    this.azimuth = Math.atan2(dx, dz) + 0.9;
    const azimuth = keepAngle ? Math.atan2(arm.x, arm.z) : this.azimuth;
    const cells = this.payload.choose ? this.tracks.map((_, i) => [i]) : this.cells;
    const room = Math.max(...cells.map((cell) => this.room(cell)));
    // As a share of the body's height: where it looks, and of the way to it, how near it goes.
    const [middle, near] = this.payload.focus === "feet" ? [0.15, 0.5] : [0.5, 1];
    this.orbit.place(azimuth, near * (2.45 * this.tall + 1.7 * room), this.payload.floor + middle * this.tall);
    this.dirty = true;
  }

  /** Metres from the middle of a view to the farthest body in it, at any time. */
  room(cell) {
    let most = 0;
    for (let frame = 0; frame < this.clock.frames; frame += Math.max(1, this.clock.frames >> 6)) {
      const middle = this.middle(cell, frame);
      for (const i of cell) {
        const [x, z] = this.tracks[i].place(frame);
        most = Math.max(most, Math.hypot(x - middle.x, z - middle.z));
      }
    }
    return Math.min(Math.max(most - 0.3, 0), 30);
  }

  /** Where a view looks: along with its bodies, or at the middle of where they go. */
  middle(cell, frame) {
    if (this.follow) {
      const places = cell.map((i) => this.tracks[i].place(frame));
      const mean = (axis) => places.reduce((sum, place) => sum + place[axis], 0) / places.length;
      return { x: mean(0), z: mean(1) };
    }
    const boxes = cell.map((i) => this.tracks[i].extent);
    const low = (axis) => Math.min(...boxes.map((box) => box[axis]));
    const high = (axis) => Math.max(...boxes.map((box) => box[axis + 2]));
    return { x: (low(0) + high(0)) / 2, z: (low(1) + high(1)) / 2 };
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.view;
    if (!width || !height) return;
    this.dirty = false;
    const seen = this.cells.flat();
    for (const i of seen) this.tracks[i].seek(this.clock.time);
    for (const actor of seen.flatMap((i) => this.casts[i])) actor.update();
    const ratio = this.playing ? this.coarse : this.fine;
    const size = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) [this.canvas.width, this.canvas.height] = size;
    const cells = this.cells;
    const columns = gridColumns(cells.length, width / height);
    const rows = Math.ceil(cells.length / columns);
    this.views = cells.map((cell, i) => {
      const middle = this.middle(cell, this.clock.time);
      const box = { x: ((i % columns) * width) / columns, y: (Math.floor(i / columns) * height) / rows, width: width / columns, height: height / rows };
      // Every view gets its turn with the one camera just before it is drawn.
      return { ...box, middle, floor: this.payload.floor, spread: this.spread, azimuth: this.azimuth, actors: cell.flatMap((k) => this.casts[k]), aim: () => this.orbit.aim(middle, box.width / box.height) };
    });
    this.stage.draw(this.canvas, this.views, THEMES[this.theme], ratio);
    this.label(this.views, cells);
  }

  get spread() {
    return this.overlay || !this.follow ? Math.min(1.5 + Math.max(...this.cells.map((cell) => this.room(cell))), 8) : this.tall;
  }

  label(views, cells) {
    const layout = JSON.stringify([views.map(({ x, y, width, height }) => [x, y, width, height]), cells]);
    if (layout === this.labelled) return;
    this.labelled = layout;
    this.labels.replaceChildren(
      ...cells.map((cell, i) => {
        const list = document.createElement("div");
        list.className = "ml-cell";
        for (const [side, edge] of [["left", "x"], ["top", "y"], ["width", "width"], ["height", "height"]]) list.style[side] = `${views[i][edge]}px`;
        list.classList.toggle("ml-right", views[i].x > 0);
        for (const k of cell) {
          const { label, color } = this.tracks[k];
          if (!label) continue;
          const chip = document.createElement("span");
          chip.className = "ml-label";
          chip.style.setProperty("--ml-color", color);
          chip.textContent = label;
          list.append(chip);
        }
        return list;
      }),
    );
  }

  /**
   * Slow machines (pictures drawn by the processor) get fewer pixels rather than fewer frames, as
   * long as the figure moves.
   */
  economise(seconds) {
    this.pace = 0.9 * (this.pace ?? SLOW / 2) + 0.1 * seconds;
    if (this.pace > SLOW && this.coarse > 0.75) {
      this.coarse *= 0.85;
      if (this.stage) this.stage.coarse = this.coarse; // who comes next need not find out again
      this.pace = undefined;
    }
  }

  paint(theme) {
    this.theme = theme;
    this.host.dataset.mlTheme = theme;
    this.dirty = true;
  }

  dispose() {
    this.leave();
    forget(this);
    this.sight.disconnect();
    this.resizing.disconnect();
    this.unwatchTheme();
    this.orbit.dispose();
  }
}

/** A length in metres. */
function inWords(length) {
  const [size, unit] = length < 0.01 ? [1000 * length, "mm"] : length < 1 ? [100 * length, "cm"] : [length, "m"];
  return `${Number(size.toPrecision(3))} ${unit}`;
}

/** Columns that give the views the most upright, yet not too narrow, shape. */
function gridColumns(count, aspect) {
  let columns = count;
  while (columns > 1 && aspect / columns < 0.45) columns = Math.ceil(columns / 2);
  return columns;
}
