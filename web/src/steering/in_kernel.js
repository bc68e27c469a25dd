// Steering by a kernel, window by window: motionlab/viewer/live/steer_kernel.py. The page asks for a window when it is
// about to need one and says with it what is wished, so that nothing runs ahead and nobody has to be stopped.
import { JointAngles } from "../network/joint_angles.js";
import { LiveTrack } from "../network/live_track.js";
import { late } from "./pace.js";
import { KEPT } from "./steered.js";

const AHEAD = 6; // frames: a window is asked for so long before it is due
const PATIENCE = 20_000; // milliseconds without an answer, after which a window is asked for again
const AGAIN = 1000; // milliseconds after a refusal

/** What a kernel steers, as the player wants it. */
class KernelSteered {
  constructor(model, { live, encoding, fps, wishes }, settings, cast) {
    Object.assign(this, { model, settings: { ...settings }, fps, cast, look: live.look, encoding: new JointAngles(encoding) });
    Object.assign(this, { tracks: [], records: [], wish: {}, last: -1, cost: 0, wishes });
    this.restart();
  }

  /** What is asked with the next window; a path is sent as the line that was drawn. */
  steer({ path, ...wish }) {
    this.wish = path ? { ...wish, line: path.drawn } : wish;
  }

  /** Begin anew: what is there stays until the kernel answers; answers to what was asked before are not heard any more. */
  restart() {
    this.run = `${Date.now()}-${Math.random()}`; // another view of the widget asks for others
    Object.assign(this, { fresh: true, asked: null, wanted: 0 });
    this.ask("begin");
  }

  reach(frame) {
    this.wanted = frame;
    const now = performance.now();
    const waits = this.asked !== null && now - this.asked < PATIENCE;
    if (!waits && this.last >= 0 && this.last < frame + AHEAD) this.ask("go");
  }

  ask(what) {
    this.asked = performance.now();
    this.model.send({ do: what, run: this.run, settings: this.settings, wish: this.wish });
  }

  /** A window: rows and places of each character, what was asked and done, how late it is, and what it took (seconds). */
  heard({ characters, seconds }) {
    this.asked = null;
    if (this.fresh) {
      Object.assign(this, { fresh: false, last: -1 });
      this.tracks.length = 0; // the same array always: the player keeps it
    }
    const [first, [{ rows: { length }, late }]] = [this.last + 1, characters];
    this.latency = [AHEAD, AHEAD + length].map((frames) => (frames + late) / this.fps);
    characters.forEach(({ rows, places, asked, done, record }, k) => {
      this.tracks[k] ??= new LiveTrack(this.encoding, this.fps, 0, { ...this.look, ...this.cast[k] }, KEPT);
      this.records[k] = record;
      rows.forEach((row, t) => {
        const [x, z, yaw] = places[t];
        const place = { x, z, yaw };
        this.encoding.points(row, place, this.tracks[k].room(first + t));
        this.tracks[k].add(first + t, Float32Array.from(row), place, { asked, pace: done[0], bearing: done[1] });
      });
    });
    this.last = first + length - 1;
    if (seconds) this.cost = (1000 * seconds) / length;
    if (this.last < this.wanted + AHEAD && this.last > 0) this.ask("go");
  }

  /** What was asked leads nowhere; something else may be asked soon. */
  refused() {
    this.asked = performance.now() - PATIENCE + AGAIN;
  }
}

export class KernelSource {
  ready = true;
  looks = false;

  /** `model` is the widget's. */
  constructor(model) {
    this.model = model;
    this.hear = (message) => this.told(message);
    model.on("msg:custom", this.hear);
  }

  invitation() {
    return "Begin";
  }

  /** Characters who stand where they begin. */
  load(network, settings, cast) {
    return new Promise((resolve, reject) => {
      Object.assign(this, { resolve, reject });
      this.steered = new KernelSteered(this.model, network, settings, cast);
    });
  }

  told(message) {
    if (message.run !== this.steered?.run) return;
    if (message.failed) {
      this.failed = message.failed;
      this.steered.refused();
      return this.reject(new Error(message.failed));
    }
    this.failed = "";
    this.steered.heard(message);
    this.resolve(this.steered);
  }

  /** `pace` as of a PageSource. */
  cost({ cost, fps, latency, settings }, pace) {
    if (this.failed) return this.failed;
    const [least, most] = latency.map((seconds) => (seconds + settings.delay).toFixed(2));
    const made = Math.round(1000 / Math.max(cost, 1e-3));
    const slow = made < fps ? " Time passes slower." : late(pace);
    return `The kernel makes ${made} frames a second; ${fps} are needed. A wish is seen after ${least} to ${most} s.${slow}`;
  }

  dispose() {
    this.model.off("msg:custom", this.hear);
  }
}
