// The player of characters who are steered while it plays. Keys steer while the picture has the focus, and only then.
import { LivePlayer } from "../network/live_player.js";
import { TWIST } from "../player.js";
import { Arrows } from "./arrows.js";
import { steers } from "./commands.js";
import { Stick } from "./stick.js";

const BEHIND = Math.PI; // the camera's azimuth: one looks along z, as he does
const [WIDER, HIGHER] = [1.25, 0.2]; // times as far as other players, and radians higher: there is ground to see

export class SteerPlayer extends LivePlayer {
  /** `payload`: height, floor, trail, autoplay, kept (seconds); `steered`: Steered, or what a kernel steers. */
  constructor(host, payload, still, steered, commands) {
    super(host, payload, still, steered);
    Object.assign(this, { steered, commands });
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-roledescription", "steered character");
    this.canvas.setAttribute("aria-label", "A character who is steered: hold arrow keys, or W, A, S and D, to go that way as you see it, with "
      + "Shift to run. Space pauses, Q and E turn the view, plus and minus zoom, R begins again.");
    this.bar.save.title = `Save the last ${payload.kept} seconds as a file`;
    this.bar.save.setAttribute("aria-label", this.bar.save.title);
    this.stick = new Stick((hand) => this.moved(hand));
    this.view.append(this.stick.element);
    this.view.addEventListener("keyup", (event) => this.keyUp(event));
    this.letGo = () => this.release();
    this.hide = () => document.hidden && this.release();
    this.canvas.addEventListener("blur", this.letGo);
    globalThis.addEventListener("blur", this.letGo);
    document.addEventListener("visibilitychange", this.hide);
  }

  cast(track, i) {
    return [...super.cast(track, i), new Arrows(track, this.payload.floor)];
  }

  // -- hands --------------------------------------------------------------------------------------

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== this.canvas) return;
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

  moved(hand) {
    this.commands.stick = hand;
    if (Math.hypot(...hand)) this.play();
  }

  /** Keys that are held when the focus goes are not held any more. */
  release() {
    this.commands.release();
    this.stick.release();
  }

  // -- time ---------------------------------------------------------------------------------------

  tick(seconds) {
    this.commands.poll();
    this.steered.steer(this.commands.asked(this.facing));
    super.tick(seconds);
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
    globalThis.removeEventListener("blur", this.letGo);
    document.removeEventListener("visibilitychange", this.hide);
    super.dispose();
  }
}
