// The style sheet travels inside the script, so that a page needs one file only.
import css from "./player.css";

/** Put the style where `host` lives (the page, or a shadow root as some notebooks use). */
export function addStyle(host) {
  host.classList.add("ml-player");
  const root = host.getRootNode();
  const home = root instanceof ShadowRoot ? root : document.head;
  if (home.querySelector("style[data-motionlab]")) return;
  const style = document.createElement("style");
  style.dataset.motionlab = "";
  style.textContent = css;
  home.append(style);
}
