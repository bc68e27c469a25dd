// A walk from an exported network, with onnxruntime-web alone, under Node or in a page. onnx_walk.py is the same.
//
//     motionlab export lstm-gmm-permissive --onnx
//     motionlab export refiner-permissive --onnx
//     npm install onnxruntime-web
//     node onnx_walk.mjs lstm-gmm-permissive.onnx walk.bvh --refiner refiner-permissive.onnx --seed 0
//
// Everything is y up, z ahead, x to the left, in metres and radians; the BVH is in centimetres.

/** What the bytes of a file say about the network. The runtime doesn't tell, so it is read here: field 14 of a
 *  protobuf message, pairs of a key (1) and a value (2). */
export function readAbout(bytes) {
  const pair = fields(fields(bytes, 14).find((each) => text(fields(each, 1)[0]) === "motionlab"), 2)[0];
  return JSON.parse(text(pair));
}

function fields(bytes, wanted) {
  const found = [];
  let at = 0;
  const number = () => {
    for (let value = 0, shift = 1; ; shift *= 128) {
      const byte = bytes[at++];
      value += (byte & 127) * shift;
      if (!(byte >= 128)) return value; // the end, too
    }
  };
  while (at < bytes.length) {
    const tag = number();
    if (tag % 8 === 0) number(); // the only other kind there is here
    else {
      const size = number();
      if (tag >> 3 === wanted) found.push(bytes.subarray(at, at + size));
      at += size;
    }
  }
  return found;
}

const text = (bytes) => new TextDecoder().decode(bytes);

/** What runs a network: from inputs by name, flat and of one character, to outputs by name. */
export async function opened(ort, bytes, about) {
  const session = await ort.InferenceSession.create(bytes);
  return async (inputs) => {
    const feeds = {};
    for (const [name, shape] of Object.entries(about.inputs))
      feeds[name] = new ort.Tensor("float32", Float32Array.from(inputs[name]), [1, ...shape]);
    const outputs = await session.run(feeds);
    return Object.fromEntries(Object.entries(outputs).map(([name, { data }]) => [name, data]));
  };
}

/** Chance that can be repeated, without end and between 0 and 1: the generator mulberry32. */
export function mulberry32(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let mixed = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return (((mixed ^ (mixed >>> 14)) >>> 0) + 0.5) / 2 ** 32;
  };
}

/** What each frame is drawn with: normal numbers for the pose, Gumbel's for the component. */
export function* chance({ inputs, sampling }, uniform = mulberry32(0)) {
  const many = (count, draw) => Array.from({ length: count }, draw);
  const log = () => Math.log(uniform()); // never of zero
  const normal = () => Math.sqrt(-2 * log()) * Math.cos(2 * Math.PI * uniform());
  const keep = sampling.memory;
  for (let noise; ; ) {
    const fresh = many(inputs.noise[0], normal);
    noise = noise ? fresh.map((value, i) => keep * noise[i] + Math.sqrt(1 - keep ** 2) * value) : fresh;
    const gumbel = many(inputs.gumbel[0], () => -Math.log(-log()));
    yield { noise: noise.map((value) => sampling.temperature * value), gumbel: gumbel.map((value) => sampling.component_temperature * value) };
  }
}

/** Rows of features, one after the other, as long as there is chance. */
export async function* frames(run, start, chance) {
  let state = { frame: start.frame, hidden: start.hidden.flat(), cell: start.cell.flat() };
  for (const drawn of chance) {
    const { features, frame_after: frame, hidden_after: hidden, cell_after: cell } = await run({ ...state, ...drawn });
    state = { frame, hidden, cell };
    yield features;
  }
}

/** The same rows, corrected: feet slide less. */
export async function* refined(run, about, rows) {
  const [, width] = about.inputs.hidden;
  let state = { hidden: new Float32Array(width), cell: new Float32Array(width) };
  let before;
  for await (const features of rows) {
    const { refined, hidden_after: hidden, cell_after: cell } = await run({ features, before: before ?? features, ...state });
    [state, before] = [{ hidden, cell }, features];
    yield refined;
  }
}

const product = (a, b) => Array.from({ length: 9 }, (_, i) => [0, 1, 2].reduce((sum, k) => sum + a[i - (i % 3) + k] * b[3 * k + (i % 3)], 0));

/** Matrix (9, row by row) of a rotation vector: the axis, as long as the angle. */
function turn(x, y, z) {
  const angle = Math.max(Math.hypot(x, y, z), 1e-9);
  const cross = [0, -z, y, z, 0, -x, -y, x, 0].map((value) => value / angle);
  const twice = product(cross, cross);
  return cross.map((value, i) => (i % 4 ? 0 : 1) + Math.sin(angle) * value + (1 - Math.cos(angle)) * twice[i]);
}

/** Of each row the root's place [x, y, z] and each joint's rotation (9 numbers) in its parent. */
export async function* poses({ encoding, features }, rows) {
  const [rest, [first, last]] = [encoding.mean_pose.map((matrix) => matrix.flat()), features.slices.pose];
  let [x, z, yaw, count] = [0, 0, 0, 0];
  for await (const row of rows) {
    const [left, ahead, turned, height, tiltX, tiltZ] = row;
    if (count++) { // the first frame has made no step
      const [sine, cosine] = [Math.sin(yaw), Math.cos(yaw)];
      x += left * cosine + ahead * sine;
      z += ahead * cosine - left * sine;
      yaw += turned;
    }
    const turns = [product(turn(0, yaw, 0), turn(tiltX, 0, tiltZ))];
    for (let at = first, joint = 1; at < last; at += 3, joint++) turns.push(product(rest[joint], turn(...row.subarray(at, at + 3))));
    yield { place: [x, height, z], turns };
  }
}

/** Lines of the skeleton as BVH has it; `order` gets the joints in the order in which they stand there. */
function hierarchy(skeleton, order, joint = 0, tab = "") {
  const cm = (offset) => offset.map((c) => (100 * c).toFixed(6)).join(" ");
  order.push(joint);
  const places = joint ? "3" : "6 Xposition Yposition Zposition";
  const lines = [`${tab}${joint ? "JOINT" : "ROOT"} ${skeleton.names[joint]}`, `${tab}{`, `${tab}\tOFFSET ${cm(skeleton.offsets[joint])}`, `${tab}\tCHANNELS ${places} Zrotation Xrotation Yrotation`];
  skeleton.parents.forEach((parent, child) => { if (parent === joint) lines.push(...hierarchy(skeleton, order, child, `${tab}\t`)); });
  skeleton.end_parents.forEach((parent, end) => {
    if (parent === joint) lines.push(`${tab}\tEnd Site`, `${tab}\t{`, `${tab}\t\tOFFSET ${cm(skeleton.end_offsets[end])}`, `${tab}\t}`);
  });
  return [...lines, `${tab}}`];
}

/** The text of a BVH file. */
export function bvh({ skeleton, fps }, poses) {
  const order = [];
  const lines = hierarchy(skeleton, order);
  const degrees = (angle) => (180 / Math.PI) * angle;
  const rows = poses.map(({ place, turns }) => {
    const angles = order.flatMap((joint) => {
      const r = turns[joint];
      return [Math.atan2(-r[1], r[4]), Math.asin(Math.min(Math.max(r[7], -1), 1)), Math.atan2(-r[6], r[8])].map(degrees);
    });
    return [...place.map((c) => 100 * c), ...angles].map((value) => value.toFixed(6)).join(" ");
  });
  return ["HIERARCHY", ...lines, "MOTION", `Frames: ${rows.length}`, `Frame Time: ${(1 / fps).toFixed(8)}`, ...rows, ""].join("\n");
}

const USAGE = "node onnx_walk.mjs NETWORK.onnx OUT.bvh [--refiner REFINER.onnx] [--seconds 10] [--start walk] [--seed 0]";

async function main(args) {
  const [{ existsSync, readFileSync, writeFileSync }, { dirname }, { parseArgs }] = await Promise.all(["fs", "path", "util"].map((name) => import(`node:${name}`)));
  const wrong = (said) => { throw new Error(said); };
  const instead = { refiner: "", seconds: "10", start: "walk", seed: "0" };
  const options = Object.fromEntries(Object.entries(instead).map(([name, value]) => [name, { type: "string", default: value }]));
  const { values: asked, positionals: [path, out] } = parseArgs({ args, options, allowPositionals: true });
  if (!out) wrong(USAGE);
  if (!existsSync(dirname(out))) wrong(`${out}: there is no such folder; make it.`);
  if (!/^\d{1,9}$/.test(asked.seed)) wrong(`--seed ${asked.seed}: must be a whole number.`);
  const told = (file, kind) => {
    if (!existsSync(file)) wrong(`${file}: there is no such file; motionlab export NAME --onnx makes one.`);
    let about;
    try { about = readAbout(readFileSync(file)); } catch { wrong(`${file}: is no file of motionlab export NAME --onnx.`); }
    return about.kind === kind ? about : wrong(`${file}: holds a network of kind ${about.kind}; ${kind} is wanted here.`);
  };
  const [about, its] = [told(path, "LstmGmm"), asked.refiner && told(asked.refiner, "Refiner")];
  if (its && JSON.stringify(its.features) !== JSON.stringify(about.features)) wrong(`${asked.refiner}: corrects frames of another kind than ${path}.`);
  const count = Math.round(Number(asked.seconds) * about.fps);
  if (!(count >= 1 && count < 1e6)) wrong(`--seconds ${asked.seconds}: must be a frame at least, 1/${about.fps}.`);
  const start = about.starts.find(({ name }) => name.startsWith(asked.start));
  if (!start) wrong(`--start ${asked.start}: there is none. There are ${about.starts.map(({ name }) => name).join("; ")}.`);
  const ort = await import("onnxruntime-web").catch(() => wrong("onnxruntime-web is not there: npm install onnxruntime-web"));
  const run = await opened(ort, readFileSync(path), about);
  let rows = frames(run, start, chance(about, mulberry32(Number(asked.seed))));
  if (its) rows = refined(await opened(ort, readFileSync(asked.refiner), its), its, rows);
  const made = [];
  for await (const pose of poses(about, rows)) if (made.push(pose) >= count) break;
  writeFileSync(out, bvh(about, made));
  const [x, , z] = made.at(-1).place;
  console.log(`${out}: ${made.length} frames from '${start.name}'; it ends ${z.toFixed(1)} m ahead, ${Math.abs(x).toFixed(1)} m to the ${x > 0 ? 'left' : 'right'}`);
}

if (globalThis.process?.argv[1]?.endsWith("onnx_walk.mjs")) await main(process.argv.slice(2)).catch(({ message }) => { console.error(message); process.exitCode = 1; });
