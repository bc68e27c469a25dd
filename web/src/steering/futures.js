// A window of motion: K samples of the next few frames, pushed to what is asked, and the one of least energy. The
// inside of motionlab/solvers/live_ways.py, a frame at a time, so that a page can do something else in between.
import { clamp, wrapped } from "../network/going.js";
import { choose, nextNoise, point } from "../network/mixture.js";
import { course, STILL, walks } from "./aim.js";
import { bound, READY, settle } from "./live_frame.js";

export const WINDOW = 5; // frames that are decided at a time: the paper's
const [SHARE, TURN, PACE] = [1, 1.2, 0.5]; // as network/going.js's; who steers waits for less
const [HOLD, AGAINST] = [4, 1.2]; // of the speed that is left to who should stand, and m/s at most
const QUIET = 0.3; // of the temperature that is left to them
const [SPEED, WAY, TURNING] = [0.15, 0.25, 0.5]; // m/s, rad, rad/s: how far futures may be off
const [FEET, CALM] = [0.2, 0.1]; // weights of the terms of feet and poses, and of a body that should be still
const ROOT = 6; // channels before those of joints
const STEPS = 3; // channels of the root's step and turn

const half = (off, spread) => (off / spread) ** 2 / 2;

/** Metres to the left and ahead, and radians, that the next frame should have more of. */
export function pushed(going, { speed, bend }) {
  const { place: { yaw }, velocity: [x, z], fps } = going;
  const turn = clamp(SHARE * (bend - going.turn), -TURN, TURN);
  const [sine, cosine] = [Math.sin(yaw), Math.cos(yaw)];
  const [left, ahead] = [x * cosine - z * sine, x * sine + z * cosine]; // as he goes
  const held = (moved) => clamp(-HOLD * moved, -AGAINST, AGAINST);
  const aside = (1 - walks(going)) * clamp(-SHARE * left, -PACE, PACE); // who is slow goes where he faces
  const step = speed < STILL ? [held(left), held(ahead)] : [aside, clamp(SHARE * (speed - going.pace), -PACE, PACE)];
  return [...step, turn].map((value) => value / fps);
}

export class Futures {
  /**
   * `parts`: network, normalizer, stand (or null), feet (FeetEnergy); `before`: the state that is gone on from (input, hidden, cell, noise,
   * next), its `row` and `going`; `aim`; `settings`: futures, push, temperature, component_temperature, memory.
   */
  constructor(parts, before, aim, settings, random) {
    Object.assign(this, { ...parts, aim, settings, random, was: before.going, frame: 0 });
    const { kept } = this.normalizer;
    this.columns = [0, 1, 2].map((channel) => kept.indexOf(channel));
    this.body = kept.map((channel) => channel >= STEPS);
    this.wanted = aim.wanted(before.going);
    this.still = settings.push > 0 && this.wanted.speed < STILL;
    this.judged = settings.futures > 1;
    const standing = this.judged ? this.feet.seen(before.row, before.going.place) : null;
    this.samples = Array.from({ length: settings.futures }, () => ({
      ...remembered(before), going: before.going.copy(), seen: standing, rows: [], inside: [], feet: 0, moved: 0,
    }));
  }

  get full() {
    return this.frame >= WINDOW;
  }

  /** One frame more of all samples. */
  grow() {
    for (const sample of this.samples) this.draw(sample);
    const next = this.network.step(this.samples);
    this.samples.forEach((sample, k) => { sample.next = next[k]; });
    this.frame++;
  }

  draw(sample) {
    const { settings, random, normalizer: { kept, std }, columns, body, still } = this;
    const { going, next, input: before } = sample;
    const wanted = this.aim.wanted(going, this.frame / going.fps);
    const push = pushed(going, wanted);
    const component = choose(next, random, settings);
    sample.noise = nextNoise(sample.noise, kept.length, random, settings);
    const temperature = settings.temperature * (still ? QUIET : 1);
    const input = point(next, component, sample.noise, { temperature });
    columns.forEach((column, i) => { input[column] += settings.push * push[i] / std[i]; });
    if (settings.push > 0) {
      bound(input, columns, this.normalizer, going, wanted);
      if (still && going.pace < READY && wanted.off === 0) settle(input, before, body, this.stand); // else he turns
    }
    sample.input = input;
    const row = this.denormalize(input);
    if (this.frame) for (let i = ROOT; i < input.length; i++) sample.moved += (going.fps * (input[i] - before[i])) ** 2;
    going.move(row);
    sample.rows.push(row);
    sample.inside.push({ next, component, pace: going.pace, bearing: going.bearing });
    if (this.judged) this.judge(sample, row);
  }

  judge(sample, row) {
    const now = this.feet.seen(row, sample.going.place);
    sample.feet += this.feet.nats(row, sample.seen, now);
    sample.seen = now;
  }

  /** How far a whole sample is from what is asked, in nats; feet that slide count, and poses. */
  energy({ going, feet, moved, input }) {
    if (!this.judged) return 0;
    const { speed, bend, off } = this.wanted;
    const left = off - wrapped(course(going) - course(this.was));
    const still = speed < STILL;
    const body = still ? (CALM * moved) / ((WINDOW - 1) * (input.length - ROOT)) : half(left, WAY);
    const minds = (term) => this.settings[`term ${term}`] ?? 1;
    const way = half(going.turn - bend, TURNING) + body;
    return minds("speed") * half(going.pace - speed, SPEED) + minds("direction") * way + minds("feet") * FEET * feet;
  }

  /** Of all samples, energies in nats and the one that has least; NaN is worse than all. */
  best() {
    const energies = this.samples.map((sample) => this.energy(sample)).map((nats) => (Number.isFinite(nats) ? nats : Infinity));
    const chosen = energies.indexOf(Math.min(...energies));
    return { ...this.samples[chosen], energies, chosen };
  }
}

/** A copy of what a network knows, which may go its own way. */
const remembered = ({ input, hidden, cell, noise, next }) => ({
  input, noise, next, hidden: hidden.map((layer) => layer.slice()), cell: cell.map((layer) => layer.slice()),
});
