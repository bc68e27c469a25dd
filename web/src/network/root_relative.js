// Rows of motionlab/encodings/root_relative.py (absolute heights) as points in the world:
//   [dx height dz | every other point minus the root], world axes

export class RootRelative {
  /** `points` of a body; `metres` that a unit of a row stands for; `legs`, left and right upper leg. */
  constructor({ points, metres, legs }) {
    Object.assign(this, { count: points, metres, legs });
  }

  /** Where a row stands that nothing came before. */
  begin(row) {
    return { x: 0, z: 0, yaw: this.facing(row) };
  }

  /** Where the step of a row leads from a place {x, z}. */
  walk({ x, z }, row) {
    return { x: x + this.metres * row[0], z: z + this.metres * row[2], yaw: this.facing(row) };
  }

  /** Fill `points` (x y z each, joints first, then end sites) for a row at a place. */
  points(row, { x, z }, points) {
    const root = [x, this.metres * row[1], z];
    points.set(root);
    for (let i = 3; i < points.length; i++) points[i] = root[i % 3] + this.metres * row[i];
    return points;
  }

  /** No row knows what touches the ground. */
  touching() {
    return 0;
  }

  /** Yaw of a body whose left leg is to the left of its right one. */
  facing(row) {
    const [left, right] = this.legs.map((joint) => 3 * joint);
    return Math.atan2(row[right + 2] - row[left + 2], row[left] - row[right]);
  }
}
