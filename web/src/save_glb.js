// A motion as a .glb file: skeleton, animation, and the player's figure as a mesh that the joints carry,
// as motionlab/io/gltf.py and gltf_mesh.py make it.
import {
  AnimationClip, Bone, BufferAttribute, Euler, MeshStandardMaterial, Quaternion, QuaternionKeyframeTrack, Scene, Skeleton,
  SkinnedMesh, Vector3, VectorKeyframeTrack,
} from "three";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import { Mannequin } from "./mannequin.js";
import { addExtras } from "./motion.js";

/** The file's bytes. `clip` as the track's `clip()` gives it; `name` is what the body and its animation are called. */
export async function toGlb(clip, track, name) {
  while (clip.skeleton.names.includes(name)) name += "Motion"; // assimp exports no animation that is called as a node is
  const turns = quaternions(clip);
  const points = nodes(clip.skeleton, bindPose(clip, turns));
  const scene = new Scene();
  scene.add(points[0]);
  scene.updateMatrixWorld();
  if (track.bones.length) scene.add(skinned(track, clip.skeleton, points, `${name}_body`));
  const times = keyTimes(clip);
  const moves = turns.map((values, joint) => new QuaternionKeyframeTrack(`${points[joint].uuid}.quaternion`, times, values));
  moves.unshift(new VectorKeyframeTrack(`${points[0].uuid}.position`, times, clip.root));
  return new GLTFExporter().parseAsync(scene, { binary: true, animations: [new AnimationClip(name, -1, moves)] });
}

/** A key at every frame, the last the least bit later: a player that begins anew at it would never show it. */
function keyTimes({ root, fps }) {
  const times = Float32Array.from({ length: root.length / 3 }, (_, frame) => frame / fps);
  if (times.length > 1) new Uint32Array(times.buffer)[times.length - 1] += 1; // the next number of 32 bits
  return times;
}

/** For each joint its quaternions, w last; of q and -q, which are the same turn, that nearer to the one before. */
function quaternions({ skeleton, angles }) {
  const count = skeleton.parents.length;
  const [turn, before, euler] = [new Quaternion(), new Quaternion(), new Euler()];
  return skeleton.orders.map((order, joint) => {
    const values = [];
    for (let at = 3 * joint; at < angles.length; at += 3 * count) {
      const about = (axis) => angles[at + order.indexOf(axis)];
      turn.setFromEuler(euler.set(about("X"), about("Y"), about("Z"), order));
      if (values.length && turn.dot(before) < 0) turn.set(-turn.x, -turn.y, -turn.z, -turn.w);
      values.push(...before.copy(turn).toArray());
    }
    return values;
  });
}

/**
 * The pose in which the figure is put on: the rest pose, where that is a standing person. Others may be
 * folded up, and a figure put on there would be torn: then it is the mean of the motion.
 */
function bindPose({ skeleton }, turns) {
  if (skeleton.stands) return turns.map(() => new Quaternion());
  return turns.map((values, joint) => {
    const sum = [0, 0, 0, 0];
    const last = joint === 0 ? 4 : values.length; // where a body faces may have no mean
    for (let i = 0; i < last; i++) sum[i % 4] += values[i];
    return new Quaternion(...sum).normalize();
  });
}

/** A node for every point, each below the joint it hangs on; an end site is a joint, too. */
function nodes({ names, parents, offsets, end_parents, end_offsets }, pose) {
  const joints = names.map((name, joint) => {
    const bone = node(new Bone(), name, joint ? offsets[joint] : [0, 0, 0]);
    bone.quaternion.copy(pose[joint]);
    return bone;
  });
  const ends = end_parents.map((parent, end) => node(new Bone(), `${names[parent]}End`, end_offsets[end]));
  const points = [...joints, ...ends];
  [...parents, ...end_parents].forEach((parent, point) => { if (parent >= 0) joints[parent].add(points[point]); });
  return points;
}

function node(object, name, position) {
  object.name = name;
  object.position.set(...position);
  return object;
}

/**
 * The figure as a mesh, put on in the pose in which the nodes are; lifts both onto the floor. It is made
 * as large as it is drawn.
 */
function skinned(track, skeleton, points, name) {
  const { magnified = 1 } = track;
  const places = new Float32Array(3 * (points.length + track.extras.length));
  points.forEach((point, i) => places.set(point.getWorldPosition(new Vector3()).multiplyScalar(magnified).toArray(), 3 * i));
  addExtras(places, points.length, track.extras);
  const place = (point) => places.subarray(3 * point, 3 * point + 3);
  const figure = new Mannequin({ bones: track.bones, color: track.color, seek() {}, point: place });
  figure.update();
  const { geometry } = figure;
  carry(geometry, track, skeleton, place);
  geometry.scale(1 / magnified, 1 / magnified, 1 / magnified);
  geometry.computeBoundingBox();
  const lift = -geometry.boundingBox.min.y;
  geometry.translate(0, lift, 0);
  points[0].position.y += lift;
  points[0].updateMatrixWorld();
  const mesh = new SkinnedMesh(geometry, new MeshStandardMaterial({ name, color: track.color, roughness: 0.55 }));
  mesh.name = name;
  mesh.bind(new Skeleton(points));
  return mesh;
}

/** Tell every vertex which joints carry it: a limb hangs on one, the trunk bends from one to the next. */
function carry(geometry, { bones, extras, middle }, skeleton, place) {
  const { position } = geometry.attributes;
  const ofBone = position.count / bones.length;
  const shares = sharesOf(skeleton, extras, middle);
  const points = skeleton.parents.length + skeleton.end_parents.length;
  const [carriers, weights] = [new Uint16Array(4 * position.count), new Float32Array(4 * position.count)];
  const vertex = new Vector3();
  bones.forEach(([a, b], bone) => {
    const rigid = a < skeleton.parents.length && shares[b].get(a) === 1;
    const [start, end] = [rigid ? shares[b] : shares[a], shares[b]];
    const origin = new Vector3(...place(a));
    const axis = new Vector3(...place(b)).sub(origin);
    const length = Math.max(axis.lengthSq(), 1e-12);
    const tip = b >= skeleton.parents.length && b < points ? b : null; // an end site carries a round end
    for (let i = bone * ofBone; i < (bone + 1) * ofBone; i++) {
      const along = Math.min(Math.max(vertex.fromBufferAttribute(position, i).sub(origin).dot(axis) / length, 0), 1);
      // no bone hangs on more than four joints: two for each of its ends
      [...blended(start, end, along)].filter(([, weight]) => weight > 0).forEach(([joint, weight], k) => {
        carriers[4 * i + k] = along === 1 && tip !== null ? tip : joint;
        weights[4 * i + k] = weight;
      });
    }
  });
  geometry.setAttribute("skinIndex", new BufferAttribute(carriers, 4));
  geometry.setAttribute("skinWeight", new BufferAttribute(weights, 4));
}

/** How much each joint has in carrying a point, {joint: share} for every point; see gltf_mesh.py. */
function sharesOf({ parents, end_parents }, extras, hips) {
  const above = [...parents, ...end_parents];
  const shares = above.map((parent) => new Map([[Math.max(parent, 0), 1]]));
  shares[hips] = new Map([[hips, 1]]); // what is above them, if anything, is no part of the body
  for (const [a, b, along] of extras) {
    if (along > 1 && b < parents.length) shares.push(new Map([[b, 1]]));
    else if (along > 1 || above[b] === a) shares.push(shares[b]);
    else shares.push(blended(shares[a], shares[b], along));
  }
  return shares;
}

function blended(from, to, mix) {
  const both = new Map([...from].map(([joint, share]) => [joint, (1 - mix) * share]));
  for (const [joint, share] of to) both.set(joint, (both.get(joint) ?? 0) + mix * share);
  return both;
}
