// One leg in one frame: motionlab/feet/one_leg.py. Vectors are [x, y, z] in metres, matrices nine numbers, row by row.

const [BACKWARDS, STRAIGHT] = [0.07, 0.02]; // metres, as of motionlab/feet/lock.py: how far a knee's side is trusted
const [REACH, NEAR] = [0.97, 0.04]; // share of its length that a leg is stretched to; metres that it may go without
const TIP = 0.003; // metres that the tip of the toes stays above the floor

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const norm = (a) => Math.sqrt(dot(a, a));
export const times = (share, a) => [share * a[0], share * a[1], share * a[2]];
export const apart = (a, b) => Math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2);
/** a + share b. */
export const plus = (a, share, b) => [a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]];
/** One long; zero stays zero. */
const unit = (a) => times(1 / (norm(a) || 1e-12), a);
export const clamp = (value, least, most) => Math.min(Math.max(value, least), most);

/** Where a knee is, seen from the hip, once its ankle is at `reach`. */
export function knee(kneeWas, shinWas, reach, forward) {
  const [thigh, shank, distance] = [norm(kneeWas), norm(shinWas), Math.max(norm(reach), 1e-9)];
  const along = clamp((thigh * thigh + distance * distance - shank * shank) / (2 * distance), -thigh, thigh);
  const beside = Math.sqrt(Math.max(thigh * thigh - along * along, 0));
  const [lineWas, line] = [unit(plus(kneeWas, 1, shinWas)), unit(reach)];
  let aside = plus(kneeWas, -dot(kneeWas, lineWas), lineWas);
  // the smallest turn of the line, of what is at right angles to it
  const middle = unit(plus(lineWas, 1, line));
  aside = plus(aside, -2 * dot(middle, aside), middle);
  const out = norm(aside);
  const front = unit(plus(forward, -dot(forward, line), line));
  const trusted = dot(aside, front) < 0 ? BACKWARDS : STRAIGHT;
  const share = clamp(2 - out / trusted, 0, 1);
  const way = unit(plus(aside, share * 3 * Math.max(beside - out, 1e-7), front));
  return plus(times(along, line), beside, way);
}

/** The smallest rotation that turns one direction into another. */
export function turn(start, end) {
  const s = unit(start);
  const m = unit(plus(s, 1, unit(end)));
  const a = plus(times(4 * dot(m, s), s), -2, m);
  return [0, 1, 2].flatMap((row) => [0, 1, 2].map((column) => m[row] * a[column] - 2 * s[row] * s[column] + (row === column)));
}

/** Metres that a hip must come down for its ankle to go where it shall; `longest`: of the leg when it is stretched. */
export function needed(hip, ankle, shift, longest) {
  const [x, y, z] = plus(plus(hip, -1, ankle), -1, shift);
  let reach = REACH * longest;
  if (x * x + y * y + z * z <= reach * reach) return 0;
  reach = Math.max(reach, Math.min(apart(hip, ankle), longest) - Math.max(norm(shift) - NEAR, 0));
  const down = y - Math.sqrt(Math.max(reach * reach - x * x - z * z, 1e-4));
  return down > 1e-4 ? down : 0;
}

/** The turn that lifts toes' tip out of the floor, null if it is not in it; `height`: of the toe joint above the floor. */
export function toesUp(tip, height) {
  const long = norm(tip);
  const least = Math.min(Math.max(TIP - height, -long), 0);
  if (long < TIP || tip[1] >= least) return null;
  const level = Math.sqrt(long * long - least * least) / Math.max(Math.hypot(tip[0], tip[2]), 1e-6 * long);
  return turn(tip, [tip[0] * level, least, tip[2] * level]);
}
