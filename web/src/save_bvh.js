// A motion as the text of a BVH file, line for line as motionlab/io/bvh.py writes it.

const CENTIMETRES = 100; // in a metre: what most programs take a BVH file to be in

/** `clip` as a track's `clip()` gives it. */
export function toBvh({ skeleton, fps, root, angles }) {
  const { parents, offsets, end_parents, end_offsets, orders } = skeleton;
  const names = withoutBlanks(skeleton.names);
  const lines = ["HIERARCHY"];
  const nested = []; // joints in the order in which their angles follow in a row
  const write = (joint, depth) => {
    const tabs = "\t".repeat(depth);
    const isRoot = joint === 0;
    nested.push(joint);
    lines.push(`${tabs}${isRoot ? "ROOT" : "JOINT"} ${names[joint]}`, `${tabs}{`);
    // some programs add a root's offset to its positions, others replace it
    lines.push(`${tabs}\tOFFSET ${inRow(isRoot ? [0, 0, 0] : offsets[joint], CENTIMETRES)}`);
    const turns = Array.from(orders[joint], (axis) => `${axis}rotation`).join(" ");
    lines.push(`${tabs}\tCHANNELS ${isRoot ? "6 Xposition Yposition Zposition" : "3"} ${turns}`);
    end_parents.forEach((parent, end) => {
      if (parent !== joint) return;
      lines.push(`${tabs}\tEnd Site`, `${tabs}\t{`, `${tabs}\t\tOFFSET ${inRow(end_offsets[end], CENTIMETRES)}`, `${tabs}\t}`);
    });
    parents.forEach((parent, child) => { if (parent === joint) write(child, depth + 1); });
    lines.push(`${tabs}}`);
  };
  write(0, 0);
  const frames = root.length / 3;
  lines.push("MOTION", `Frames: ${frames}`, `Frame Time: ${Number((1 / fps).toPrecision(10))}`);
  const width = 3 * parents.length;
  for (let frame = 0; frame < frames; frame++) {
    const turns = nested.flatMap((joint) => angles.slice(frame * width + 3 * joint, frame * width + 3 * joint + 3));
    lines.push(`${inRow(root.slice(3 * frame, 3 * frame + 3), CENTIMETRES)} ${inRow(turns, 180 / Math.PI)}`);
  }
  return `${lines.join("\n")}\n`;
}

const inRow = (numbers, scale) => numbers.map((number) => (number * scale).toFixed(6)).join(" ");

/** Names can't hold blanks or braces there; two that become one are told apart by a number. */
function withoutBlanks(names) {
  const taken = new Set();
  return names.map((name, joint) => {
    const word = name.replace(/[\s{}]+/g, "_");
    const free = taken.has(word) ? `${word}_${joint}` : word;
    taken.add(free);
    return free;
  });
}
