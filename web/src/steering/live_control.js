// One character who is steered, five frames at a time: motionlab/solvers/live_control.py. What is asked counts from
// the next window on; who comes apart begins again where he is.
import { Going } from "../network/going.js";
import { Random } from "../network/mixture.js";
import { Aim, STILL } from "./aim.js";
import { within } from "./feet_energy.js";
import { Futures, WINDOW } from "./futures.js";
import { Gliding } from "./live_frame.js";

const STRANGE = 20; // deviations of the data from their mean: no body is there
const HASTE = 3; // deviations above the data's mean step: nobody is faster
const DUE = 2; // seconds after a wish; what is not met by then is said
const [SLOWER, ASTRAY] = [0.15, 20]; // share of the speed, and degrees: what is said
const NOTHING = { speed: 0, direction: NaN }; // is asked of who is not helped
const degrees = (angle) => (180 * angle) / Math.PI;

/** Speed (m/s) that no motion of the data goes far beyond. */
export const fastestOf = ({ fps, normalizer: { mean, std } }) => fps * (mean[1] + HASTE * std[1]);

export class LiveControl {
  /**
   * `parts`: network, its `starts` and `layers` of numbers, encoding, normalizer, normalize, denormalize, refiner (or none),
   * feet (FeetEnergy), stand (or null), fps, fastest;
   * `start` of weights.js; `place` {x, z, yaw}; `seed` of all chance.
   */
  constructor(parts, start, place, seed) {
    Object.assign(this, { parts, start, random: new Random(seed), frames: 0, askedAt: 0, asking: true, lost: 0, tooFast: 0 });
    this.before = this.begin(place);
    this.aim = Aim.none(this.before.going);
    this.gliding = new Gliding(parts);
    this.behind = { place, memory: parts.refiner?.begin(start.frame) };
    this.first = { row: this.refined(start.frame), place };
  }

  /** What is known at the start, at a place. */
  begin(place) {
    const { network, normalize, layers, fps } = this.parts;
    const { frame, hidden, cell, noise } = this.start;
    const state = { input: normalize(frame), hidden: layers(hidden), cell: layers(cell), noise, row: frame };
    [state.next] = network.predict([state]);
    return { ...state, going: Going.of(fps, place, [frame]) };
  }

  /** What is asked from the next window on; what is not given stays. Fails with a plain sentence, and nothing changes. */
  steer({ speed = this.aim.speed, direction, path = null }) {
    for (const [name, value] of [["speed", speed], ["direction", direction ?? 0]]) {
      if (!Number.isFinite(value)) throw new Error(`The ${name} that is asked is ${value}; NaN and infinity lead nowhere.`);
    }
    if (speed < 0) throw new Error(`The speed that is asked is ${speed} m/s; it must be 0 or more.`);
    const { fastest } = this.parts;
    const aim = this.aim.copy();
    this.tooFast = speed > fastest ? speed : 0;
    aim.speed = Math.min(speed, fastest);
    if (direction !== undefined) Object.assign(aim, { direction: Math.atan2(Math.sin(direction), Math.cos(direction)), path: null });
    const another = path && path !== aim.path; // who goes along one goes on
    if (another) Object.assign(aim, { path, arc: 0 });
    if (path) aim.speed = Math.max(aim.speed, 2 * STILL);
    const off = Math.abs(Math.atan2(Math.sin(aim.direction - this.aim.direction), Math.cos(aim.direction - this.aim.direction)));
    if (another || Math.abs(aim.speed - this.aim.speed) > 0.05 || off > 0.05) this.askedAt = this.frames;
    this.aim = aim;
  }

  /** Do one frame more of all samples of the next window; true if it is whole. */
  work(settings) {
    this.window ??= new Futures(this.parts, this.before, this.aim.copy(), settings, this.random);
    this.window.grow();
    return this.window.full;
  }

  /** The frames of a window that is whole: rows as they are shown, their places, and what was inside. */
  take(refined) {
    const best = this.window.best();
    const { speed, way } = this.window.aim.way(this.before.going, 0);
    const { push, futures } = this.window.settings;
    this.asking = push > 0 || futures > 1;
    const asked = this.asking ? { speed, direction: way } : NOTHING;
    if (push > 0) this.gliding.remind(best, this.before.row);
    this.window = null;
    if (this.apart(best)) this.again(best);
    this.before = { ...best, row: best.rows.at(-1) };
    this.frames += WINDOW;
    this.aim.onward(best.going);
    return best.rows.map((row, t) => ({ ...this.shown(row, refined), ...best.inside[t], asked, energies: best.energies, chosen: best.chosen }));
  }

  apart({ rows, going }) {
    const near = (row) => this.parts.normalize(row).every((value) => Math.abs(value) < STRANGE); // NaN is not
    return !(rows.every(near) && [going.place.x, going.place.z, going.place.yaw].every(Number.isFinite));
  }

  /** Who came apart goes on from where he was, as he began: a jump, but no end. */
  again(best) {
    const { x, z, yaw } = best.going.place;
    const place = [x, z, yaw].every(Number.isFinite) ? best.going.place : this.before.going.place;
    Object.assign(best, this.begin(place), { rows: best.rows.map(() => this.start.frame) });
    this.lost++;
  }

  /** A row as it should have been, by the refiner, if there is one: it must know all that was. */
  refined(row) {
    const { refiner, feet } = this.parts;
    return refiner ? within(refiner.refine([row], [this.behind.memory])[0], feet) : row;
  }

  /** A row as it is shown, and where it leads. */
  shown(row, refined) {
    const better = this.refined(row);
    const shown = refined ? better : row;
    this.behind.place = this.parts.encoding.walk(this.behind.place, shown);
    return { row: shown, place: this.behind.place };
  }

  /** What is asked, what he does, m/s and degrees, and sentences on what is not met two seconds after it was asked. */
  get record() {
    const { aim, before: { going }, parts: { fps, fastest } } = this;
    const off = degrees(aim.wanted(going).off);
    const since = (this.frames - this.askedAt) / fps;
    const notes = [];
    if (this.asking && this.tooFast) notes.push(`${this.tooFast.toFixed(1)} m/s is faster than anybody in the data; ${fastest.toFixed(1)} m/s was asked for`);
    if (this.asking && since >= DUE) {
      const still = aim.speed < STILL;
      if (Math.abs(off) > ASTRAY && !still) notes.push(`${Math.abs(off).toFixed(0)}° off the way that was asked`);
      if (!aim.path && still && going.pace > 0.1) notes.push(`does not stand yet: ${going.pace.toFixed(2)} m/s`);
      else if (!aim.path && !still && Math.abs(going.pace / aim.speed - 1) > SLOWER) notes.push(`${going.pace.toFixed(2)} m/s where ${aim.speed.toFixed(2)} was asked`);
    }
    if (this.lost) notes.push(`came apart and began again, ${this.lost} times`);
    return { asked: aim.speed, done: going.pace, off, notes };
  }
}
