// Entry of the Jupyter widgets: ties the player to the traits of motionlab.viewer.Player, and the board to draw on and
// who is steered to the kernel that solves a path or makes his frames.
import { PathFigure } from "./drawing/figure.js";
import { KernelWalker } from "./drawing/in_kernel.js";
import { Player } from "./player.js";
import { SteerFigure } from "./steering/figure.js";
import { KernelSource } from "./steering/in_kernel.js";

const SHARED = ["playing", "speed", "follow", "overlay", "chosen"];
const SAVE_EVERY = 200; // milliseconds: while it plays the kernel hears of the frame five times a second

function hostIn(el) {
  const host = document.createElement("div");
  // JupyterLab has its own use for arrows and space; it looks for this mark from the focused element upwards.
  host.dataset.lmSuppressShortcuts = "";
  el.append(host);
  return host;
}

function caption(model) {
  const text = document.createElement("figcaption");
  text.textContent = model.get("caption");
  return text.textContent ? [text] : [];
}

function renderPlayer({ model, el }) {
  const host = hostIn(el);
  let player;
  let saved = 0;

  // Front-end links (jslink) listen to `set`; only `save_changes` goes to the kernel.
  const onFrame = ({ detail }) => {
    model.set("frame", detail.frame);
    if (player?.playing && performance.now() - saved < SAVE_EVERY) return;
    saved = performance.now();
    model.save_changes();
  };
  const onState = ({ detail }) => {
    model.set(detail.name, detail.value);
    model.set("frame", player.frame);
    model.save_changes();
  };

  const build = () => {
    player?.dispose();
    const reduced = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)").matches;
    host.replaceChildren();
    player = new Player(host, { ...model.get("payload"), autoplay: false });
    for (const name of SHARED) player.set(name, model.get(name));
    player.setFrame(model.get("frame"));
    if (reduced) player.pause();
    host.append(...caption(model));
    el.motionlab = host.motionlab = player;
  };
  build();
  host.addEventListener("motionlab:frame", onFrame);
  host.addEventListener("motionlab:state", onState);

  const onModel = {
    "change:payload": build,
    "change:frame": () => model.get("frame") !== player.frame && player.setFrame(model.get("frame")),
    ...Object.fromEntries(SHARED.map((name) => [`change:${name}`, () => player.set(name, model.get(name))])),
  };
  for (const [event, react] of Object.entries(onModel)) model.on(event, react);
  return () => {
    for (const [event, react] of Object.entries(onModel)) model.off(event, react);
    player.dispose();
  };
}

/** A figure whose other side is a kernel. */
function renderFigure({ model, el }, begin) {
  const host = hostIn(el);
  const figure = begin(host, model.get("content"));
  host.append(...caption(model));
  el.motionlab = host.motionlab = figure;
  return () => figure.dispose();
}

const FIGURES = {
  path: (model) => (host, content) => new PathFigure(host, content, null, new KernelWalker(model)),
  steer: (model) => (host, content) => new SteerFigure(host, content, null, new KernelSource(model)),
};

export default {
  render: (view) => {
    const begin = FIGURES[view.model.get("kind")]?.(view.model);
    return begin ? renderFigure(view, begin) : renderPlayer(view);
  },
};
