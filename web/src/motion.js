// The payload written by motionlab/viewer/live/player.py, read back: where every point is at any time.
import { fitted } from "./fit.js";
import { fromEuler, matrices, place } from "./kinematics.js";

const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
export const ROOT_UNIT = 1e-4; // metres
const TURN_UNIT = Math.PI / 2 ** 15; // radians: the sixteen bits of a number go round as an angle does
const SMOOTH = 0.45; // seconds on each side over which the followed path is averaged

/**
 * The numbers (frames, width) that player.py's in_few_bytes wrote as changes of their changes. Sums past
 * the sixteenth bit go round, there and here.
 */
export function fromFewBytes(sent, frames, width) {
  const numbers = new Int16Array(frames * width);
  for (let i = 0, at = 0; i < numbers.length; i++) {
    let unsigned = 0;
    for (let shift = 0, more = true; more; shift += 7) {
      more = sent[at] > 127;
      unsigned |= (sent[at++] & 127) << shift;
    }
    const bent = unsigned & 1 ? -(unsigned + 1) / 2 : unsigned / 2;
    numbers[i] = bent + (i < width ? 0 : 2 * numbers[i - width]) - (i < 2 * width ? 0 : numbers[i - 2 * width]);
  }
  return numbers;
}

/** One motion: what was sent is worked out at the start, frames in between when they are drawn. */
export class Track {
  /** `data`: a track of the payload, and what is said of its body. All is magnified but the skeleton. */
  constructor(data, stride, fps, magnified = 1) {
    const { label, name, color, skeleton, middle, bones, extras, contactPoints } = data;
    Object.assign(this, { label, name, color, skeleton, middle, bones, extras, contactPoints, magnified });
    this.stride = stride; // motion frames from one stored frame to the next
    this.stored = data.frames;
    this.rate = fps / stride; // stored frames in a second
    this.pointCount = skeleton.parents.length + skeleton.end_parents.length;
    this.angles = data.turns ? fromFewBytes(new Uint8Array(bytes(data.turns)), data.frames, 3 * skeleton.parents.length) : null;
    // where the middle of the body is, (frames, 3), and all points from there, (frames, points, 3), metres
    this.root = Float64Array.from(new Int32Array(bytes(data.root)), (steps) => steps * ROOT_UNIT);
    this.local = this.angles ? this.turnedPoints() : this.sentPoints(data);
    this.contacts = data.contacts ? new Uint8Array(bytes(data.contacts)) : null;
    this.points = new Float32Array(3 * (this.pointCount + this.extras.length));
    this.rootNow = [0, 0, 0];
    this.now = 0;
    this.way = smoothCourse(this, fps);
  }

  sentPoints({ local, frames, scale }) {
    return Float32Array.from(fromFewBytes(new Uint8Array(bytes(local)), frames, 3 * this.pointCount), (steps) => steps * scale);
  }

  /** Points of a motion that was sent as rotations; `root`, which was the root joint's, becomes the middle's. */
  turnedPoints() {
    const { skeleton, middle, pointCount, root, angles, magnified } = this;
    const [locals, turns] = [matrices(skeleton), matrices(skeleton)];
    const points = new Float64Array(3 * pointCount);
    const local = new Float32Array(this.stored * points.length);
    for (let frame = 0; frame < this.stored; frame++) {
      locals.forEach((matrix, joint) => {
        const at = 3 * (frame * locals.length + joint);
        fromEuler([angles[at] * TURN_UNIT, angles[at + 1] * TURN_UNIT, angles[at + 2] * TURN_UNIT], skeleton.orders[joint], matrix);
      });
      place(skeleton, [0, 0, 0], locals, turns, points);
      for (let i = 0; i < points.length; i++) local[frame * points.length + i] = magnified * (points[i] - points[3 * middle + (i % 3)]);
      for (let axis = 0; axis < 3; axis++) root[3 * frame + axis] += magnified * points[3 * middle + axis];
    }
    return local;
  }

  /** What a file holds of it: {skeleton, fps, root (frames, 3), angles (frames, joints, 3)}; metres, radians. */
  clip() {
    const { skeleton, middle, rate: fps, angles, pointCount } = this;
    const frames = Array.from({ length: this.stored }, (_, frame) => this.whole(frame));
    if (!angles) return { skeleton, fps, ...fitted(skeleton, frames, drawn(this), middle) };
    const root = frames.flatMap((points) => Array.from(points.subarray(0, 3)));
    return { skeleton, fps, root, angles: Array.from(angles, (steps) => steps * TURN_UNIT) };
  }

  /** All points of a stored frame in the world, as large as they are. */
  whole(frame) {
    const width = 3 * this.pointCount;
    return Float64Array.from({ length: width }, (_, i) => (this.root[3 * frame + (i % 3)] + this.local[frame * width + i]) / this.magnified);
  }

  /** Fill `points` (metres) for a frame of the motion; frames between stored ones are mixed. */
  seek(frame) {
    const at = Math.min(Math.max(frame / this.stride, 0), this.stored - 1);
    const before = Math.floor(at);
    const after = Math.min(before + 1, this.stored - 1);
    const mix = at - before;
    this.now = Math.round(at);
    const { root, local, points, pointCount } = this;
    for (let axis = 0; axis < 3; axis++) {
      const from = root[3 * before + axis];
      this.rootNow[axis] = from + mix * (root[3 * after + axis] - from);
    }
    const width = 3 * pointCount;
    for (let i = 0; i < width; i++) {
      const from = local[before * width + i];
      points[i] = from + mix * (local[after * width + i] - from) + this.rootNow[i % 3];
    }
    addExtras(points, pointCount, this.extras);
  }

  /** Position of a point as [x, y, z] after `seek`. */
  point(index) {
    return this.points.subarray(3 * index, 3 * index + 3);
  }

  /** Which of `contactPoints` touch the ground now. */
  touching() {
    const mask = this.contacts ? this.contacts[this.now] : 0;
    return this.contactPoints.filter((_, bit) => mask & (1 << bit));
  }

  /** Polyline [x, y, z, ...] of one point over all stored frames. */
  course(point) {
    const line = [];
    for (let stored = 0; stored < this.stored; stored++) {
      this.seek(stored * this.stride);
      line.push(...this.point(point));
    }
    return line;
  }

  /** Greatest height in metres that any point has at any time. */
  top() {
    let top = -Infinity;
    for (let stored = 0; stored < this.stored; stored++) {
      this.seek(stored * this.stride);
      for (let i = 1; i < this.points.length; i += 3) top = Math.max(top, this.points[i]);
    }
    return top;
  }

  /** Smoothed place [x, z] on the floor at a frame of the motion. */
  place(frame) {
    const at = Math.min(frame / this.stride, this.stored - 1);
    const [a, b] = [this.way[Math.floor(at)], this.way[Math.min(Math.floor(at) + 1, this.stored - 1)]];
    return [0, 1].map((axis) => a[axis] + (at % 1) * (b[axis] - a[axis]));
  }

  /** Direction on the floor from the start to the farthest place; +z if it hardly moves. */
  heading() {
    const [x0, z0] = this.way[0];
    const far = (at) => Math.hypot(at[0] - x0, at[1] - z0);
    const [x, z] = this.way.reduce((best, at) => (far(at) > far(best) ? at : best));
    return far([x, z]) < 0.5 ? [0, 1] : [x - x0, z - z0];
  }

  /** How many frames of the motion there are. */
  get count() {
    return (this.stored - 1) * this.stride + 1;
  }

  /** Places [x, z] of the middle in all stored frames, metres as they are. */
  ground() {
    return Array.from({ length: this.stored }, (_, stored) => this.onGround(stored * this.stride));
  }

  onGround(frame) {
    const stored = Math.min(Math.max(Math.round(frame / this.stride), 0), this.stored - 1);
    return [this.root[3 * stored] / this.magnified, this.root[3 * stored + 2] / this.magnified];
  }

  /** Corners [min x, min z, max x, max z] of the ground that the root covers. */
  get extent() {
    return (this.box ??= boxAround(Array.from({ length: this.stored }, (_, i) => [this.root[3 * i], this.root[3 * i + 2]])));
  }

  /** The frames of another track, of the same body, come behind its own. */
  extend(other) {
    this.become({ ...Object.fromEntries(PARTS.map((part) => [part, joined(this[part], other[part])])), stored: this.stored + other.stored });
  }

  /** Be another motion of the same body. */
  become(other) {
    for (const part of [...PARTS, "stored"]) this[part] = other[part];
    this.box = undefined;
    this.way = smoothCourse(this, this.rate * this.stride);
  }
}

const PARTS = ["angles", "root", "local", "contacts"]; // of a track, numbers frame by frame

function joined(some, more) {
  if (!some || !more) return null;
  const all = new some.constructor(some.length + more.length);
  all.set(some);
  all.set(more, some.length);
  return all;
}

/** Corners [min x, min z, max x, max z] around places [x, z]. */
export function boxAround(places) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, z] of places) {
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], z);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], z);
  }
  return box;
}

/** Running mean of a track's root on the floor: x, z per stored frame. No lag, same in any order. */
function smoothCourse(track, fps) {
  let course = Array.from({ length: track.stored }, (_, i) => [track.root[3 * i], track.root[3 * i + 2]]);
  const half = Math.round((SMOOTH * fps) / track.stride);
  for (let pass = 0; pass < 2; pass++) {
    const sums = [[0, 0]];
    for (const [x, z] of course) sums.push([sums.at(-1)[0] + x, sums.at(-1)[1] + z]);
    course = course.map((_, i) => {
      const reach = Math.min(half, i, course.length - 1 - i); // symmetric, so the ends stay put
      const [from, to] = [sums[i - reach], sums[i + reach + 1]];
      return [0, 1].map((axis) => (to[axis] - from[axis]) / (2 * reach + 1));
    });
  }
  return course;
}

/** Points on the line through two others (heels, the waist), behind the skeleton's own. */
export function addExtras(points, count, extras) {
  extras.forEach(([a, b, along], extra) => {
    for (let axis = 0; axis < 3; axis++) {
      const from = points[3 * a + axis];
      points[3 * (count + extra) + axis] = from + along * (points[3 * b + axis] - from);
    }
  });
}

/** Indices of the points that are drawn. Others, such as an engine's helpers, may be anywhere. */
function drawn({ bones, extras, pointCount }) {
  const ends = bones.flatMap(([a, b]) => [a, b]).flatMap((end) => (end < pointCount ? [end] : extras[end - pointCount].slice(0, 2)));
  return new Set(ends);
}

export function decode(payload) {
  if (payload.version !== 2) throw new Error(`motion payload of version ${payload.version}; this player reads 2`);
  return payload.tracks.map((data) => new Track({ ...payload.bodies[data.body], ...data }, payload.stride, payload.fps, payload.magnified));
}
