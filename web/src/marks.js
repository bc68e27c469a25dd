// What is drawn beside the body: contact dots, trails behind points, paths on the ground.
import { CircleGeometry, Group, Mesh, MeshBasicMaterial, SphereGeometry } from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";

const CONTACT = "#ff5a36";
const TAIL = 90; // frames

function line(positions, color, pixels) {
  const geometry = new LineGeometry();
  geometry.setPositions(positions);
  const material = new LineMaterial({ color, linewidth: pixels, transparent: true, depthWrite: false });
  const made = new Line2(geometry, material);
  made.frustumCulled = false;
  return made;
}

/** A dot on the foot and a disc on the floor for every point that touches the ground. */
export class Contacts extends Group {
  constructor(track, floor) {
    super();
    this.track = track;
    this.floor = floor;
    const paint = new MeshBasicMaterial({ color: CONTACT });
    const glow = new MeshBasicMaterial({ color: CONTACT, transparent: true, opacity: 0.35, depthWrite: false });
    const disc = new CircleGeometry(0.085, 24).rotateX(-Math.PI / 2);
    const dot = new SphereGeometry(0.043, 16, 12);
    for (const point of track.contactPoints) {
      const mark = new Group();
      mark.point = point;
      mark.add(new Mesh(dot, paint), new Mesh(disc, glow));
      mark.children[1].renderOrder = -1;
      this.add(mark);
    }
  }

  update() {
    const touching = this.track.touching();
    for (const mark of this.children) {
      mark.visible = touching.includes(mark.point);
      const [x, y, z] = this.track.point(mark.point);
      mark.children[0].position.set(x, y, z);
      mark.children[1].position.set(x, this.floor + 0.003, z);
    }
  }
}

/** The course of a point up to now. */
export class Trail extends Group {
  constructor(track, point) {
    super();
    this.track = track;
    const course = track.course(point);
    if (course.length < 6) return;
    this.line = line(course, track.color, 3);
    this.add(this.line);
  }

  update() {
    if (this.line) this.line.geometry.instanceCount = this.track.now;
  }
}

/** The last seconds of a point of a motion that is still being made. */
export class Tail extends Group {
  constructor(track, point) {
    super();
    Object.assign(this, { track, point, places: new Float32Array(3 * TAIL) });
    this.line = line(this.places, track.color, 3);
    this.add(this.line);
  }

  update() {
    this.track.tail(this.point, this.places);
    // a Line2 keeps both ends of every piece, one piece after the other
    const ends = this.line.geometry.attributes.instanceStart.data;
    for (let piece = 0; piece + 1 < TAIL; piece++) ends.array.set(this.places.subarray(3 * piece, 3 * piece + 6), 6 * piece);
    ends.needsUpdate = true;
  }
}

/** A given path [[x, z], ...] on the ground. */
export class Path extends Group {
  constructor({ points, color }, floor) {
    super();
    if (points.length < 2) return;
    const onFloor = line(points.flatMap(([x, z]) => [x, floor + 0.004, z]), color, 5);
    onFloor.renderOrder = -1;
    this.add(onFloor);
  }

  update() {}
}

export function disposeAll(group) {
  group.traverse((part) => {
    part.geometry?.dispose();
    part.material?.dispose();
  });
}
