// A figure made of tapered capsules, kept in one mesh: its vertices are moved on the processor
// (some 5000 of them), which costs less than a draw call for every bone.
import { BackSide, BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, Mesh, MeshBasicMaterial, MeshStandardMaterial } from "three";
import { cross } from "./kinematics.js";

const SIDES = 16; // vertices around a bone
const CAP = 6; // rings of each round end
const RINGS = 2 * CAP;
const WHITE = new Color("#ffffff"); // a little of it: on a body in half shade a colour looks darker than on a chart

/** Angles of the rings from pole to pole: the cone touches both spheres at the same angle. */
function ringAngles(length, radiusA, radiusB) {
  const sine = Math.max(-0.9, Math.min(0.9, (radiusA - radiusB) / Math.max(length, 1e-3)));
  const tangent = Math.asin(sine);
  const angles = [];
  for (let i = 0; i < CAP; i++) angles.push(-Math.PI / 2 + ((tangent + Math.PI / 2) * i) / (CAP - 1));
  for (let i = 0; i < CAP; i++) angles.push(tangent + ((Math.PI / 2 - tangent) * i) / (CAP - 1));
  return angles;
}

function triangles(boneCount) {
  const index = [];
  for (let bone = 0; bone < boneCount; bone++) {
    for (let ring = 0; ring + 1 < RINGS; ring++) {
      for (let side = 0; side < SIDES; side++) {
        const a = (bone * RINGS + ring) * SIDES + side;
        const b = (bone * RINGS + ring) * SIDES + ((side + 1) % SIDES);
        index.push(a, b, a + SIDES, b, b + SIDES, a + SIDES);
      }
    }
  }
  return index;
}

/** Thin dark rim: lets an arm be told from the trunk behind it. */
function outlineMaterial() {
  const material = new MeshBasicMaterial({ side: BackSide, color: "#10141a", transparent: true, opacity: 0.6 });
  material.onBeforeCompile = (shader) => {
    // The body's back faces, a little larger; and farther away, so that bones which merge show no seam.
    shader.vertexShader = shader.vertexShader
      .replace("#include <begin_vertex>", "vec3 transformed = position + normal * 0.005;")
      .replace(
        "#include <project_vertex>",
        "#include <project_vertex>\nvec4 behind = projectionMatrix * (mvPosition - vec4(0.0, 0.0, 0.09, 0.0));\n" +
          "gl_Position.z = behind.z / behind.w * gl_Position.w;",
      );
  };
  return material;
}

export class Mannequin extends Group {
  constructor(track) {
    super();
    this.track = track;
    const vertices = track.bones.length * RINGS * SIDES;
    this.geometry = new BufferGeometry();
    for (const name of ["position", "normal"]) {
      const attribute = new BufferAttribute(new Float32Array(3 * vertices), 3);
      this.geometry.setAttribute(name, attribute.setUsage(DynamicDrawUsage));
    }
    this.geometry.setIndex(triangles(track.bones.length));
    this.material = new MeshStandardMaterial({ color: new Color(track.color).lerp(WHITE, 0.06), roughness: 0.55 });
    const body = new Mesh(this.geometry, this.material);
    body.castShadow = body.receiveShadow = true;
    this.outline = outlineMaterial();
    this.add(body, new Mesh(this.geometry, this.outline));
    for (const mesh of this.children) mesh.frustumCulled = false;

    track.seek(0);
    this.angles = track.bones.map(([a, b, radiusA, radiusB]) => {
      const p = track.point(a);
      const q = track.point(b);
      return ringAngles(Math.hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]), radiusA, radiusB);
    });
  }

  /** Put every vertex where the track's points are now. */
  update() {
    const { position, normal } = this.geometry.attributes;
    let at = 0;
    this.track.bones.forEach(([a, b, radiusA, radiusB], bone) => {
      const p = this.track.point(a);
      const q = this.track.point(b);
      const [along, across, third] = frameAlong(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
      for (let ring = 0; ring < RINGS; ring++) {
        const angle = this.angles[bone][ring];
        const centre = ring < CAP ? p : q;
        const radius = ring < CAP ? radiusA : radiusB;
        const lift = Math.sin(angle);
        const out = Math.cos(angle);
        for (let side = 0; side < SIDES; side++) {
          const c = out * COS[side];
          const s = out * SIN[side];
          for (let axis = 0; axis < 3; axis++, at++) {
            const n = lift * along[axis] + c * across[axis] + s * third[axis];
            normal.array[at] = n;
            position.array[at] = centre[axis] + radius * n;
          }
        }
      }
    });
    position.needsUpdate = normal.needsUpdate = true;
  }
}

const COS = Array.from({ length: SIDES }, (_, i) => Math.cos((2 * Math.PI * i) / SIDES));
const SIN = Array.from({ length: SIDES }, (_, i) => Math.sin((2 * Math.PI * i) / SIDES));

/** Right-handed frame whose first axis is the given direction. */
function frameAlong(x, y, z) {
  const length = Math.hypot(x, y, z) || 1;
  const along = length < 1e-9 ? [0, 1, 0] : [x / length, y / length, z / length];
  const helper = Math.abs(along[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0];
  let across = cross(helper, along);
  const size = Math.hypot(...across);
  across = across.map((value) => value / size);
  return [along, across, cross(along, across)];
}
