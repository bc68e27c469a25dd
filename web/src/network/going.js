// Where a character is and what he did of late, as motionlab/solvers/guided.py has it: what a push needs to know,
// along a path (guided.js) or where a reader steers (steering/).

const SHARE = 0.5; // of what is missing, a frame
const SLOW = 0.3; // seconds that averages forget in
const [TURN, PACE] = [0.6, 0.6]; // rad/s and m/s that a push adds at most, a frame's share of them
const BEND = 3; // rad/s that is asked for at most
export const STANDING = 0.3; // m/s: who is slower goes where he faces

export const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** From -π to π. */
export const wrapped = (angle) => {
  const turns = (angle + Math.PI) / (2 * Math.PI);
  return 2 * Math.PI * (turns - Math.floor(turns)) - Math.PI;
};

export class Going {
  /** `place` {x, z, yaw}; `velocity` [x, z] m/s and `turn` rad/s, slow averages. */
  constructor(fps, place, velocity, turn) {
    Object.assign(this, { fps, place, velocity, turn });
  }

  /** From the last steps and turns `recent` (rows) that led to a place. */
  static of(fps, place, recent) {
    const { off, speed, turn } = recently(recent, fps);
    const way = place.yaw + off;
    return new Going(fps, place, [speed * Math.sin(way), speed * Math.cos(way)], turn);
  }

  copy() {
    return new Going(this.fps, this.place, this.velocity, this.turn);
  }

  get pace() {
    return Math.hypot(...this.velocity);
  }

  /** Which way he goes; who stands goes where he faces. */
  get bearing() {
    return this.pace < STANDING ? this.place.yaw : Math.atan2(...this.velocity);
  }

  /** Rad/s of the arc of a circle from here, this way, through what is `to` [x, z] from here, at a speed. */
  bend(to, speed) {
    const aside = clamp(wrapped(Math.atan2(...to) - this.bearing), -1.5, 1.5);
    return clamp((2 * Math.sin(aside) * speed) / Math.max(Math.hypot(...to), 0.2), -BEND, BEND);
  }

  /** Metres ahead and radians that the next frame should have more of, for a speed and a bend. */
  lacking(speed, bend) {
    return {
      ahead: clamp(SHARE * (speed - this.pace), -PACE, PACE) / this.fps,
      turn: clamp(SHARE * (bend - this.turn), -TURN, TURN) / this.fps,
    };
  }

  /** Go on by a frame's step to the left and ahead, and turn. */
  move([left, ahead, turn]) {
    const { x, z, yaw } = this.place;
    const moved = turned(left, ahead, yaw);
    this.place = { x: x + moved[0], z: z + moved[1], yaw: yaw + turn };
    const keep = 1 / (SLOW * this.fps);
    this.velocity = this.velocity.map((value, axis) => value + keep * (this.fps * moved[axis] - value));
    this.turn += keep * (this.fps * turn - this.turn);
  }
}

/** A step to the left and ahead as x and z, of one who faces `yaw`. */
const turned = (left, ahead, yaw) => [left * Math.cos(yaw) + ahead * Math.sin(yaw), ahead * Math.cos(yaw) - left * Math.sin(yaw)];

/** Which way steps went, as seen from where they ended, in radians; how fast, and how fast they turned. */
export function recently(recent, fps) {
  const mean = [0, 0, 0];
  let yaw = 0; // after the last
  for (const [left, ahead, turn] of [...recent].reverse()) {
    yaw -= turn;
    [...turned(left, ahead, yaw), turn].forEach((value, i) => { mean[i] += value / recent.length; });
  }
  return { off: Math.atan2(mean[0], mean[1]), speed: fps * Math.hypot(mean[0], mean[1]), turn: fps * mean[2] };
}
