// Two arrows on the ground around who is steered: which way and how fast he is asked to go, and goes.
import { BufferGeometry, Float32BufferAttribute, Group, Mesh, MeshBasicMaterial } from "three";
import { STILL } from "./aim.js";

export const ASKED = "#755e86";
const [NEAR, A_SPEED] = [0.32, 0.42]; // metres from the middle, and more for a m/s
const [WIDE, HEAD] = [0.05, 0.13]; // metres, half a shaft and half a head
const [ASKED_HEIGHT, DONE_HEIGHT] = [0.004, 0.007]; // metres above the floor, so that they don't fight

/** An arrow along z of a length of one metre: a shaft of two triangles, and a head. */
function arrow(color, width) {
  const [w, h] = [width * WIDE, width * HEAD];
  const corners = [[w, 0], [-w, 0], [w, 0.8], [w, 0.8], [-w, 0], [-w, 0.8], [h, 0.8], [-h, 0.8], [0, 1]];
  const flat = new BufferGeometry();
  flat.setAttribute("position", new Float32BufferAttribute(corners.flatMap(([x, z]) => [x, 0, z]), 3));
  // seen from above; of one side only, for which contacts have a shader already
  const paint = new MeshBasicMaterial({ color, transparent: true, opacity: 0.9, depthWrite: false });
  const mesh = new Mesh(flat, paint);
  mesh.renderOrder = -1;
  return mesh;
}

export class Arrows extends Group {
  constructor(track, floor) {
    super();
    Object.assign(this, { track, floor, asked: arrow(ASKED, 1.6), done: arrow(track.color, 0.8) });
    this.add(this.asked, this.done);
  }

  update() {
    const { asked, pace, bearing, place: { x, z } } = this.track.at(this.track.now);
    this.lay(this.asked, asked.speed, asked.direction, x, z, ASKED_HEIGHT);
    this.lay(this.done, pace, bearing, x, z, DONE_HEIGHT);
  }

  lay(arrow, speed, way, x, z, height) {
    arrow.visible = speed >= STILL && Number.isFinite(way);
    arrow.position.set(x + NEAR * Math.sin(way), this.floor + height, z + NEAR * Math.cos(way));
    arrow.rotation.y = way;
    arrow.scale.set(1, 1, Math.max(A_SPEED * speed, 0.15));
  }
}
