// A walk along a line that a kernel solves, window by window: motionlab/viewer/live/draw_path_kernel.py.
import { decode } from "../motion.js";

export class KernelWalker {
  /** `model` is the widget's. */
  constructor(model) {
    this.model = model;
    this.label = "solved by the kernel";
    this.invitation = "Walk";
    this.asked = 0;
    this.hear = (message) => this.told(message);
    model.on("msg:custom", this.hear);
  }

  /** As a PageWalker's. */
  walk({ points, speed, start, seed, refined }, listener) {
    this.asked = `${Date.now()}-${Math.random()}`; // another view of the widget asks for others
    this.track = null;
    listener.said("The kernel is solving it …");
    return new Promise((resolve, reject) => {
      Object.assign(this, { listener, resolve, reject });
      this.model.send({ do: "walk", id: this.asked, points, speed, start, seed, refined });
    });
  }

  stop() {
    this.model.send({ do: "stop", id: this.asked });
  }

  told({ id, frames, share, whole, error, notes, finished, failed }) {
    if (id !== this.asked) return;
    if (failed) return this.reject(new Error(failed));
    const [track] = decode(frames ?? whole);
    track.label = this.label;
    if (!this.track) this.track = track;
    else if (frames) this.track.extend(track);
    else this.track.become(track);
    this.listener.grown(this.track, share ?? 1);
    if (!whole) return;
    this.listener.done({ error, notes, finished });
    this.resolve();
  }

  dispose() {
    this.model.off("msg:custom", this.hear);
  }
}
