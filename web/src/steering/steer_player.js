// The player of characters who are steered while it plays. Keys steer while the picture has the focus, or what stands below
// it and has no use for them, and only then.
import { LivePlayer } from "../network/live_player.js";
import { TWIST } from "../player.js";
import { Arrows } from "./arrows.js";
import { steers } from "./commands.js";
import { Delayed } from "./delayed.js";
import { giveBack, takes } from "./focus.js";
import { Pace } from "./pace.js";
import { Stick } from "./stick.js";

const BEHIND = Math.PI; // the camera's azimuth: one looks along z, as he does
const [WIDER, HIGHER] = [1.25, 0.2]; // times as far as other players, and radians higher: there is ground to see

export class SteerPlayer extends LivePlayer {
  /** `payload`: height, floor, trail, autoplay, kept (seconds); `steered`: Steered, or what a kernel steers. */
  constructor(host, payload, still, steered, commands) {
    super(host, payload, still, steered);
    Object.assign(this, { steered, commands, delayed: new Delayed(), passes: new Pace() });
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-roledescription", "steered character");
    this.canvas.setAttribute("aria-label", "A character who is steered: hold arrow keys, or W, A, S and D, to go that way as you see it, with "
      + "Shift to run. Space pauses, Q and E turn the view, plus and minus zoom, R begins again.");
    this.bar.save.title = `Save the last ${payload.kept} seconds as a file`;
    this.bar.save.setAttribute("aria-label", this.bar.save.title);
    this.stick = new Stick((hand) => this.moved(hand));
    this.view.append(this.stick.element);
    this.letGo = () => this.release();
    this.hide = () => document.hidden && this.release();
    this.hands = { keydown: (event) => this.beside(event), keyup: (event) => this.keyUp(event), focusout: (event) => this.left(event) };
    for (const [type, hear] of Object.entries(this.hands)) host.addEventListener(type, hear);
    this.keepFocus = giveBack(host, this.canvas);
    globalThis.addEventListener("blur", this.letGo);
    document.addEventListener("visibilitychange", this.hide);
  }

  cast(track, i) {
    return [...super.cast(track, i), new Arrows(track, this.payload.floor)];
  }

  // -- hands --------------------------------------------------------------------------------------

  /** A key while something below the picture has the focus. */
  beside(event) {
    const { target, key } = event;
    if (this.view.contains(target)) return; // then `key` has heard it
    if (key === "Enter" && target.matches("input[type=number]")) this.canvas.focus({ preventScroll: true });
    const steering = steers(event);
    if (steering && !takes(target, steering)) this.key(event);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    this.commands.running = event.shiftKey;
    const steering = steers(event);
    const turns = { KeyQ: 0.15, KeyE: -0.15 };
    const actions = { " ": () => this.toggle(), r: () => this.reset(), "+": () => this.orbit.turn(0, 0, 1 / 1.15), "-": () => this.orbit.turn(0, 0, 1.15) };
    if (steering) {
      this.commands.keys.add(steering);
      this.play();
    } else if (turns[event.code]) this.orbit.turn(turns[event.code], 0);
    else if (actions[event.key]) actions[event.key]();
    else return;
    event.preventDefault();
    event.stopPropagation(); // a notebook has its own meaning for these keys
    this.dirty = true;
  }

  keyUp(event) {
    this.commands.running = event.shiftKey;
    const steering = steers(event);
    if (steering) this.commands.keys.delete(steering);
  }

  /** The focus leaves something; keys that are held are let go if they are another's now. */
  left({ relatedTarget }) {
    if (!this.host.contains(relatedTarget)) return this.release();
    for (const key of this.commands.keys) if (takes(relatedTarget, key)) this.commands.keys.delete(key);
  }

  moved(hand) {
    this.commands.stick = hand;
    if (Math.hypot(...hand)) this.play();
  }

  /** Nothing is held any more: the focus has gone. */
  release() {
    this.commands.release();
    this.stick.release();
  }

  // -- time ---------------------------------------------------------------------------------------

  tick(seconds) {
    const now = performance.now();
    const before = this.clock.time;
    this.commands.poll();
    const heard = this.delayed.hear(before, this.commands.asked(this.facing), this.commands.settings.delay * this.steered.fps);
    if (heard) this.steered.steer(heard);
    super.tick(seconds);
    if (this.playing) this.passes.picture(now, (this.clock.time - before) / (this.clock.fps * this.clock.speed));
    else this.passes.rest();
  }

  /** Radians off +z that the camera looks. */
  get facing() {
    const { x, z } = this.orbit.eye.position;
    return Math.atan2(-x, -z);
  }

  lookFromStart(keepAngle = false) {
    super.lookFromStart(keepAngle);
    if (keepAngle) return;
    this.azimuth = BEHIND;
    this.orbit.place(BEHIND, WIDER * this.orbit.distance, this.payload.floor + 0.5 * this.tall);
    this.orbit.turn(0, -HIGHER);
  }

  get savedHow() {
    const twist = this.steered.encoding.locals ? "" : `, ${TWIST}`;
    return `What was done last, ${this.payload.kept} seconds at most, ${this.steered.fps} frames a second${twist}; it stands where it stood, in metres.`;
  }

  dispose() {
    for (const [type, hear] of Object.entries(this.hands)) this.host.removeEventListener(type, hear);
    this.keepFocus();
    globalThis.removeEventListener("blur", this.letGo);
    document.removeEventListener("visibilitychange", this.hide);
    super.dispose();
  }
}
