// The payload written by motionlab/viewer/player.py, read back: where every point is at any time.

const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const ROOT_UNIT = 1e-4; // metres

/** One motion: decodes positions frame by frame, so that 10 s of 57 points cost nothing at start. */
export class Track {
  constructor(data, stride) {
    Object.assign(this, { label: data.label, color: data.color, bones: data.bones, extras: data.extras });
    this.stride = stride; // motion frames from one stored frame to the next
    this.stored = data.frames;
    this.pointCount = data.points;
    this.scale = data.scale;
    this.root = new Int32Array(bytes(data.root));
    this.local = new Int16Array(bytes(data.local));
    this.contacts = data.contacts ? new Uint8Array(bytes(data.contacts)) : null;
    this.contactPoints = data.contact_points;
    this.points = new Float32Array(3 * (this.pointCount + this.extras.length));
    this.rootNow = [0, 0, 0];
    this.now = 0;
  }

  /** Fill `points` (metres) for a frame of the motion; frames between stored ones are mixed. */
  seek(frame) {
    const at = Math.min(Math.max(frame / this.stride, 0), this.stored - 1);
    const before = Math.floor(at);
    const after = Math.min(before + 1, this.stored - 1);
    const mix = at - before;
    this.now = Math.round(at);
    const { root, local, points, pointCount, scale } = this;
    for (let axis = 0; axis < 3; axis++) {
      const from = root[3 * before + axis];
      this.rootNow[axis] = (from + mix * (root[3 * after + axis] - from)) * ROOT_UNIT;
    }
    const width = 3 * pointCount;
    for (let i = 0; i < width; i++) {
      const from = local[before * width + i];
      points[i] = (from + mix * (local[after * width + i] - from)) * scale + this.rootNow[i % 3];
    }
    this.extras.forEach(([a, b, along], extra) => {
      for (let axis = 0; axis < 3; axis++) {
        const from = points[3 * a + axis];
        points[3 * (pointCount + extra) + axis] = from + along * (points[3 * b + axis] - from);
      }
    });
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

  /** Corners [min x, min z, max x, max z] of the ground that the root covers. */
  get extent() {
    if (this.box) return this.box;
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (let i = 0; i < this.root.length; i += 3) {
      const x = this.root[i] * ROOT_UNIT;
      const z = this.root[i + 2] * ROOT_UNIT;
      box[0] = Math.min(box[0], x);
      box[1] = Math.min(box[1], z);
      box[2] = Math.max(box[2], x);
      box[3] = Math.max(box[3], z);
    }
    return (this.box = box);
  }
}

export function decode(payload) {
  if (payload.version !== 1) throw new Error(`motion payload of version ${payload.version}; this player reads 1`);
  return payload.tracks.map((data) => new Track(data, payload.stride));
}
