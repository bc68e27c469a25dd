// What is judged: one clip, or two side by side on one clock. It plays to its end, and a few times at most.
import { Player } from "../player.js";
import { make } from "./dom.js";

const SIDES = ["left", "right"];

export class ClipView {
  /**
   * Build it in `host`. `clips` are names of the content's tracks; `now` is what is known of this item: how often
   * it was played (`plays`), and whether to its end (`seen`). `changed` is called when either does.
   */
  constructor(host, content, clips, now, changed) {
    this.now = now;
    this.changed = changed;
    this.most = 1 + content.study.replays;
    const tracks = clips.map((name, i) => ({ ...content.tracks[name], label: clips.length > 1 ? SIDES[i] : "" }));
    const height = Math.round(Math.min(440, Math.max(220, 0.45 * globalThis.innerHeight)));
    const stage = make("div");
    this.button = make("button", { type: "button", className: "ml-load", onclick: () => this.play() });
    host.append(stage, make("div", { className: "ml-buttons" }, this.button));
    const payload = { ...content.player, tracks, height, paths: [], trail: [], overlay: false, bare: true };
    this.player = new Player(stage, payload);
    stage.addEventListener("motionlab:ended", () => this.ended());
    stage.addEventListener("motionlab:missing", () => this.shown());
    this.show();
  }

  /** Whether there is anything to be seen: not without WebGL. */
  get blind() { return !this.player.canvas.isConnected; }

  play() {
    const { player, now } = this;
    if (player.playing || !this.may) return;
    now.plays += 1;
    player.setFrame(0);
    player.play();
    this.shown();
  }

  /** Whether it may be played: a few times, and in any case until it was seen to its end. */
  get may() { return !this.blind && (this.now.plays < this.most || !this.now.seen); }

  ended() {
    if (this.blind) return;
    this.now.seen = true;
    this.shown();
  }

  shown() {
    this.show();
    this.changed();
  }

  show() {
    const { now, player } = this;
    const left = Math.max(this.most - now.plays, 0);
    this.button.disabled = !player.playing && !this.may; // while it plays the focus shall stay
    this.button.textContent = player.playing ? "Playing" : now.plays === 0 || !now.seen ? "Play" : `Play again (${left} left)`;
  }

  dispose() { this.player.dispose(); }
}
