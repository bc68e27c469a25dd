// The time all motions of a player share, in frames of the motion.

export class Clock {
  constructor(frames, fps) {
    Object.assign(this, { frames, fps, time: 0, playing: false, speed: 1, growing: false, once: false });
  }

  get frame() {
    return Math.min(Math.round(this.time), this.frames - 1);
  }

  /** Go to a frame; returns it, held inside the motion. */
  seek(frame) {
    this.time = Math.min(Math.max(Number(frame) || 0, 0), this.frames - 1);
    return this.frame;
  }

  /** Let `seconds` pass; past the end it starts again, unless there are more frames to come, or it plays `once`. */
  tick(seconds) {
    if (!this.playing || this.frames < 2) return false;
    this.time += seconds * this.fps * this.speed;
    if (this.time <= this.frames - 1) return true;
    this.playing &&= !this.once;
    this.time = this.growing || this.once ? this.frames - 1 : this.time % (this.frames - 1);
    return true;
  }
}
