// Characters who are steered together, as the player of a motion in the making (network/live_player.js) wants them:
// it asks for frames, and gets as many as can be made in the time there is.
import { LockStream } from "../feet/lock_stream.js";
import { JointAngles } from "../network/joint_angles.js";
import { LiveTrack } from "../network/live_track.js";
import { LstmGmm } from "../network/lstm_gmm.js";
import { Refiner } from "../network/refiner.js";
import { normalizing } from "../network/rows.js";
import { FeetEnergy } from "./feet_energy.js";
import { WINDOW } from "./futures.js";
import { fastestOf, LiveControl } from "./live_control.js";

export const KEPT = 120; // seconds that can be saved
const AHEAD = 3; // frames: a window is begun so long before it is due, or who plays would wait for it
const NEAR = 1; // metres from a path's beginning from where on it is followed
const APART = 1.5; // metres between characters at first

export class Steered {
  /**
   * `weights` from weights.js; `look` as of a Dreamer; `body` as of FeetEnergy, and of a LockStream if it has a `lock`;
   * `settings`: start, seed, futures, push, temperature, memory, refined, lock, help; `cast`: for each character {label, color, futures (or none)}.
   */
  constructor(weights, look, { lock, ...body }, settings, cast) {
    const { fps } = weights;
    const encoding = new JointAngles(weights.encoding);
    Object.assign(this, { weights, look, legs: lock, settings: { ...settings }, cast, fps, encoding, tracks: [], fastest: fastestOf(weights) });
    const rows = normalizing(weights.normalizer);
    const refiner = weights.refiner && new Refiner(weights.refiner, encoding, rows);
    const network = new LstmGmm(weights.layers, weights.settings);
    const stand = weights.starts.find(({ name }) => name === "stand");
    this.parts = {
      network, encoding, refiner, fps, ...rows, fastest: this.fastest, normalizer: weights.normalizer,
      starts: weights.starts, stand: stand ? rows.normalize(stand.frame) : null,
      layers: (numbers) => network.lstm.map(({ width, depth }) => numbers.slice(depth * width, (depth + 1) * width)),
      feet: new FeetEnergy(encoding, fps, body),
    };
    this.restart();
  }

  /** Begin anew; the same settings and wishes give the same motion. */
  restart() {
    Object.assign(this, { last: 0, cost: 0, locks: null });
    const { start, seed } = this.settings;
    const begun = this.weights.starts[start];
    this.characters = this.cast.map((_, k) => new LiveControl(this.parts, begun, { x: -APART * k, z: 0, yaw: 0 }, seed));
    this.tracks.length = 0; // the same array always: the player keeps it
    this.characters.forEach((character, k) => {
      const track = new LiveTrack(this.encoding, this.fps, 0, { ...this.look, ...this.cast[k] }, KEPT);
      this.tracks.push(track);
      const { first, aim, before: { next, going } } = character;
      const { pace, bearing } = going;
      this.show(track, 0, { ...first, next, pace, bearing, component: 0, asked: aim, energies: [0], chosen: 0 });
    });
  }

  /** All of them are asked the same from the next window on: {speed, direction} or {speed, path}. */
  steer(wish) {
    for (const character of this.characters) character.steer(this.near(wish, character) ? wish : this.toBeginning(wish, character));
  }

  /** Whether somebody is on the path that is asked, or where it begins: an arc from farther away is a detour. */
  near({ path }, { aim, before: { going: { place } } }) {
    if (!path || aim.path === path) return true;
    const [x, z] = path.at(0);
    return Math.hypot(x - place.x, z - place.z) < NEAR;
  }

  toBeginning({ speed, path }, { before: { going: { place } } }) {
    const [x, z] = path.at(0);
    return { speed, direction: Math.atan2(x - place.x, z - place.z) };
  }

  /** What each of them is asked, does, and does not. */
  get records() {
    return this.characters.map(({ record }) => record);
  }

  /** Frames up to `frame`; in so many milliseconds, as far as they can be made, and some more for what comes. */
  reach(frame, milliseconds = Infinity) {
    const began = performance.now();
    const wanted = frame + (milliseconds < Infinity ? AHEAD : 0);
    const before = this.last;
    while (this.last < wanted && performance.now() - began < milliseconds) this.work();
    this.spent = (this.spent ?? 0) + performance.now() - began;
    if (this.last === before) return;
    const each = this.spent / (this.last - before);
    this.cost = this.cost ? 0.8 * this.cost + 0.2 * each : each; // milliseconds a frame
    this.spent = 0;
  }

  /** One frame more of somebody's samples; whole windows are shown. */
  work() {
    const character = this.characters.find(({ window }) => !window?.full);
    character.work(this.settingsOf(character));
    if (!this.characters.every(({ window }) => window?.full)) return;
    const windows = this.behind(this.characters.map((one) => one.take(this.settings.refined ?? 1)));
    windows.forEach((frames, k) => frames.forEach((made, t) => this.show(this.tracks[k], this.last + 1 + t, made)));
    this.last += windows[0].length;
  }

  /** The frames of each character as they are shown: those that were made, or with feet held still those before them. */
  behind(made) {
    const locked = this.legs && (this.settings.lock ?? 0);
    const left = this.locks && !locked ? this.locks.map((lock) => lock.finish()) : made.map(() => []);
    this.locks = locked ? this.locks ?? made.map(() => new LockStream(this.encoding, this.fps, this.legs)) : null;
    return made.map((frames, k) => [...left[k], ...frames.flatMap((frame) => this.locks?.[k].push(frame) ?? frame)]);
  }

  /** Seconds from a wish until it is seen, least and most: a window that is begun does not hear it. */
  get latency() {
    const late = this.locks ? this.legs.ahead : 0;
    return [AHEAD, AHEAD + WINDOW].map((frames) => (frames + late) / this.fps);
  }

  /** Without help nothing is asked, and nothing chosen. */
  settingsOf(character) {
    const { futures } = this.cast[this.characters.indexOf(character)];
    const { settings } = this;
    const own = { component_temperature: 1, ...settings, futures: futures ?? settings.futures };
    return settings.help ?? 1 ? own : { ...own, futures: 1, push: 0 };
  }

  show(track, frame, { row, place, ...inside }) {
    this.encoding.points(row, place, track.room(frame));
    track.add(frame, row, place, inside);
  }
}
