// Guided sampling, as motionlab/solvers/guided.py has it: a network that walks by itself is pushed a little to
// where a path leads. And what comes before it, as in run_up.py and path_control.py: a character who walks up
// to the path's beginning, and a timetable that does not wait for who is late.
import { Dreamer } from "./dreamer.js";
import { clamp, Going, recently, STANDING } from "./going.js";
import { Path } from "./path.js";

const [LOOK, LEAST_LOOK] = [0.6, 0.5]; // seconds ahead, and metres at least, that are aimed at
const [RUN_UP, SAMPLES, AVERAGE] = [1.2, 6, 0.8]; // seconds, characters, seconds: see run_up.py
const LEEWAY = 0.3; // seconds behind a timetable that are caught up with
const [PATIENCE, MORE] = [2, 34]; // times the frames of the timetable, and some, after which nobody waits
const LOST = 2; // metres from his path, from where nobody finds back
const HASTE = 3; // deviations above the data's mean step: nobody is faster

/** Where a character is on his path, and what he should do. */
export class Steering {
  /** From the last steps and turns `recent` (rows) that led to a place {x, z, yaw}. */
  constructor(path, fps, place, arc, recent) {
    Object.assign(this, { path, arc, going: Going.of(fps, place, recent) });
  }

  get place() {
    return this.going.place;
  }

  /** Metres ahead and radians that the next frame should have more of, to go `speed` metres a second. */
  push(speed) {
    const aim = this.path.at(this.arc + Math.max(LOOK * speed, LEAST_LOOK));
    const bend = this.going.bend([aim[0] - this.place.x, aim[1] - this.place.z], speed);
    return this.going.lacking(speed, bend);
  }

  /** Go on by a frame's step to the left and ahead, and turn. */
  move(step) {
    this.going.move(step);
    this.arc = this.path.nearest([this.place.x, this.place.z], this.arc - 0.2, this.arc + 0.5);
  }
}

/** What the timetable wants next, and a share of what is late or early, in metres a second. */
export const wanted = (due, last, arc, fps) => Math.max(fps * (due - last + 0.1 * (last - arc)), 0);

/** A frame more for all characters of a dreamer, each pushed to go its speed along its way. */
export function guide(dreamer, steerings, speeds) {
  const { kept, std } = dreamer.normalizer;
  dreamer.characters.forEach(({ next }, k) => {
    const { ahead, turn } = steerings[k].push(speeds[k]);
    for (const [channel, push] of [[1, ahead], [2, turn]]) {
      for (let at = kept.indexOf(channel); at < next.means.length; at += kept.length) next.means[at] += push / std[channel];
    }
  });
  dreamer.advance();
  dreamer.characters.forEach(({ track }, k) => steerings[k].move(track.at(dreamer.last).row));
}

/** One character who walks along a path, frame by frame. */
export class GuidedWalk {
  /** Parameters as of a Dreamer; `settings` also hold `speed`, metres a second. */
  constructor(weights, look, settings, path) {
    const { fps, normalizer } = weights;
    Object.assign(this, { path, fps, late: false });
    this.fastest = fps * (normalizer.mean[1] + HASTE * normalizer.std[1]);
    this.table = path.timetable(settings.speed, this.fastest, fps);
    this.longest = Math.ceil(PATIENCE * (this.table.length - 1)) + MORE;
    const some = Math.min(this.table.length - 1, Math.round(fps / 2));
    const pace = (this.table[some] * fps) / some;
    const { dreamer, place, recent } = runUp(weights, look, settings, pace, path);
    Object.assign(this, { dreamer, clock: 0 });
    dreamer.keep(place, (this.longest + 1) / fps);
    this.steering = new Steering(path, fps, place, 0, recent);
  }

  get track() { return this.dreamer.tracks[0]; }
  get frame() { return this.dreamer.last; }
  get share() { return Math.min(this.steering.arc / this.path.length, 1); }
  get fellApart() { return this.dreamer.exploded > 0; }
  get lost() {
    const { x, z } = this.steering.place;
    const [u, v] = this.path.at(this.steering.arc);
    return Math.hypot(x - u, z - v) > LOST;
  }
  get arrived() { return this.steering.arc >= this.path.length - 0.01; }

  /** Whether there is nothing more to do. */
  get over() { return this.arrived || this.fellApart || this.lost || this.frame >= this.longest; }

  /** Frames as far as they can be made in so many milliseconds. */
  reach(milliseconds = Infinity) {
    const began = performance.now();
    while (!this.over && performance.now() - began < milliseconds) this.advance();
  }

  advance() {
    // no hour is fixed: who is far behind the timetable, or ahead of it, goes on from there
    const here = inverse(this.table, this.steering.arc);
    const clock = here + clamp(this.clock - here, -LEEWAY * this.fps, LEEWAY * this.fps);
    this.clock = clock + 1;
    guide(this.dreamer, [this.steering], [wanted(this.due(clock + 1), this.due(clock), this.steering.arc, this.fps)]);
  }

  /** Metres of path behind him at a frame of the timetable; beyond its end he walks on. */
  due(frame) {
    const last = this.table.length - 1;
    const low = clamp(Math.floor(frame), 0, last - 1);
    const pace = Math.max(this.table[Math.max(last - 2, 0)] - this.table[Math.max(last - 3, 0)], 0.3 / this.fps);
    return this.table[low] + clamp(frame - low, 0, 1) * (this.table[low + 1] - this.table[low]) + Math.max(frame - last, 0) * pace;
  }
}

/**
 * Some characters walk straight ahead for a stride, guided to a pace; a dreamer with only the one who keeps it
 * best, the place at which he begins the path, having gone the way it leads, and his last steps.
 */
function runUp(weights, look, settings, pace, path) {
  const { fps } = weights;
  const straight = new Path([[0, 0], [0, 100]], 0);
  const dreamer = new Dreamer(weights, look, { ...settings, characters: SAMPLES });
  const steerings = dreamer.characters.map(({ track }) => new Steering(straight, fps, { x: 0, z: 0, yaw: 0 }, 0, [track.at(0).row]));
  const frames = Math.round(RUN_UP * fps);
  for (let frame = 1; frame <= frames; frame++) {
    const last = frame === 1 ? steerings.map(({ arc }) => arc) : steerings.map(() => ((frame - 1) * pace) / fps);
    guide(dreamer, steerings, steerings.map(({ arc }, k) => wanted((frame * pace) / fps, last[k], arc, fps)));
  }
  const steps = (track, count) => Array.from({ length: count }, (_, i) => track.at(dreamer.last - count + 1 + i).row);
  const found = dreamer.tracks.map((track) => recently(steps(track, Math.round(AVERAGE * fps)), fps));
  const unlike = found.map(({ off, speed, turn }) => Math.abs(speed - pace) + 0.5 * Math.abs(turn) + 0.5 * Math.abs(Math.sin(off)));
  const best = unlike.indexOf(Math.min(...unlike.filter(Number.isFinite)));
  dreamer.characters = [dreamer.characters[best]];
  const recent = steps(dreamer.characters[0].track, 10);
  const { off, speed } = found[best];
  return { dreamer, recent, place: beginning(path, speed < STANDING ? 0 : off) };
}

/** Place at a path's beginning of one who goes `off` radians off his facing. */
function beginning({ places }, off) {
  const [[x, z], [u, v]] = [places[0], places[Math.min(5, places.length - 1)]];
  return { x, z, yaw: Math.atan2(u - x, v - z) - off };
}

/** The (fractional) frame at which a rising table has come to `arc`. */
function inverse(table, arc) {
  let high = 1;
  while (high < table.length - 1 && table[high] < arc) high++;
  const low = table[high - 1];
  return high - 1 + clamp((arc - low) / Math.max(table[high] - low, 1e-9), 0, 1);
}

/** Number of the start that suits a pace: of all that walk or run straight ahead the one whose speed is nearest. */
export function pickStart(starts, pace, fps) {
  const speeds = starts.map(({ name }) => Number(/^(?:walk|run) ([\d.]+) m\/s$/.exec(name)?.[1] ?? NaN));
  const steady = speeds.some(Number.isFinite) ? speeds : starts.map(({ frame }) => fps * Math.hypot(frame[0], frame[1]));
  const off = steady.map((speed) => Math.abs(speed - pace));
  return off.indexOf(Math.min(...off.filter(Number.isFinite)));
}
