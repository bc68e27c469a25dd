// A walk along a line without a kernel: guided sampling by the network, here in the page.
import { GuidedWalk, pickStart } from "../network/guided.js";
import { loadWeights, readWeights } from "../network/weights.js";

const SLICE = 14; // milliseconds of work, after which the page may do something else
const SLOWER = 0.15; // share of the speed: what is told

export class PageWalker {
  /** `live` as motionlab/viewer/live/network_figure.py writes it. */
  constructor(live) {
    this.live = live;
    this.label = "guided, in this page";
  }

  /** What the button says that sets it going. */
  get invitation() {
    return this.weights ? "Walk" : `Walk (loads the network, ${this.live.megabytes} MB)`;
  }

  /**
   * Walk along wish.path at wish.speed, from wish.start (-1: what suits the speed), by chance of wish.seed, wish.refined or not. Tells
   * grown(track, share) again and again, and then done({error, notes, finished}); fails with a plain sentence.
   */
  async walk(wish, { said, grown, done }) {
    this.stopped = false;
    if (!this.weights) {
      said("Loading the network …");
      this.weights = readWeights(await loadWeights(this.live));
    }
    await pause();
    const { starts, fps } = this.weights;
    const start = wish.start < 0 ? pickStart(starts, wish.speed, fps) : wish.start;
    const settings = { ...this.live.settings, speed: wish.speed, seed: wish.seed, start, refined: wish.refined };
    const walk = new GuidedWalk(this.weights, { ...this.live.look, name: wish.name, label: this.label }, settings, wish.path);
    do {
      walk.reach(SLICE);
      grown(walk.track, walk.share);
      await pause();
    } while (!walk.over && !this.stopped);
    done({ error: wish.path.error(walk.track.ground(), fps), notes: this.notes(walk, wish), finished: walk.arrived });
  }

  stop() {
    this.stopped = true;
  }

  /** What was wished and could not be. */
  notes(walk, { speed, path }) {
    const seconds = walk.frame / walk.fps;
    const found = (walk.share * path.length) / Math.max(seconds, 1e-9);
    const notes = [];
    if (walk.fellApart) notes.push(`it fell apart after ${seconds.toFixed(1)} s; take another seed`);
    else if (walk.lost) notes.push(`lost the line after ${seconds.toFixed(1)} s: guided sampling alone does not always find back; try slower, or another seed`);
    else if (this.stopped && !walk.arrived) notes.push(`stopped after ${seconds.toFixed(1)} s`);
    else if (!walk.arrived) notes.push(`did not come to the end within ${seconds.toFixed(1)} s`);
    if (speed > walk.fastest) notes.push(`${speed} m/s is faster than anybody in the data; ${walk.fastest.toFixed(1)} m/s was asked for`);
    else if (walk.arrived && Math.abs(found / speed - 1) > SLOWER) notes.push(`${found.toFixed(2)} m/s on average where ${speed} was asked`);
    return notes;
  }
}

const pause = () => new Promise((resolve) => { setTimeout(resolve); });
