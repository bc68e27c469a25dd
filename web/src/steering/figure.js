// Steer a character: the picture, what may be set, what is asked and done, and a look inside. Who makes the frames, the
// page's own network or a kernel, is a source; see in_page.js and in_kernel.js.
import { field, provenance } from "../network/panel.js";
import { Player } from "../player.js";
import { addStyle } from "../style.js";
import { currentTheme, watchTheme } from "../theme.js";
import { ASKED } from "./arrows.js";
import { Commands } from "./commands.js";
import { Course } from "./course.js";
import { PageSource } from "./in_page.js";
import { Inside } from "./inside.js";
import { SteerPlayer } from "./steer_player.js";

const TELL_EVERY = 1000; // milliseconds
const OF_HANDS = ["speed", "direction", "onward"]; // settings of what is asked; the others are of who does it
const NEAR = [...OF_HANDS, "help", "lock", "refined"]; // those that stand right below the picture, where a thumb is
const ROOMY = "(min-width: 481px)"; // a window in which all of them do

const CLICK = "Click the picture, then hold an arrow key: he walks that way. Or drag the stick.";
const BEGIN = "Hold an arrow key, or W, A, S or D, to walk that way, with Shift to run. Or drag the stick in the picture.";

const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });
const degrees = (angle) => Math.round((180 * Math.atan2(Math.sin(angle), Math.cos(angle))) / Math.PI); // within half a turn

export class SteerFigure {
  /** `content` as motionlab/viewer/live/steer_settings.py writes it; `still` is an image URL. */
  constructor(figure, content, still, source = new PageSource()) {
    Object.assign(this, { figure, content, still, source });
    addStyle(figure);
    this.stage = make("div", "ml-stage");
    figure.append(this.stage);
    this.unwatchTheme = watchTheme((theme) => { figure.dataset.mlTheme = theme; });
    figure.dataset.mlTheme = currentTheme();
    this.stage.addEventListener("motionlab:frame", () => this.lines && this.tell());
    // without being asked, but for who saves data or wants little motion
    this.waits = content.at_once && !navigator.connection?.saveData && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.choose(0);
    if (this.waits) this.loadInSight();
  }

  loadInSight() {
    const sight = new IntersectionObserver((entries) => {
      if (!entries.some(({ isIntersecting }) => isIntersecting)) return;
      sight.disconnect();
      if (!this.go.disabled && !this.steered) this.load({ focus: false });
    });
    sight.observe(this.stage);
  }

  /** Take one of the networks; until it is loaded there is a clip of it. */
  choose(number) {
    clearInterval(this.telling);
    const { height } = this.content;
    Object.assign(this, { network: this.content.networks[number], steered: null, lines: null });
    delete this.figure.dataset.live;
    this.settings = Object.fromEntries(this.network.controls.map(({ name, value }) => [name, value]));
    this.commands = new Commands(this.settings, (way) => this.put("direction", way));
    this.panel = this.build(number);
    this.stage.append(this.panel);
    if (this.source.ready) return this.load();
    if (this.waits) { // a picture alone, since a clip would draw what goes at once
      const picture = Object.assign(make("img", "ml-waits"), { src: this.still, alt: "" });
      picture.style.height = `${height}px`;
      this.stage.replaceChildren(picture, this.panel);
      return null;
    }
    this.showClip();
    this.say("This clip was sampled beforehand. Load the network, and it is yours to steer, here in this page.");
    return null;
  }

  showClip() {
    const { height } = this.content;
    this.show((host) => new Player(host, { ...this.network.clip, height }, this.still));
  }

  build(number) {
    const { networks, beside } = this.content;
    const panel = make("div", "ml-panel");
    this.told = make("div", "ml-told");
    this.status = make("p", "ml-status");
    this.status.setAttribute("role", "status");
    this.go = Object.assign(make("button", "ml-load", this.source.invitation(this.network)), { type: "button" });
    this.go.addEventListener("click", () => this.load());
    const [grid, others] = [make("div", "ml-grid ml-near"), make("div", "ml-grid")];
    this.more = make("details", "ml-more");
    this.more.open = !this.content.at_once && (globalThis.matchMedia?.(ROOMY).matches ?? true);
    this.more.append(make("summary", "", "More settings"), others);
    if (networks.length > 1) grid.append(this.chooser(number));
    const used = this.network.controls.filter(({ name }) => name !== "futures" || !beside.length);
    this.fields = Object.fromEntries(used.map((control) => [control.name, field(control, this.network.starts, (name, value) => this.change(name, value))]));
    for (const [name, box] of Object.entries(this.fields)) (NEAR.includes(name) ? grid : others).append(box);
    this.inside = make("div", "");
    this.course = new Course((path) => this.lead(path));
    panel.append(this.told, this.go, grid, this.status, this.more, this.course.element, this.inside, ...(this.network.facts.length ? [provenance(this.network.facts)] : []));
    this.setLive(false);
    return panel;
  }

  chooser(number) {
    const box = make("label", "ml-field");
    const choice = make("select", "ml-choice");
    this.content.networks.forEach(({ name }, i) => choice.add(new Option(name, i)));
    choice.value = number;
    choice.setAttribute("aria-label", "Network");
    choice.addEventListener("change", () => this.choose(Number(choice.value)));
    box.append(make("span", "ml-caption", "Network"), choice);
    return box;
  }

  setLive(live) {
    this.go.hidden = live;
    this.stage.classList.toggle("ml-steered", live);
    for (const part of [this.told, this.inside, this.more, this.course.element, ...Object.values(this.fields)]) part.hidden = !live;
  }

  show(build) {
    this.player?.dispose();
    this.stage.replaceChildren();
    this.player = build(this.stage);
    this.stage.append(this.panel);
  }

  /** Whoever asked for it steers at once; keys of a page that is read stay its own. */
  async load({ focus = true } = {}) {
    const { network, content: { beside, height, kept } } = this;
    this.go.disabled = true;
    this.say("Loading …");
    try {
      const cast = beside.length ? beside : [{ label: "", color: network.live.look.color, futures: null }];
      const steered = await this.source.load(network, this.settings, cast);
      if (this.network !== network) return; // another was chosen meanwhile
      this.steered = steered;
    } catch (error) {
      if (this.waits) this.showClip();
      this.waits = this.go.disabled = false;
      this.say(error.message);
      return;
    }
    this.waits = false;
    const payload = { ...network.live, height, kept, trail: [], autoplay: true };
    this.show((host) => new SteerPlayer(host, payload, this.still, this.steered, this.commands));
    this.setLive(true);
    this.look();
    if (focus) this.player.canvas.focus({ preventScroll: true });
    this.figure.dataset.live = "";
    this.tell();
    this.tellCost();
    this.telling = setInterval(() => this.tellCost(), TELL_EVERY);
  }

  /** Lines that tell what is asked and done, and the bars. */
  look() {
    this.lines = this.steered.tracks.map(({ label, color }) => {
      const line = make("p", "");
      const [asked, done] = [make("span", "ml-name"), make("span", "ml-name")];
      asked.style.setProperty("--ml-color", ASKED);
      done.style.setProperty("--ml-color", color);
      line.append(...(label ? [make("b", "", label)] : []), asked, done);
      return { line, asked, done };
    });
    this.told.replaceChildren(...this.lines.map(({ line }) => line));
    this.bars = this.steered.tracks.map(() => this.source.looks && new Inside(this.steered.weights, this.steered.weights.settings.components));
    this.inside.replaceChildren(...this.bars.filter(Boolean).map(({ element }) => element));
  }

  change(name, value) {
    this.settings[name] = value;
    if (name === "onward") this.commands.used = true;
    if (!this.steered || OF_HANDS.includes(name)) return;
    this.steered.settings[name] = value;
    if (this.content.restarts.includes(name)) this.player.reset();
    this.player.refresh();
  }

  /** Along a path (Path), or no longer. */
  lead(path) {
    this.commands.path = path;
    if (path) this.player.play();
  }

  /** A setting that a hand changed: its slider follows. */
  put(name, value) {
    this.settings[name] = value;
    const input = this.fields[name]?.querySelector("input");
    if (!input || input.valueAsNumber === value) return;
    input.value = value;
    input.dispatchEvent(new Event("input"));
  }

  /** Of the frame that is seen: what was asked and what was done. */
  tell() {
    this.steered.tracks.forEach((track, k) => {
      const seen = track.at(this.player.frame);
      const { asked: { speed, direction }, pace, bearing } = seen;
      this.lines[k].asked.textContent = Number.isNaN(direction) ? "asked: nothing" : speed < 0.15 ? "asked: stand" : `asked: ${speed.toFixed(1)} m/s, ${degrees(direction)}°`;
      this.lines[k].done.textContent = pace < 0.15 ? `does: ${pace.toFixed(2)} m/s` : `does: ${pace.toFixed(1)} m/s, ${degrees(bearing)}°`;
      if (seen.next) this.bars[k]?.show(seen);
    });
    this.course.mark(this.steered.tracks.map((track) => [track.color, track.onGround(this.player.frame)]), this.player.frame);
  }

  /** How to begin; then what a frame costs, whether pictures come too slowly, and what is not met. */
  tellCost() {
    const pace = this.player.passes.take();
    const [first] = this.steered.records;
    const notes = first?.notes.length ? ` Not met: ${first.notes.join("; ")}.` : "";
    const begun = this.commands.used || notes || this.source.failed;
    const begin = this.figure.contains(document.activeElement) ? BEGIN : CLICK;
    this.say(begun ? `${this.source.cost(this.steered, pace)}${notes}` : begin);
  }

  say(text) {
    if (this.status.textContent !== text) this.status.textContent = text;
  }

  dispose() {
    clearInterval(this.telling);
    this.player?.dispose();
    this.source.dispose?.();
    this.unwatchTheme();
  }
}
