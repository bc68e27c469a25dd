// On paper nothing moves: there a motion is a strip of moments.
const MOMENTS = 6;
const WIDE = 0.62; // of a moment whose body stays in the middle, in its heights
const [TALL, PAPER] = [5, 22]; // centimetres of a row at most, and of all rows of a strip

/** Put a strip, which is seen in print alone, behind the picture of a player that holds one: a row for each view. */
export function addStrip(player) {
  if (!player.casts || player.bare || player.clock.frames < 2) return;
  const { clock, cells } = player;
  const { time } = clock;
  const middle = player.follow || cells.length === 1;
  const rows = cells.map((cell) => [named(cell.map((i) => player.tracks[i].label).filter(Boolean).join(" and "))]);
  const times = [named("")];
  for (let k = 0; k < MOMENTS; k += 1) {
    clock.seek(Math.round((k * (clock.frames - 1)) / (MOMENTS - 1)));
    player.draw();
    const now = `${(clock.frame / clock.fps).toFixed(2)} s`;
    player.views.forEach((view, i) => rows[i].push(moment(player, view, middle, `At ${now}`)));
    times.push(named(now));
  }
  clock.time = time;
  player.dirty = true;
  const strip = Object.assign(document.createElement("div"), { className: "ml-strip" });
  strip.style.setProperty("--ml-columns", MOMENTS);
  strip.style.setProperty("--ml-tall", `${Math.min(TALL, PAPER / rows.length).toFixed(1)}cm`);
  strip.append(...rows.flat(), ...times);
  player.view.after(strip);
}

export function removeStrip(player) {
  player.host.querySelector(".ml-strip")?.remove();
}

const named = (textContent) => Object.assign(document.createElement("span"), { textContent });

/** What is seen now in one of the views; `middle`: without what is left and right of the body. */
function moment({ canvas, view: { clientWidth } }, view, middle, alt) {
  const ratio = canvas.width / clientWidth;
  const seen = middle ? Math.min(view.width, WIDE * view.height) : view.width;
  const [width, height] = [seen * ratio, view.height * ratio].map(Math.round);
  const piece = Object.assign(document.createElement("canvas"), { width, height });
  const left = ratio * (view.x + (view.width - seen) / 2);
  piece.getContext("2d").drawImage(canvas, left, ratio * view.y, width, height, 0, 0, width, height);
  return Object.assign(new Image(), { src: piece.toDataURL(), alt });
}
