// Rotation matrices (9 numbers, row by row), Euler angles as BVH files hold them, and where they put the
// points of a body. A skeleton is {names, parents, offsets, end_parents, end_offsets, orders}, metres.

const AXES = {}; // asked for at every joint of every frame

/** Axes of an order such as "ZXY" (R = Rz Rx Ry), and the sign of its angles; see motionlab/io/euler.py. */
function axes(order) {
  if (!(order in AXES)) {
    const [i, j, k] = Array.from(order, (letter) => "XYZ".indexOf(letter));
    AXES[order] = [i, j, k, (j - i + 3) % 3 === 1 ? 1 : -1];
  }
  return AXES[order];
}

/** Fill a matrix for angles in radians, as they stand in a file. */
export function fromEuler([first, second, third], order, matrix) {
  const [i, j, k, sign] = axes(order);
  const [a, b, c] = [Math.sin(sign * first), Math.sin(sign * second), Math.sin(sign * third)];
  const [u, v, w] = [Math.cos(first), Math.cos(second), Math.cos(third)];
  matrix[3 * i + i] = v * w;
  matrix[3 * i + j] = -v * c;
  matrix[3 * i + k] = b;
  matrix[3 * j + i] = u * c + a * b * w;
  matrix[3 * j + j] = u * w - a * b * c;
  matrix[3 * j + k] = -a * v;
  matrix[3 * k + i] = a * c - u * b * w;
  matrix[3 * k + j] = a * w + u * b * c;
  matrix[3 * k + k] = u * v;
  return matrix;
}

/** The angles of a matrix; where two axes coincide, the third makes up for the first. */
export function toEuler(matrix, order) {
  const [i, j, k, sign] = axes(order);
  const m = (row, column) => matrix[3 * row + column];
  const first = Math.atan2(-m(j, k), m(k, k));
  const second = Math.atan2(m(i, k), Math.hypot(m(i, i), m(i, j)));
  const [a, u] = [Math.sin(first), Math.cos(first)];
  const third = Math.atan2(u * m(j, i) + a * m(k, i), u * m(j, j) + a * m(k, j));
  return [sign * first, sign * second, sign * third];
}

/** The matrix of a rotation vector, by Rodrigues' formula. */
export function fromVector(x, y, z) {
  const angle = Math.hypot(x, y, z);
  // series near zero, where sin a / a and (1 - cos a) / a² would divide by nothing
  const s = angle < 1e-4 ? 1 - (angle * angle) / 6 : Math.sin(angle) / angle;
  const c = angle < 1e-4 ? 0.5 - (angle * angle) / 24 : (1 - Math.cos(angle)) / (angle * angle);
  return [
    1 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y,
    c * x * y + s * z, 1 - c * (x * x + z * z), c * y * z - s * x,
    c * x * z - s * y, c * y * z + s * x, 1 - c * (x * x + y * y),
  ];
}

/** The rotation vector of a matrix, at most half a turn long. */
export function toVector([a, b, c, d, e, f, g, h, i]) {
  const axis = [h - f, c - g, d - b]; // as long as twice the sine
  const sine = Math.hypot(...axis) / 2;
  const cosine = (a + e + i - 1) / 2;
  const angle = Math.atan2(sine, cosine);
  if (sine > 1e-8 || cosine > 0) return axis.map((value) => value * (sine > 1e-8 ? angle / (2 * sine) : 0.5));
  // half a turn: the matrix and one more are twice the axis by itself, whose longest column tells it best
  const columns = [[a + 1, d, g], [b, e + 1, h], [c, f, i + 1]];
  const best = columns[[a, e, i].indexOf(Math.max(a, e, i))];
  return best.map((value) => (Math.PI * value) / Math.hypot(...best));
}

export function product(a, b, result) {
  for (let row = 0; row < 9; row += 3) {
    for (let column = 0; column < 3; column++) {
      result[row + column] = a[row] * b[column] + a[row + 1] * b[3 + column] + a[row + 2] * b[6 + column];
    }
  }
  return result;
}

export const transposed = ([a, b, c, d, e, f, g, h, i]) => [a, d, g, b, e, h, c, f, i];

export const turned = (m, [x, y, z]) => [m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z];

export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** An empty matrix for every joint. */
export const matrices = ({ parents }) => parents.map(() => new Float64Array(9));

/**
 * Fill `points` (x y z each, joints first, then end sites) and `turns`, which bring a joint's frame to
 * the world, for a root at a place and local rotations.
 */
export function place({ parents, offsets, end_parents, end_offsets }, root, locals, turns, points) {
  turns[0].set(locals[0]);
  points.set(root);
  for (let joint = 1; joint < parents.length; joint++) {
    hang(turns[parents[joint]], offsets[joint], points, parents[joint], joint);
    product(turns[parents[joint]], locals[joint], turns[joint]);
  }
  end_parents.forEach((joint, end) => hang(turns[joint], end_offsets[end], points, joint, parents.length + end));
  return points;
}

/** A point at an offset in a joint's frame. */
function hang(turn, [x, y, z], points, joint, point) {
  for (let axis = 0; axis < 3; axis++) {
    points[3 * point + axis] = points[3 * joint + axis] + turn[3 * axis] * x + turn[3 * axis + 1] * y + turn[3 * axis + 2] * z;
  }
}
