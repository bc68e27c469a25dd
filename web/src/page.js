// Entry of the script for built pages: brings every figure that Python wrote to life.
import { PathFigure } from "./drawing/figure.js";
import { Dream } from "./network/dream.js";
import { Player } from "./player.js";
import { SteerFigure } from "./steering/figure.js";
import { StudyFigure } from "./study/figure.js";

const KINDS = { "motionlab-player": Player, "motionlab-dream": Dream, "motionlab-path": PathFigure, "motionlab-steer": SteerFigure, "motionlab-study": StudyFigure };

function mount(figure, Kind) {
  const data = figure.querySelector('script[type="application/json"]');
  if (!data || figure.motionlab) return;
  // With scripting on, a browser keeps the content of <noscript> as mere text.
  const fallback = new DOMParser().parseFromString(figure.querySelector("noscript")?.textContent ?? "", "text/html");
  const still = fallback.querySelector("img")?.getAttribute("src");
  const caption = figure.querySelector("figcaption");
  try {
    figure.motionlab = new Kind(figure, JSON.parse(data.textContent), still);
    data.textContent = ""; // decoded: free the text
  } catch (error) {
    const note = Object.assign(document.createElement("p"), { textContent: `This motion can't be shown: ${error.message}` });
    figure.prepend(note);
  }
  if (caption) figure.append(caption);
}

function mountAll() {
  for (const [name, Kind] of Object.entries(KINDS)) {
    document.querySelectorAll(`figure.${name}`).forEach((figure) => mount(figure, Kind));
  }
}

if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", mountAll);
else mountAll();
