// Rows of motionlab/encodings/joint_angles.py (rotation vectors) as points in the world:
//   [dx dz dyaw | height tilt_x tilt_z | rotation vector of every joint but the root | toe contacts]

const ROOT = 6;

export class JointAngles {
  /** parents, offsets, end_parents, end_offsets, mean_pose (rows of 9) and contacts, as Python says. */
  constructor({ parents, offsets, end_parents, end_offsets, mean_pose, contacts }) {
    Object.assign(this, { parents, offsets, endParents: end_parents, endOffsets: end_offsets, meanPose: mean_pose });
    this.contacts = contacts ? ROOT + 3 * (parents.length - 1) : null;
    this.turns = parents.map(() => new Float64Array(9)); // joint frame to world
    this.count = parents.length + end_parents.length;
  }

  /** Where a row stands that nothing came before. */
  begin() {
    return { x: 0, z: 0, yaw: 0 };
  }

  /** Where a step of a row leads from a place {x, z, yaw}; the step is seen from there (eq. 4). */
  walk({ x, z, yaw }, [left, ahead, turn]) {
    const [sine, cosine] = [Math.sin(yaw), Math.cos(yaw)];
    return { x: x + left * cosine + ahead * sine, z: z + ahead * cosine - left * sine, yaw: (yaw + turn) % (2 * Math.PI) };
  }

  /** Fill `points` (x y z each, joints first, then end sites) for a row at a place. */
  points(row, { x, z, yaw }, points) {
    const [sine, cosine] = [Math.sin(yaw), Math.cos(yaw)];
    const tilt = fromVector(row[4], 0, row[5]);
    product([cosine, 0, sine, 0, 1, 0, -sine, 0, cosine], tilt, this.turns[0]);
    points.set([x, row[3], z]);
    for (let joint = 1; joint < this.parents.length; joint++) {
      const parent = this.parents[joint];
      const at = ROOT + 3 * (joint - 1);
      hang(this.turns[parent], this.offsets[joint], points, parent, joint);
      const local = product(this.meanPose[joint], fromVector(row[at], row[at + 1], row[at + 2]), new Float64Array(9));
      product(this.turns[parent], local, this.turns[joint]);
    }
    this.endParents.forEach((parent, end) => hang(this.turns[parent], this.endOffsets[end], points, parent, this.parents.length + end));
    return points;
  }

  /** Bits of the player's left heel, left toe, right heel, right toe; a row knows of toes only. */
  touching(row) {
    if (this.contacts === null) return 0;
    return (row[this.contacts] > 0.5 ? 2 : 0) | (row[this.contacts + 1] > 0.5 ? 8 : 0);
  }
}

/** A point at an offset in a joint's frame. */
function hang(turn, [x, y, z], points, joint, point) {
  for (let axis = 0; axis < 3; axis++) {
    points[3 * point + axis] = points[3 * joint + axis] + turn[3 * axis] * x + turn[3 * axis + 1] * y + turn[3 * axis + 2] * z;
  }
}

/** Rotation matrix (9 numbers, row by row) of a rotation vector, by Rodrigues' formula. */
function fromVector(x, y, z) {
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

function product(a, b, result) {
  for (let row = 0; row < 9; row += 3) {
    for (let column = 0; column < 3; column++) {
      result[row + column] = a[row] * b[column] + a[row + 1] * b[3 + column] + a[row + 2] * b[6 + column];
    }
  }
  return result;
}
