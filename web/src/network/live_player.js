// The player of a motion that is being made while it plays, without end.
import { Clock } from "../clock.js";
import { making } from "../loop.js";
import { Mannequin } from "../mannequin.js";
import { Contacts, disposeAll, Tail } from "../marks.js";
import { Player, TWIST } from "../player.js";
import { KEPT } from "./live_track.js";

export const SHARE = 0.5; // of the time between pictures that networks may take, all of a page; slower machines play slower

/** Time that asks the network for frames as it passes. */
class LiveClock extends Clock {
  constructor(dreamer) {
    super(Infinity, dreamer.fps);
    this.dreamer = dreamer;
    this.asked = 0; // frames, while somebody saw it play
  }

  get frame() {
    return Math.min(Math.round(this.time), this.dreamer.last);
  }

  /** The last seconds are kept; a step past the newest frame makes another one. */
  seek(frame) {
    const oldest = Math.min(...this.dreamer.tracks.map((track) => track.oldest));
    this.time = Math.min(Math.max(Number(frame) || 0, oldest), this.dreamer.last + this.fps);
    return this.hold();
  }

  tick(seconds) {
    const moved = super.tick(seconds);
    if (moved) {
      this.asked += seconds * this.fps * this.speed;
      this.hold((1000 * SHARE * seconds) / Math.max(making(), 1));
    }
    return moved;
  }

  hold(milliseconds) {
    this.dreamer.reach(Math.ceil(this.time), milliseconds);
    this.time = Math.min(this.time, this.dreamer.last);
    return this.frame;
  }
}

export class LivePlayer extends Player {
  /** `payload`: height, floor, trail (points), autoplay. */
  constructor(host, payload, still, dreamer) {
    const settings = { ...payload, fps: dreamer.fps, frames: 1, follow: true, duration: "made as it plays" };
    super(host, settings, still, dreamer.tracks, new LiveClock(dreamer));
    this.dreamer = dreamer;
    // there is no whole to scrub through, and a camera that stays is soon alone
    for (const control of [this.bar.slider, this.bar.follow]) control.hidden = true;
    this.bar.reset.title = "Begin again";
    this.bar.reset.setAttribute("aria-label", "Begin again");
    this.bar.save.title = `Save the last ${KEPT} seconds as a file`;
    this.bar.save.setAttribute("aria-label", this.bar.save.title);
  }

  cast(track) {
    const { floor, trail } = this.payload;
    return [new Mannequin(track), ...(track.contacts ? [new Contacts(track, floor)] : []), ...trail.map((point) => new Tail(track, point))];
  }

  /** The same start again, or what the settings say now. */
  reset() {
    this.dreamer.restart();
    this.clock.time = 0;
    this.lookFromStart();
    this.refresh();
  }

  get savedHow() {
    const twist = this.dreamer.encoding.locals ? "." : `, ${TWIST}`;
    return `What was dreamt last, ${KEPT} seconds at most, ${this.dreamer.fps} frames a second${twist}`;
  }

  set(name, value) {
    if (name !== "follow") super.set(name, value);
  }

  /** Every body has a view of its own, and the camera rides along. */
  room() {
    return 0;
  }

  draw() {
    if (this.casts) this.recast();
    super.draw();
  }

  /** Figures change when characters come, go or begin again. */
  recast() {
    const before = this.casts;
    this.casts = this.tracks.map((track) => before.find(([figure]) => figure.track === track) ?? this.cast(track));
    for (const actor of before.filter((cast) => !this.casts.includes(cast)).flat()) disposeAll(actor);
  }
}
