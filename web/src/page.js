// Entry of the script for built pages: makes a player of every figure that Python wrote.
import { Player } from "./player.js";

function mount(figure) {
  const data = figure.querySelector('script[type="application/json"]');
  if (!data || figure.motionlab) return;
  // With scripting on, a browser keeps the content of <noscript> as mere text.
  const fallback = new DOMParser().parseFromString(figure.querySelector("noscript")?.textContent ?? "", "text/html");
  const still = fallback.querySelector("img")?.getAttribute("src");
  const caption = figure.querySelector("figcaption");
  try {
    const player = new Player(figure, JSON.parse(data.textContent), still);
    data.textContent = ""; // decoded: free the text
    figure.motionlab = player;
  } catch (error) {
    const note = Object.assign(document.createElement("p"), { textContent: `This motion can't be shown: ${error.message}` });
    figure.prepend(note);
  }
  if (caption) figure.append(caption);
}

const mountAll = () => document.querySelectorAll("figure.motionlab-player").forEach(mount);

if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", mountAll);
else mountAll();
