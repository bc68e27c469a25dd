// Lets a network go on from a start, each frame fed back to get the next, for several characters at
// once. Settings act on the next frame.
import { AcLstm } from "./aclstm.js";
import { JointAngles } from "./joint_angles.js";
import { LiveTrack } from "./live_track.js";
import { LstmGmm } from "./lstm_gmm.js";
import { Random } from "./mixture.js";
import { Refiner } from "./refiner.js";
import { RootRelative } from "./root_relative.js";
import { normalizing } from "./rows.js";

const NETWORKS = { AcLstm, LstmGmm };
const ENCODINGS = { JointAngles, RootRelative };

export class Dreamer {
  /**
   * `weights` from weights.js; `look` says how the tracks look (bones, extras, color, ...);
   * `settings`: start, seed, characters, noise, refined if there is a refiner, and what the network's `draw` takes.
   */
  constructor(weights, look, settings) {
    this.network = new NETWORKS[weights.kind](weights.layers, weights.settings);
    this.encoding = new ENCODINGS[weights.encoding.kind](weights.encoding);
    this.normalizer = weights.normalizer;
    Object.assign(this, normalizing(weights.normalizer));
    this.refiner = weights.refiner && new Refiner(weights.refiner, this.encoding, this);
    this.starts = weights.starts;
    this.fps = weights.fps;
    this.look = look;
    this.settings = { ...settings };
    this.tracks = []; // the same array always: the player keeps it
    this.restart();
  }

  /** Begin anew; the same settings give the same motion. */
  restart() {
    this.last = 0; // the newest frame
    this.exploded = 0; // times that a character had to begin again
    this.characters = [];
    this.tracks.length = 0;
    this.populate();
  }

  /** As many characters as the settings say; newcomers begin at the start. */
  populate() {
    const count = this.settings.characters;
    this.characters.length = Math.min(this.characters.length, count);
    this.tracks.length = this.characters.length;
    while (this.characters.length < count) this.enter(this.characters.length);
  }

  enter(number) {
    const start = this.starts[this.settings.start];
    const layers = (numbers) => this.network.lstm.map(({ width, depth }) => numbers.slice(depth * width, (depth + 1) * width));
    const character = {
      input: this.normalize(start.frame),
      hidden: layers(start.hidden),
      cell: layers(start.cell),
      noise: start.noise, // of the last draw; empty if there was none
      place: this.encoding.begin(start.frame),
      random: new Random(1000 * this.settings.seed + number),
      track: new LiveTrack(this.encoding, this.fps, this.last, this.look),
    };
    [character.next] = this.network.predict([character]);
    character.refining = this.refiner?.begin(start.frame);
    this.characters[number] = character;
    this.tracks[number] = character.track;
    const [shown] = this.refined([start.frame], [character]);
    this.show(character, shown);
  }

  /** What is shown of rows that the network drew: it goes on from what it drew itself. */
  refined(rows, characters) {
    if (!this.refiner) return rows;
    const better = this.refiner.refine(rows, characters.map(({ refining }) => refining)); // it must know all that was
    return this.settings.refined ?? true ? better : rows;
  }

  /** The first character begins anew at a place, as frame 0, alone and with all of `seconds` kept. */
  keep(place, seconds) {
    const [character] = this.characters;
    const { row } = character.track.at(this.last);
    this.last = this.exploded = 0;
    character.place = place;
    character.track = new LiveTrack(this.encoding, this.fps, 0, this.look, seconds);
    this.characters.length = this.tracks.length = this.settings.characters = 1;
    this.tracks[0] = character.track;
    this.show(character, row);
  }

  /** One frame more for all characters. */
  advance() {
    const { noise } = this.settings;
    const drawn = this.characters.map((character) => this.network.draw(character, this.settings));
    this.characters.forEach((character, k) => {
      character.input = noise ? drawn[k].map((value) => value + noise * character.random.normal()) : drawn[k];
    });
    const next = this.network.step(this.characters);
    const rows = this.refined(drawn.map((values) => this.denormalize(values)), this.characters);
    this.last++;
    this.characters.forEach((character, k) => {
      const row = rows[k];
      if (!row.every(Number.isFinite)) {
        this.exploded++;
        return this.enter(k);
      }
      character.next = next[k];
      character.place = this.encoding.walk(character.place, row);
      this.show(character, row);
    });
  }

  /** Frames up to `frame`, as far as they can be made in so many milliseconds. */
  reach(frame, milliseconds = Infinity) {
    const began = performance.now();
    const before = this.last;
    while (this.last < frame && performance.now() - began < milliseconds) this.advance();
    if (this.last > before) this.cost = 0.9 * (this.cost ?? 5) + (0.1 * (performance.now() - began)) / (this.last - before);
  }

  show(character, row) {
    const { track, place } = character;
    this.encoding.points(row, place, track.room(this.last));
    track.add(this.last, row, place);
  }
}
