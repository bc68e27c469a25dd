// A motion that is being made: the last seconds of it, with what the player asks of a Track.
import { fitted } from "../fit.js";
import { toEuler } from "../kinematics.js";
import { addExtras, boxAround } from "../motion.js";

export const KEPT = 20; // seconds that one can go back
const SMOOTH = 0.35; // seconds: a camera that follows ignores what is quicker

export class LiveTrack {
  /**
   * `first` is the frame it begins with; `look`: label, name, color, skeleton, middle, bones, extras,
   * contactPoints, tall; `seconds` are kept.
   */
  constructor(encoding, fps, first, look, seconds = KEPT) {
    const pointCount = encoding.count;
    Object.assign(this, look);
    Object.assign(this, { encoding, fps, pointCount, first, last: first - 1, now: first });
    this.size = Math.round(seconds * fps);
    this.ease = 1 / (SMOOTH * fps);
    this.frames = Array.from({ length: this.size }, () => null); // {points, contacts, middle, yaw, row, place}
    this.points = new Float32Array(3 * (pointCount + this.extras.length));
  }

  /** Where the points of a frame are to be written. */
  room(frame) {
    const slot = (this.frames[frame % this.size] ??= { points: new Float64Array(3 * this.pointCount) });
    return slot.points;
  }

  /** Say of a frame, whose points are in their room, which row of features at which place it is, and what `more` is to be kept. */
  add(frame, row, place, more = {}) {
    const { x, z, yaw } = place;
    const way = [[x, this.way?.[0]], [z, this.way?.[1]]].map(([at, way]) => follow(way, at, this.ease));
    this.way = way;
    // smoothing twice lags twice as much: what is between them makes up for it
    const middle = way.map(([once, twice]) => 2 * once - twice);
    const contacts = this.encoding.touching(row);
    Object.assign(this.frames[frame % this.size], { contacts, middle, yaw, row, place, ...more });
    this.last = frame;
  }

  get oldest() {
    return Math.max(this.first, this.last - this.size + 1);
  }

  at(frame) {
    return this.frames[Math.min(Math.max(frame, this.oldest), this.last) % this.size];
  }

  /** Fill `points` (metres) for a time in frames. */
  seek(time) {
    const [before, after, mix] = [this.at(Math.floor(time)), this.at(Math.floor(time) + 1), time % 1];
    this.now = Math.min(Math.max(Math.round(time), this.oldest), this.last);
    for (let i = 0; i < 3 * this.pointCount; i++) {
      this.points[i] = before.points[i] + mix * (after.points[i] - before.points[i]);
    }
    addExtras(this.points, this.pointCount, this.extras);
  }

  point(index) {
    return this.points.subarray(3 * index, 3 * index + 3);
  }

  touching() {
    const { contacts } = this.at(this.now);
    return this.contactPoints.filter((_, bit) => contacts & (1 << bit));
  }

  top() {
    return this.tall;
  }

  /** Smoothed place [x, z] on the floor at a time in frames. */
  place(time) {
    const [a, b] = [this.at(Math.floor(time)).middle, this.at(Math.floor(time) + 1).middle];
    return [0, 1].map((axis) => a[axis] + (time % 1) * (b[axis] - a[axis]));
  }

  /** How many frames there are of a motion of which all are kept. */
  get count() {
    return this.last + 1;
  }

  /** Places [x, z] of the root in all frames that are kept. */
  ground() {
    return Array.from({ length: this.last - this.oldest + 1 }, (_, i) => this.onGround(this.oldest + i));
  }

  onGround(frame) {
    const { x, z } = this.at(frame).place;
    return [x, z];
  }

  /** Corners [min x, min z, max x, max z] of the ground that the root covers. */
  get extent() {
    return boxAround(this.ground());
  }

  /** Direction on the floor to where it faces now. */
  heading() {
    const { yaw } = this.at(this.now);
    return [Math.sin(yaw), Math.cos(yaw)];
  }

  /** What a file holds of the seconds that are kept, as of a Track. */
  clip() {
    const { skeleton, encoding, fps, middle, pointCount } = this;
    const kept = [];
    for (let frame = this.oldest; frame <= this.last; frame++) kept.push(this.at(frame));
    if (!encoding.locals) {
      const every = new Set(Array(pointCount).keys());
      return { skeleton, fps, ...fitted(skeleton, kept.map(({ points }) => points), every, middle) };
    }
    const scratch = new Float64Array(3 * pointCount);
    const angles = kept.flatMap(({ row, place }) => {
      encoding.points(row, place, scratch); // now it knows the rotations, too
      return encoding.locals.flatMap((matrix, joint) => toEuler(matrix, skeleton.orders[joint]));
    });
    return { skeleton, fps, root: kept.flatMap(({ points }) => Array.from(points.subarray(0, 3))), angles };
  }

  /** Put where a point was in the last frames, up to now, into a flat array of x y z; the newest last. */
  tail(point, line) {
    const count = line.length / 3;
    for (let i = 0; i < count; i++) {
      const { points } = this.at(Math.max(this.now - count + 1 + i, this.oldest));
      for (let axis = 0; axis < 3; axis++) line[3 * i + axis] = points[3 * point + axis];
    }
  }
}

/** A value smoothed once and twice. */
function follow([once, twice] = [], value, ease) {
  const first = once === undefined ? value : once + ease * (value - once);
  return [first, twice === undefined ? first : twice + ease * (first - twice)];
}
