// The row of controls below the picture. Plain HTML controls, so that keyboard, touch and screen
// readers work as everywhere.
import { SaveRow } from "./save_row.js";

const ICONS = {
  play: "M8 5v14l11-7z",
  pause: "M6 5h4v14H6zM14 5h4v14h-4z",
  follow: "M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8zm9 3h-2.1A7 7 0 0 0 13 5.1V3h-2v2.1A7 7 0 0 0 5.1 11H3v2h2.1A7 7 0 0 0 11 18.9V21h2v-2.1a7 7 0 0 0 5.9-5.9H21zm-9 6a5 5 0 1 1 0-10 5 5 0 0 1 0 10z",
  overlay: "M4 4h11v3h-2V6H6v7h1v2H4zm5 5h11v11H9zm2 2v7h7v-7z",
  save: "M11 3h2v9.2l3.6-3.6L18 10l-6 6-6-6 1.4-1.4 3.6 3.6zM4 18h2v2h12v-2h2v4H4z",
  reset: "M12 5V1L7 6l5 5V7a5 5 0 1 1-5 5H5a7 7 0 1 0 7-7z",
};
const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

const icon = (name) => `<svg viewBox="0 0 24 24" aria-hidden="true"><path d="${ICONS[name]}"/></svg>`;

function button(name, label, onClick) {
  const made = document.createElement("button");
  made.type = "button";
  made.className = `ml-button ml-${name}`;
  made.innerHTML = icon(name);
  made.title = label;
  made.setAttribute("aria-label", label);
  made.addEventListener("click", onClick);
  return made;
}

export class Bar {
  /** `player` has toggle, setFrame, set(name, value), reset and the properties shown here. */
  constructor(player, frames, fps, several) {
    this.fps = fps;
    this.element = document.createElement("div");
    this.element.className = "ml-bar";
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Player controls");

    this.play = button("play", "Play", () => player.toggle());
    this.slider = document.createElement("input");
    Object.assign(this.slider, { type: "range", min: 0, max: Math.max(frames - 1, 0), step: 1, value: 0, className: "ml-slider" });
    this.slider.setAttribute("aria-label", "Frame");
    this.slider.addEventListener("input", () => player.scrub(this.slider.valueAsNumber));
    this.time = document.createElement("output");
    this.time.className = "ml-time";
    this.time.setAttribute("aria-live", "off");
    this.speed = document.createElement("select");
    this.speed.className = "ml-speed";
    this.speed.title = "Speed";
    this.speed.setAttribute("aria-label", "Speed");
    for (const speed of SPEEDS) this.speed.add(new Option(`${speed}×`, speed));
    this.speed.addEventListener("change", () => player.set("speed", Number(this.speed.value)));
    this.follow = button("follow", "Follow with the camera", () => player.set("follow", !player.follow));
    this.overlay = button("overlay", "Show all in one picture", () => player.set("overlay", !player.overlay));
    this.reset = button("reset", "Reset view and time", () => player.reset());
    this.saving = new SaveRow(player);
    this.save = button("save", "Save as a file", () => this.saving.toggle(this.save));
    this.save.setAttribute("aria-expanded", "false");
    this.overlay.hidden = !several;
    this.element.append(this.play, this.slider, this.time, this.speed, this.follow, this.overlay, this.reset, this.save);
    if (player.payload?.choose && !player.payload.chart?.picks) this.element.append(this.chooser(player));
    this.element.append(this.saving.element);
  }

  /** A slider over motions of which one is seen at a time: another temperature, another weight. */
  chooser(player) {
    const names = player.tracks.map((track) => track.label);
    this.names = names;
    this.choice = document.createElement("input");
    Object.assign(this.choice, { type: "range", min: 0, max: names.length - 1, step: 1, value: player.chosen, className: "ml-slider" });
    this.choice.setAttribute("aria-label", player.payload.choose);
    this.choice.addEventListener("input", () => player.set("chosen", this.choice.valueAsNumber));
    this.name = document.createElement("output");
    this.name.className = "ml-time";
    const row = document.createElement("div");
    row.className = "ml-choose";
    row.append(Object.assign(document.createElement("span"), { textContent: player.payload.choose }), this.choice, this.name);
    return row;
  }

  show({ frame, playing, speed, follow, overlay, chosen }) {
    if (this.playing !== playing) {
      this.playing = playing;
      this.play.innerHTML = icon(playing ? "pause" : "play");
      this.play.title = playing ? "Pause" : "Play";
      this.play.setAttribute("aria-label", this.play.title);
    }
    this.slider.valueAsNumber = frame;
    const seconds = (frame / this.fps).toFixed(2);
    this.slider.setAttribute("aria-valuetext", `frame ${frame}, ${seconds} seconds`);
    this.time.value = `${seconds} s`;
    this.time.title = `frame ${frame}`;
    if (!SPEEDS.includes(speed) && ![...this.speed.options].some((o) => Number(o.value) === speed)) {
      this.speed.add(new Option(`${speed}×`, speed));
    }
    this.speed.value = String(speed);
    this.follow.setAttribute("aria-pressed", String(follow));
    this.overlay.setAttribute("aria-pressed", String(overlay));
    if (this.choice) {
      this.choice.valueAsNumber = chosen;
      this.choice.setAttribute("aria-valuetext", this.names[chosen]);
      this.name.value = this.names[chosen];
    }
    this.saving.show();
  }
}
