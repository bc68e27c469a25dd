// The figure in which a network runs in the reader's browser. Until its weights are loaded, by a
// click, it plays clips that were sampled beforehand.
import { addStyle } from "../style.js";
import { Player } from "../player.js";
import { Dreamer } from "./dreamer.js";
import { LivePlayer } from "./live_player.js";
import { Panel } from "./panel.js";
import { loadWeights, readWeights } from "./weights.js";

const TELL_EVERY = 1000; // milliseconds
const LEAST_SEEN = 0.5; // seconds of play from which a pace is judged
const RESTARTS = ["start", "seed"]; // what can't change in the middle of a motion

export class Dream {
  /** `data` as motionlab/viewer/live/dream_page.py writes it; `still` is an image URL. */
  constructor(figure, { clips, live, controls, starts, facts }, still) {
    Object.assign(this, { figure, clips, live, still });
    addStyle(figure);
    this.settings = Object.fromEntries(controls.map(({ name, value }) => [name, value]));
    this.stage = document.createElement("div");
    this.panel = new Panel(controls, starts, facts, (name, value) => this.change(name, value));
    this.panel.load.textContent = `Load the network (${live.megabytes} MB)`;
    this.panel.load.addEventListener("click", () => this.load());
    this.say("These clips were sampled beforehand. Load the network, and it goes on without end, here in this page.");
    figure.append(this.stage);
    this.show((host) => new Player(host, this.clips[this.settings.start], still));
  }

  /** Another player takes the stage. */
  show(build) {
    this.player?.dispose();
    this.stage.replaceChildren();
    this.player = build(this.stage);
    this.stage.append(this.panel.element);
  }

  async load() {
    this.panel.load.disabled = true;
    this.say("Loading …");
    try {
      const weights = readWeights(await loadWeights(this.live));
      this.dreamer = new Dreamer(weights, this.live.look, this.settings);
    } catch (error) {
      this.panel.load.disabled = false;
      this.say(error.message);
      return;
    }
    this.show((host) => new LivePlayer(host, this.live, this.still, this.dreamer));
    this.panel.setLive(true);
    this.player.canvas.focus({ preventScroll: true });
    this.figure.dataset.live = "";
    this.say("Runs here, in this page.");
    this.telling = setInterval(() => this.tellCost(), TELL_EVERY);
  }

  change(name, value) {
    this.settings[name] = value;
    if (!this.dreamer) return this.show((host) => new Player(host, this.clips[value], this.still));
    this.dreamer.settings[name] = value;
    if (name === "characters") this.dreamer.populate();
    if (RESTARTS.includes(name)) this.player.reset();
    this.player.refresh();
  }

  /** What a frame costs, and whether they keep up with the clock, which rests while nobody looks. */
  tellCost() {
    const { cost, last, settings, fps, network, exploded } = this.dreamer;
    const { clock, playing } = this.player;
    const made = last - (this.told ?? last);
    const seconds = clock.asked / (fps * clock.speed);
    this.told = last;
    clock.asked = 0;
    if (!cost || !playing || made <= 0) return;
    const many = settings.characters > 1 ? ` of ${settings.characters} characters` : "";
    const busy = seconds > LEAST_SEEN && made < 0.8 * seconds * fps * clock.speed;
    const slow = busy ? ` This machine is busy: ${Math.round(made / seconds)} frames a second instead of ${fps * clock.speed}.` : "";
    const same = many && network.certain && !settings.noise ? " Without noise a start has one future: all do the same." : "";
    const fallen = exploded ? ` A motion fell apart and began again: ${exploded} so far.` : "";
    this.say(`Runs here, in this page: ${cost.toFixed(1)} ms for a frame${many}.${same}${fallen}${slow}`);
  }

  say(text) {
    if (this.panel.status.textContent !== text) this.panel.status.textContent = text;
  }
}
