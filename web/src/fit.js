// Rotations of a motion that has points only, such as what a network of points says. Points show where
// bones lie, not how they are twisted: each joint turns as little as it must from how it is on average.
import { cross, fromVector, matrices, place, product, toEuler, transposed, turned } from "./kinematics.js";

const ROUNDS = 50;
const NEAR = 0.1; // radians
const ENOUGH = 1e-9; // torque, of the greatest there can be
const SOFT = 1e-3; // stiffness, of the greatest, that every axis has
const NONE = [1, 0, 0, 0, 1, 0, 0, 0, 1];

/**
 * {root, angles} as a file holds them: places of the root (frames, 3) in metres, Euler angles (frames,
 * joints, 3) in radians. `frames`: points (x y z each) of every frame; only those `known` are looked at.
 * Bones keep the skeleton's lengths, and the point `middle` is where it was.
 */
export function fitted(skeleton, frames, known, middle) {
  const { parents, end_parents, offsets, end_offsets, orders } = skeleton;
  const every = [...offsets, ...end_offsets];
  const above = [...parents, ...end_parents];
  const turns = []; // of each joint, in every frame
  const locals = [];
  parents.forEach((parent, joint) => {
    const seen = above.flatMap((other, point) => (other === joint && known.has(joint) && known.has(point) ? [point] : []));
    const before = parent < 0 ? frames.map(() => NONE) : turns[parent];
    const ways = frames.map((points, frame) => seen.map((point) => turned(transposed(before[frame]), between(points, joint, point))));
    const sums = seen.map((_, k) => ways.reduce((sum, way) => sum.map((value, axis) => value + way[k][axis]), [0, 0, 0]));
    const usual = nearest(NONE, seen.map((point, k) => [every[point], sums[k]]));
    locals[joint] = ways.map((way) => nearest(usual, seen.map((point, k) => [every[point], way[k]])));
    turns[joint] = locals[joint].map((local, frame) => product(before[frame], local, []));
  });
  const [now, scratch] = [new Float64Array(3 * above.length), matrices(skeleton)];
  const root = frames.flatMap((points, frame) => {
    place(skeleton, [0, 0, 0], locals.map((local) => local[frame]), scratch, now);
    return [0, 1, 2].map((axis) => points[3 * middle + axis] - now[3 * middle + axis]);
  });
  const angles = frames.flatMap((_, frame) => locals.flatMap((local, joint) => toEuler(local[frame], orders[joint])));
  return { root, angles };
}

const between = (points, a, b) => [0, 1, 2].map((axis) => points[3 * b + axis] - points[3 * a + axis]);

/**
 * The rotation near `turn` that best lays offsets along ways; long bones count more. Far from it, a turn
 * about the torque of all bones (Müller et al. 2016); near it the step of Gauss and Newton, as bones in
 * nearly one line hardly show how they are turned about it.
 */
function nearest(turn, pairs) {
  const springs = pairs.map(([offset, way]) => [offset, scaled(way, length(offset) / Math.max(length(way), 1e-9))]);
  for (let round = 0; round < ROUNDS; round++) {
    const stiff = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]; // how fast the torque fades as one turns
    const torque = [0, 0, 0];
    let [pull, most] = [0, 1e-12];
    for (const [offset, way] of springs) {
      const now = turned(turn, offset);
      const size = dot(now, now);
      pull += dot(now, way);
      most += size;
      cross(now, way).forEach((part, axis) => { torque[axis] += part; });
      stiff.forEach((row, i) => row.forEach((_, j) => { row[j] += (i === j) * size - now[i] * now[j]; }));
    }
    stiff.forEach((row, axis) => { row[axis] += SOFT * most; }); // one bone alone leaves its twist open
    const size = length(torque);
    if (size < ENOUGH * most && pull >= 0) break;
    const angle = Math.atan2(size, pull);
    // turned half around, nothing says about which axis: any that is not along the bone
    const far = size > 1e-6 * most ? scaled(torque, angle / size) : [1, 0.8, 0.6];
    turn = product(fromVector(...(angle < NEAR ? solved(stiff, torque) : far)), turn, []);
  }
  return turn;
}

const scaled = (vector, factor) => vector.map((value) => factor * value);
const length = (vector) => Math.hypot(...vector);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** x of a symmetric matrix times x = b. */
function solved([p, q, r], b) {
  const volume = dot(p, cross(q, r));
  return [cross(q, r), cross(r, p), cross(p, q)].map((column) => dot(column, b) / volume);
}
