// On paper nothing moves: there a motion is a strip of moments.
const MOMENTS = 6; // of one view; of several beside each other half as many, one below the other
const WIDE = 0.62; // of a moment of one view, in its heights

/** Put a strip, which is seen in print alone, behind the picture of a player that holds one. */
export function addStrip(player) {
  if (!player.casts || player.bare || player.clock.frames < 2) return;
  const { clock } = player;
  const [time, alone] = [clock.time, player.cells.length === 1];
  const count = alone ? MOMENTS : MOMENTS / 2;
  const strip = document.createElement("div");
  strip.className = "ml-strip";
  strip.style.setProperty("--ml-columns", alone ? count : 1);
  for (let k = 0; k < count; k += 1) {
    clock.seek(Math.round((k * (clock.frames - 1)) / (count - 1)));
    player.draw();
    strip.append(moment(player.canvas, alone, `${(clock.frame / clock.fps).toFixed(2)} s`));
  }
  clock.time = time;
  player.dirty = true;
  const names = player.cells.map((cell) => cell.map((i) => player.tracks[i].label).filter(Boolean).join(" and "));
  if (names.some(Boolean)) strip.prepend(Object.assign(document.createElement("p"), { textContent: names.join(" · ") }));
  player.view.after(strip);
}

export function removeStrip(player) {
  player.host.querySelector(".ml-strip")?.remove();
}

/** What a canvas shows now, with the time below it; alone: its middle. */
function moment(canvas, alone, time) {
  const { height } = canvas;
  const width = alone ? Math.min(canvas.width, Math.round(WIDE * height)) : canvas.width;
  const piece = Object.assign(document.createElement("canvas"), { width, height });
  piece.getContext("2d").drawImage(canvas, (canvas.width - width) / 2, 0, width, height, 0, 0, width, height);
  const figure = document.createElement("div");
  figure.append(Object.assign(new Image(), { src: piece.toDataURL(), alt: `At ${time}` }), time);
  return figure;
}
