// Runs web/src/network/ as a page would, for test_dream.py: answers the questions in a JSON file.
import { readFileSync } from "node:fs";
import { Dreamer } from "../../../web/src/network/dreamer.js";
import { LstmGmm } from "../../../web/src/network/lstm_gmm.js";
import { Random } from "../../../web/src/network/mixture.js";
import { readWeights } from "../../../web/src/network/weights.js";

const { scripts, look, ask } = JSON.parse(readFileSync(process.argv[2], "utf8"));
for (const script of scripts) new Function(readFileSync(script, "utf8"))();
const weights = (name) => readWeights(globalThis.motionlabWeights[name]);
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

  /** A frame after one that was no number. */
  explosion({ name }) {
    const dreamer = new Dreamer(weights(name), look, settings);
    dreamer.characters[0].next.means.fill(NaN);
    for (let frame = 0; frame < 2; frame++) dreamer.advance();
    return { exploded: dreamer.exploded, points: list(dreamer.tracks[0].room(2)) };
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
