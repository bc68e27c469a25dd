// The generator of motionlab/models/lstm_gmm.py, a frame at a time: FC - FC - LSTM - LSTM - FC.
// Everything here is in normalised units.
import { Linear } from "./affine.js";
import { Lstm } from "./lstm.js";
import { choose, nextNoise, point, toMixture } from "./mixture.js";

export class LstmGmm {
  /** `layers` and `settings` (components, kept, skip, reach, floor) from weights.js. */
  constructor({ enter, lstm, leave }, settings) {
    this.enter = enter.map((layer) => new Linear(layer));
    this.lstm = lstm.map((layer, depth) => new Lstm(layer, depth));
    this.leave = new Linear(leave);
    this.settings = settings;
  }

  /** What may follow after each of the states (an array) has seen its `input`: a mixture each. */
  step(states) {
    let below = states.map(({ input }) => input);
    for (const layer of this.enter) below = layer.of(below).map(relu);
    this.lstm.forEach((layer, depth) => {
      layer.step(below, states);
      below = states.map(({ hidden }) => hidden[depth]);
    });
    return this.predict(states);
  }

  /** What may follow states, without another step. */
  predict(states) {
    const numbers = this.leave.of(states.map(({ hidden }) => hidden.at(-1)));
    return states.map(({ input }, k) => toMixture(numbers[k], input, this.settings));
  }

  /** A frame of what may follow a character, who keeps the noise in it for the next one. */
  draw(character, settings) {
    const { next, random } = character;
    const component = choose(next, random, settings);
    character.noise = nextNoise(character.noise, next.kept, random, settings);
    return point(next, component, character.noise, settings);
  }
}

function relu(values) {
  for (let i = 0; i < values.length; i++) values[i] = Math.max(values[i], 0);
  return values;
}
