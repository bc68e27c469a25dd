// One loop moves all players that can be seen; before a page is printed, all show strips of themselves.
import { addStrip, removeStrip } from "./print.js";

const turning = new Set();
const waiting = new Set(); // players out of sight, which hold no picture
let last = null;

/** Whether somebody sees the player; who is looked at gets `tick(seconds)`, picture after picture. */
export function attend(player, seen) {
  (seen ? turning : waiting).add(player);
  (seen ? waiting : turning).delete(player);
  if (turning.size && last === null) {
    last = performance.now();
    requestAnimationFrame(turn);
  }
}

export function forget(player) {
  turning.delete(player);
  waiting.delete(player);
}

/** How many of those that are seen play a motion that is being made. */
export const making = () => [...turning].filter((player) => player.dreamer && player.playing).length;

function turn(now) {
  // A frame's time stamp may lie before the call that asked for it; after a long pause don't leap.
  const seconds = Math.min(Math.max((now - last) / 1000, 0), 0.25);
  last = now;
  for (const player of turning) player.tick(seconds);
  if (turning.size) requestAnimationFrame(turn);
  else last = null;
}

globalThis.addEventListener?.("beforeprint", () => {
  for (const player of waiting) player.enter();
  for (const player of [...turning, ...waiting]) addStrip(player);
});
globalThis.addEventListener?.("afterprint", () => {
  for (const player of [...turning, ...waiting]) removeStrip(player);
  for (const player of waiting) player.leave();
});
