// Rows of motionlab/encodings/joint_angles.py (rotation vectors) as points in the world:
//   [dx dz dyaw | height tilt_x tilt_z | rotation vector of every joint but the root | toe contacts]
import { fromVector, matrices, place, product, toVector, transposed } from "../kinematics.js";

const ROOT = 6;

export class JointAngles {
  /** `body`: parents, offsets, end_parents, end_offsets, mean_pose (rows of 9) and contacts, as Python says. */
  constructor(body) {
    this.body = body;
    this.contacts = body.contacts ? ROOT + 3 * (body.parents.length - 1) : null;
    this.locals = matrices(body); // of the row whose points were asked for last
    this.turns = matrices(body);
    this.count = body.parents.length + body.end_parents.length;
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
    const { body, locals, turns } = this;
    const [sine, cosine] = [Math.sin(yaw), Math.cos(yaw)];
    product([cosine, 0, sine, 0, 1, 0, -sine, 0, cosine], fromVector(row[4], 0, row[5]), locals[0]);
    for (let joint = 1; joint < locals.length; joint++) {
      const at = this.columnOf(joint);
      product(body.mean_pose[joint], fromVector(row[at], row[at + 1], row[at + 2]), locals[joint]);
    }
    return place(body, [x, row[3], z], locals, turns, points);
  }

  /** Where a row's rotation vector of a joint that is not the root begins. */
  columnOf(joint) {
    return ROOT + 3 * (joint - 1);
  }

  /** The rotation vector that stands in a row for a joint's local rotation. */
  numbersOf(joint, local) {
    return toVector(product(transposed(this.body.mean_pose[joint]), local, new Float64Array(9)));
  }

  /** Bits of the player's left heel, left toe, right heel, right toe; a row knows of toes only. */
  touching(row) {
    if (this.contacts === null) return 0;
    return (row[this.contacts] > 0.5 ? 2 : 0) | (row[this.contacts + 1] > 0.5 ? 8 : 0);
  }
}
