// What is asked of a steered character, and what that means now: motionlab/solvers/live_aim.py. A speed and a way,
// or a path, become a speed and a bend a frame that a body can do.
import { clamp, STANDING, wrapped } from "../network/going.js";

const GAIN = 3; // rad/s that are asked for a radian off the way
const [BEND, SIDEWAYS] = [3, 5]; // rad/s, and m/s² across the way, at most
const [SLOWED, SHARP] = [1.5, 1]; // m/s at most for who is more than so many radians off his way
const HURRY = 0.8; // m/s more than they go, as an average of 0.3 s has it: people gain 3 m/s² or less
const STARTS = 0.5; // m/s; who is slower, and more than SHARP off, turns before he goes
const WALKS = 0.9; // m/s; who is slower goes, to a part, where he faces
export const STILL = 0.15; // m/s; who is asked for less is asked to stand
const [ON_THE_SPOT, NEAR] = [0.5, 0.35]; // radians off beyond which, and on to which, who stands turns
const [BRAKE, THERE] = [1, 0.15]; // 1/s, speed a metre before an end; m from it, where one stands
const STEPS = 0.4; // m/s that are asked for at least until there: a slower stride stops halfway
const BEHIND = 2.6; // radians off, beyond which left and right are as good: the side that is begun stays
const [LOOK, LEAST_LOOK] = [0.6, 0.5]; // seconds ahead, and metres at least, that are aimed at on a path

/** How much of a walk it is, from 0, a stand, to 1. */
export const walks = ({ pace }) => clamp((pace - STANDING) / (WALKS - STANDING), 0, 1);

/** Which way he goes, radians. The slower, the more is it the way he faces, and at a stand nothing else. */
export const course = (going) => {
  const { yaw } = going.place;
  return yaw + walks(going) * wrapped(Math.atan2(...going.velocity) - yaw);
};

export class Aim {
  /** `speed` m/s, `direction` radians (0 is +z, π/2 is +x), or a `path` (Path), of which `arc` metres are behind. */
  constructor(speed, direction, path = null, arc = 0) {
    Object.assign(this, { speed, direction, path, arc });
  }

  /** Nobody has asked for anything: he goes on as he goes; who hardly moves, stands: a stander's sway is no wish to creep. */
  static none(going) {
    return new Aim(going.pace < STANDING ? 0 : going.pace, going.bearing);
  }

  copy() {
    return new Aim(this.speed, this.direction, this.path, this.arc);
  }

  /** Speed m/s, bend rad/s and radians off the way, as of now; `ahead`: seconds since the arc was true. */
  wanted(going, ahead = 0) {
    const { speed, way, bend } = this.way(going, ahead);
    let off = wrapped(way - course(going));
    if (Math.abs(off) > BEHIND && Math.abs(going.turn) > 0.2) off = Math.abs(off) * Math.sign(going.turn);
    const still = speed < STILL;
    if (still) {
      const facing = wrapped(way - going.place.yaw);
      off = Math.abs(facing) > (Math.abs(going.turn) > 0.5 ? NEAR : ON_THE_SPOT) ? facing : 0;
    }
    const sharp = Math.abs(off) > SHARP && !still;
    const most = Math.min(SIDEWAYS / Math.max(going.pace, 0.1), BEND);
    const slowed = going.pace < STARTS ? 2 * STILL : SLOWED;
    return {
      speed: Math.min(sharp ? Math.min(speed, slowed) : speed, Math.max(going.pace + HURRY, 2 * STILL)),
      bend: clamp(bend === null || still ? GAIN * off : bend, -most, most),
      off,
    };
  }

  /** Speed, way and, of who is on a path, bend; else null. */
  way(going, ahead) {
    const { path, speed } = this;
    if (!path) return { speed, way: this.direction, bend: null };
    const arc = this.arc + ahead * going.pace; // as far on as he went since: else who stands short of the end is told to stand
    const left = path.length - arc;
    const near = left < THERE ? 0 : Math.max(BRAKE * left, STEPS);
    const slowed = Math.min(speed, near);
    const there = path.at(arc + Math.max(LOOK * slowed, LEAST_LOOK));
    const to = [there[0] - going.place.x, there[1] - going.place.z];
    return { speed: slowed, way: Math.atan2(...to), bend: going.bend(to, slowed) };
  }

  /** Who goes along a path has come so far on it. */
  onward({ place: { x, z } }) {
    if (this.path) this.arc = this.path.nearest([x, z], this.arc - 0.2, this.arc + 0.5);
  }
}
