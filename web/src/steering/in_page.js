// Steering without a kernel: the page's own network makes the frames.
import { pickStart } from "../network/guided.js";
import { SHARE } from "../network/live_player.js";
import { loadWeights, readWeights } from "../network/weights.js";
import { late } from "./pace.js";
import { Steered } from "./steered.js";

const PACE = 1.2; // m/s, of a start that nobody chose

export class PageSource {
  ready = false; // nothing is loaded until a reader asks for it
  looks = true; // the network can be looked into

  invitation({ live }) {
    return `Load the network (${live.megabytes} MB)`;
  }

  /** Characters who can be steered; fails with a plain sentence. */
  async load({ live, body }, settings, cast) {
    const weights = readWeights(await loadWeights(live));
    if (settings.start < 0) settings.start = pickStart(weights.starts, PACE, weights.fps);
    return new Steered(weights, live.look, body, settings, cast);
  }

  /** `pace`: of time as it is seen, 1 where pictures come in time. */
  cost({ cost, fps, cast, latency, settings }, pace) {
    const much = cost > (SHARE * 1000) / fps;
    const slow = much ? " That is too much for this machine, and time passes slower" + (cast[0].futures ? "." : ": take fewer futures.") : late(pace);
    const [least, most] = latency.map((seconds) => (seconds + settings.delay).toFixed(2));
    return `Runs here, in this page: ${cost.toFixed(1)} ms for a frame. A wish is seen after ${least} to ${most} s.${slow}`;
  }
}
