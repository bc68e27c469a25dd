// The player of walks along a line, which may still be growing. One looks along z, as the board above does.
import { Clock } from "../clock.js";
import { Player } from "../player.js";

export class WalkPlayer extends Player {
  /** `tracks` of `count` frames; `path` [[x, z], ...] lies on the ground in a color. */
  constructor(host, { height, floor, fps, autoplay }, still, tracks, path, color, growing) {
    const frames = longest(tracks);
    const clock = Object.assign(new Clock(frames, fps), { growing });
    const paths = [{ points: path, color }];
    super(host, { height, floor, fps, frames, paths, autoplay, follow: true, duration: "along the line" }, still, tracks, clock);
  }

  /** There are more frames; the last ones, unless it is still `growing`. */
  grow(growing) {
    this.clock.frames = longest(this.tracks);
    this.clock.growing = growing;
    this.bar.slider.max = this.clock.frames - 1;
    if (!growing) this.bar.saving.show();
    this.refresh();
  }

  lookFromStart(keepAngle = false) {
    super.lookFromStart(keepAngle);
    if (keepAngle) return;
    this.azimuth = Math.PI + 0.5;
    this.orbit.place(this.azimuth, this.orbit.distance, this.payload.floor + 0.5 * this.tall);
  }

  get savedHow() {
    return `${this.payload.fps} frames a second; it stands where the line is, in metres.`;
  }
}

const longest = (tracks) => Math.max(...tracks.map((track) => track.count));
