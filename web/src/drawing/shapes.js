// Lines to begin with, as places [x, z] in metres from where one stands, looking along z; x is to the left.

const STEP = 0.1; // m, about, from place to place

/** Places of a curve that is given for shares from 0 to 1 of it, some `length` metres long. */
function along(curve, length) {
  const count = Math.ceil(length / STEP);
  return Array.from({ length: count + 1 }, (_, i) => curve(i / count).map((metres) => Math.round(1000 * metres) / 1000));
}

const turn = (share) => 2 * Math.PI * share;

export const SHAPES = {
  Circle: () => along((share) => [1.8 - 1.8 * Math.cos(turn(share)), 1.8 * Math.sin(turn(share))], 11.3),
  Sine: () => along((share) => [0.9 * Math.sin(turn(1.5 * share)), 7 * share], 9),
  "Figure eight": () => along((share) => [1.5 * Math.sin(turn(2 * share)), 2.4 * Math.sin(turn(share))], 15),
  Square: () => [[0, 0], [0, 3], [3, 3], [3, 0], [0, 0]],
  Spiral: () => along((share) => {
    const [radius, angle] = [2.4 - 1.6 * share, turn(1.75 * share)];
    return [2.4 - radius * Math.cos(angle), radius * Math.sin(angle)];
  }, 17),
};

/**
 * A stroke of mouse or finger as the line that was meant: evenly spaced, without the tremble of a hand, which is
 * shorter than 40 cm. Its ends stay.
 */
export function smoothed(stroke, spacing = 0.05, reach = 4) {
  const fine = [stroke[0]];
  for (const point of stroke.slice(1)) {
    const [[x, z], [u, v]] = [fine.at(-1), point];
    const pieces = Math.floor(Math.hypot(u - x, v - z) / spacing);
    for (let i = 1; i <= pieces; i++) fine.push([x + ((u - x) * i) / pieces, z + ((v - z) * i) / pieces]);
  }
  const mean = fine.map((_, i) => {
    const half = Math.min(reach, i, fine.length - 1 - i);
    const some = fine.slice(i - half, i + half + 1);
    return [0, 1].map((axis) => some.reduce((sum, place) => sum + place[axis], 0) / some.length);
  });
  return mean.filter((_, i) => i % 2 === 0 || i === mean.length - 1).map((place) => place.map((metres) => Math.round(1000 * metres) / 1000));
}
