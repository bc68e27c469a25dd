// Runs web/src/network/ as a page would, for network_in_node.py: answers the questions in a JSON file.
import { readFileSync } from "node:fs";
import { smoothed } from "../../../web/src/drawing/shapes.js";
import { LockStream } from "../../../web/src/feet/lock_stream.js";
import { fromVector, toVector } from "../../../web/src/kinematics.js";
import { decode } from "../../../web/src/motion.js";
import { Linear } from "../../../web/src/network/affine.js";
import { Dreamer } from "../../../web/src/network/dreamer.js";
import { recently } from "../../../web/src/network/going.js";
import { guide, GuidedWalk, pickStart, Steering, wanted } from "../../../web/src/network/guided.js";
import { Lstm } from "../../../web/src/network/lstm.js";
import { LstmGmm } from "../../../web/src/network/lstm_gmm.js";
import { Random } from "../../../web/src/network/mixture.js";
import { Path } from "../../../web/src/network/path.js";
import { SimdLayer } from "../../../web/src/network/simd.js";
import { readLayers, readWeights } from "../../../web/src/network/weights.js";
import { Steered } from "../../../web/src/steering/steered.js";

const { scripts, look, ask } = JSON.parse(readFileSync(process.argv[2], "utf8"));
for (const script of scripts) new Function(readFileSync(script, "utf8"))();
const weights = (name) => readWeights(globalThis.motionlabWeights[name]);
/** Browsers that can't run simd.wat, and pages that mayn't. */
const refuse = (error) => () => { throw error; };
const without = {
  SIMD: () => { WebAssembly.validate = () => false; },
  WebAssembly: () => { delete globalThis.WebAssembly; },
  leave: () => { WebAssembly.Module = refuse(new WebAssembly.CompileError("the page's policy forbids it")); },
  room: () => { WebAssembly.Memory = refuse(new RangeError("could not allocate memory")); },
};
without[ask.without]?.();
const settings = { start: 0, temperature: 1, component_temperature: 1, memory: 0, noise: 0, characters: 1, seed: 0 };
const list = (values) => Array.from(values);
/** What may follow: a mixture, or a frame. */
const plain = (next) => (next.means ? { log_weights: list(next.logWeights), means: list(next.means), stds: list(next.stds) } : list(next));

const answers = {
  /** What may follow each of `rows` (frames, characters, dim), and the points it stands for. */
  steps({ name, starts, rows }) {
    const dreamer = new Dreamer(weights(name), look, { ...settings, characters: starts.length });
    starts.forEach((start, k) => { dreamer.settings.start = start; dreamer.enter(k); });
    const { characters, encoding } = dreamer;
    const next = [characters.map((character) => plain(character.next))];
    const points = [characters.map(({ track }) => list(track.room(0)))];
    const yaws = [characters.map(({ place }) => place.yaw)];
    for (const frame of rows) {
      characters.forEach((character, k) => {
        character.input = dreamer.normalize(frame[k]);
        character.place = encoding.walk(character.place, frame[k]);
      });
      next.push(dreamer.network.step(characters).map(plain));
      yaws.push(characters.map(({ place }) => place.yaw));
      points.push(characters.map(({ place }, k) => list(encoding.points(frame[k], place, new Float64Array(3 * encoding.count)))));
    }
    return { next, points, yaws };
  },

  /** What is said of weights of which one part, a path to text or list, is but half there; "" if nothing is. */
  halves({ name, parts }) {
    return parts.map((path) => {
      const file = structuredClone(globalThis.motionlabWeights[name]);
      const [last, ...rest] = [...path].reverse();
      const owner = rest.reverse().reduce((inner, key) => inner[key], file);
      owner[last] = owner[last].slice(0, 8 * Math.floor(owner[last].length / 16));
      try {
        readWeights(file);
        return "";
      } catch (error) {
        return error.message;
      }
    });
  },

  /** Points (frames, characters, ...) and contacts of the first character that a Dreamer makes. */
  dream({ name, frames, change, later = {} }) {
    const dreamer = new Dreamer(weights(name), look, { ...settings, ...change });
    const points = [], contacts = [], disturbed = [], noise = [];
    for (let frame = 0; frame <= frames; frame++) {
      Object.assign(dreamer.settings, later[frame]); // sliders that are moved
      if (frame) dreamer.advance();
      noise.push(list(dreamer.characters[0].noise));
      points.push(dreamer.tracks.map((track) => list(track.room(frame))));
      contacts.push(dreamer.tracks[0].at(frame).contacts);
      disturbed.push(list(dreamer.characters[0].input));
    }
    return { points, contacts, inputs: disturbed, noise };
  },

  /** What layers of networks say to inputs (a list a layer), when all networks are asked by turns. */
  layers({ networks, inputs }) {
    const read = networks.map((layers) => readLayers({ enter: layers, lstm: [], leave: layers[0] }).enter);
    const said = inputs.map((given, n) => given.map((some, i) => {
      const linear = new Linear(read[n][i]);
      return { said: linear.of(some.map((values) => Float32Array.from(values))).map(list), simd: linear.layer instanceof SimdLayer };
    }));
    return said;
  },

  /** What an LSTM's layer keeps and says, a state for each character, after every one of `inputs` (frames, characters). */
  lstm({ layer, inputs, states }) {
    const { enter } = readLayers({ enter: [layer], lstm: [], leave: layer });
    const lstm = new Lstm(enter[0], 0);
    const kept = states.map(({ hidden, cell }) => ({ hidden: [Float32Array.from(hidden)], cell: [Float32Array.from(cell)] }));
    return inputs.map((frame) => {
      lstm.step(frame.map((values) => Float32Array.from(values)), kept);
      return kept.map(({ hidden, cell }) => ({ hidden: list(hidden[0]), cell: list(cell[0]) }));
    });
  },

  /** Refined rows of `rows` (frames, characters, dim), the first of which are where characters begin. */
  refine({ name, rows }) {
    const { refiner } = new Dreamer(weights(name), look, settings);
    const memories = rows[0].map((row) => refiner.begin(row));
    return rows.map((frame) => refiner.refine(frame.map((row) => Float32Array.from(row)), memories).map(list));
  },

  /** How far apart simd.wat and plain JavaScript are after some frames from one seed, in normalised units. */
  apart({ name, frames, change }) {
    const dreams = [weights(name)];
    without.SIMD();
    dreams.push(weights(name));
    const [fast, plain] = dreams.map((read) => new Dreamer(read, look, { ...settings, ...change }));
    for (const dreamer of [fast, plain]) dreamer.reach(frames);
    const worst = fast.characters.map(({ input }, k) => Math.max(...input.map((value, i) => Math.abs(value - plain.characters[k].input[i]))));
    return { worst, simd: [fast, plain].map(({ network }) => network.leave.layer instanceof SimdLayer) };
  },

  /** A frame after one that was no number. */
  explosion({ name }) {
    const dreamer = new Dreamer(weights(name), look, settings);
    dreamer.characters[0].next.means.fill(NaN);
    for (let frame = 0; frame < 2; frame++) dreamer.advance();
    return { exploded: dreamer.exploded, points: list(dreamer.tracks[0].room(2)) };
  },

  /** A drawn line as a curve to walk: places, timetable, places at arcs, arcs near points, errors of roots. */
  path({ points, corner, speed, fastest, fps, arcs, near, root }) {
    const path = new Path(points, corner);
    return {
      drawn: path.drawn,
      places: path.places,
      crossings: path.crossings,
      table: path.timetable(speed, fastest, fps),
      at: arcs.map((arc) => path.at(arc)),
      nearest: near.map(({ point, first, last }) => path.nearest(point, first, last)),
      error: path.error(root, fps),
    };
  },

  /** Rows that guided sampling draws along a path with given noise (frames, characters, kept), and where they lead. */
  guided({ name, start, points, dues, place, arc, noise, change }) {
    const dreamer = new Dreamer(weights(name), look, { ...settings, ...change, start, characters: noise[0].length });
    const path = new Path(points);
    const steerings = dreamer.tracks.map((track) => new Steering(path, dreamer.fps, place, arc, [track.at(0).row]));
    const [rows, arcs] = [[], []];
    let last = arc;
    dues.forEach((due, t) => {
      dreamer.characters.forEach((character, k) => {
        const left = [...noise[t][k]];
        character.random = { uniform: () => 0.5, normal: () => left.shift() };
      });
      guide(dreamer, steerings, steerings.map((steering) => wanted(due, last, steering.arc, dreamer.fps)));
      last = due;
      rows.push(dreamer.tracks.map((track) => list(track.at(t + 1).row)));
      arcs.push(steerings.map((steering) => steering.arc));
    });
    return { rows, arcs, places: steerings.map(({ place: { x, z, yaw } }) => [x, z, yaw]) };
  },

  /** What a hand drew, as the line that was meant. */
  smoothed({ stroke }) {
    return smoothed(stroke);
  },

  /** A track that grew from pieces, and one that became another. */
  grown({ pieces, whole }) {
    const [[track], ...others] = pieces.map(decode);
    for (const [other] of others) track.extend(other);
    const told = ({ root, local, angles, contacts, way, count, extent }) => ({ root: list(root), local: list(local), angles: list(angles), contacts: list(contacts), way, count, extent });
    const grown = told(track);
    track.become(decode(whole)[0]);
    return { grown, become: told(track), whole: told(decode(whole)[0]) };
  },

  /**
   * What who is steered does: rows, places of what is shown and of what was drawn, the sample that was kept. Wishes by frames;
   * given noise (frames, samples, kept) and numbers from 0 to 1 (frames, samples), or a seed's own.
   */
  steered({ name, start, body, wishes, frames, noise, uniform, change = {}, futures = [null] }) {
    const cast = futures.map((count) => ({ label: "", futures: count }));
    const steered = new Steered(weights(name), look, body, { ...settings, memory: 0, push: 1, start, ...change }, cast);
    const said = futures.map(() => ({ rows: [], places: [], drawn: [], chosen: [], notes: [] }));
    for (let frame = 0; frame < frames; frame += 5) {
      const { points, ...wish } = wishes[frame] ?? {};
      if (wishes[frame]) steered.steer(points ? { ...wish, path: new Path(points) } : wish);
      if (noise) {
        const left = { noise: noise.slice(frame, frame + 5).flat(2), uniform: uniform.slice(frame, frame + 5).flat() };
        const at = { noise: 0, uniform: 0 };
        const next = (which) => left[which][at[which]++];
        steered.characters[0].random = { uniform: () => next("uniform"), normal: () => next("noise") };
      }
      const before = steered.last;
      while (steered.characters[0].frames < frame + 5) steered.work();
      steered.characters.forEach((character, k) => {
        const shown = Array.from({ length: steered.last - before }, (_, t) => steered.tracks[k].at(before + 1 + t)); // a lock waits
        const { x, z, yaw } = character.before.going.place;
        said[k].rows.push(...shown.map(({ row }) => list(row)));
        said[k].places.push(...shown.map(({ place }) => [place.x, place.z, place.yaw]));
        said[k].drawn.push([x, z, yaw]);
        if (shown.length) said[k].chosen.push(shown[0].chosen);
        said[k].notes = character.record.notes;
      });
    }
    return said;
  },

  /** Rows at places [x, z, yaw] with their feet held still, all of them, and how many came before the end. */
  locked({ name, known, rows, places }) {
    const { encoding, fps } = new Dreamer(weights(name), look, settings);
    const lock = new LockStream(encoding, fps, known);
    const done = rows.flatMap((row, t) => {
      const [x, z, yaw] = places[t];
      return lock.push({ row: Float64Array.from(row), place: { x, z, yaw } });
    });
    return { before: done.length, rows: [...done, ...lock.finish()].map(({ row }) => list(row)) };
  },

  /** Rotation vectors of the matrices of rotation vectors. */
  vectors({ vectors }) {
    return vectors.map((vector) => toVector(fromVector(...vector)));
  },

  recently({ rows, fps }) {
    return recently(rows, fps);
  },

  /** Whole walks along a line, one for each seed. */
  walks({ name, points, speed, seeds, change }) {
    return seeds.map((seed) => {
      const path = new Path(points);
      const read = weights(name);
      const start = pickStart(read.starts, speed, read.fps);
      const walk = new GuidedWalk(read, look, { ...settings, ...change, start, seed, speed }, path);
      walk.reach();
      const root = Array.from({ length: walk.frame + 1 }, (_, frame) => list(walk.track.at(frame).points.slice(0, 3)));
      const { arrived, fellApart, lost, frame } = walk;
      return { start, arrived, fellApart, lost, frame, root, error: path.error(root.map(([x, , z]) => [x, z]), read.fps) };
    });
  },

  /** Frames of one mixture, drawn one after the other, and the noise that the last one leaves. */
  draws({ mixture, count, change, noise = [] }) {
    const kept = mixture.means.length / mixture.logWeights.length;
    const character = { next: { ...mixture, kept }, random: new Random(7), noise };
    const drawn = Array.from({ length: count }, () => list(LstmGmm.prototype.draw(character, { ...settings, ...change })));
    return { drawn, noise: list(character.noise) };
  },

  chance({ seed, count }) {
    const [uniform, normal] = [new Random(seed), new Random(seed)];
    return { uniform: Array.from({ length: count }, () => uniform.uniform()), normal: Array.from({ length: count }, () => normal.normal()) };
  },

  /** A camera's place and the oldest frame after many frames. */
  follows({ name, frames }) {
    const dreamer = new Dreamer(weights(name), look, settings);
    const [track] = dreamer.tracks;
    dreamer.reach(frames);
    track.seek(0); // long gone: the oldest that is kept
    const { oldest, now, size } = track;
    const ways = [];
    for (let frame = oldest; frame <= frames; frame++) {
      track.seek(frame);
      ways.push({ root: list(track.point(0)), middle: track.place(frame) });
    }
    return { oldest, now, size, ways };
  },
};

process.stdout.write(JSON.stringify(answers[ask.what](ask)));
