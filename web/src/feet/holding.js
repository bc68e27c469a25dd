// When a foot is held, told frame by frame from what is known some frames ahead: motionlab/feet/holding.py.
import { apart, plus, times } from "./one_leg.js";

const FASTEST = 0.9; // m/s; a faster foot doesn't rest, whatever its label
const FARTHEST = 0.12; // metres that a foot may be from its place and still be held there
const RESTS = 0.005; // m/s; a toe that is slower is still, and slides nowhere
const SLOW = 0.05; // m/s; of a contact's first frames those so much slower than the others tell its place
const FALLS = 0.015; // metres; toes that come down farther are not down yet

/** From 1 at 0 to 0 at 1, level at both ends. */
const fade = (away) => (away >= 1 ? 0 : (1 - away) ** 2 * (1 + 2 * away));

/** The first frame from `start` whose mark is as wanted; the number of frames if there is none. */
function next(marks, wanted, start = 0) {
  const at = marks.indexOf(wanted, start);
  return at < 0 ? marks.length : at;
}

/** Where toes come to rest in a contact: their mean in all of it that is known, slow frames first. */
function placeOf(toes, speeds, on, still, begin, height) {
  const stop = next(on, false, begin);
  if (begin >= stop) return toes[0];
  let place = [...toes[begin]];
  if (!still[begin]) {
    const shares = speeds.slice(begin, stop).map((speed) => 1 / (speed * speed + SLOW * SLOW));
    const all = shares.reduce((sum, share) => sum + share, 0);
    place = shares.reduce((sum, share, k) => plus(sum, share / all, toes[begin + k]), [0, 0, 0]);
  }
  place[1] = height;
  return place;
}

/** Where one foot is between two frames. */
export class Foot {
  /** `rules`, in frames: blend, gap, shortest, sure; as motionlab/feet/holding.py's Rules. */
  constructor(rules) {
    Object.assign(this, {
      rules,
      on: true, // in contact, gaps filled; what is down at first may have been so for long
      away: Infinity, // frames since its label last said so
      seen: 0, // frames of this contact
      rests: 0, // of these, how many its toes were still in
      barred: 0, // frames in which it may not begin to be held, within this contact
      place: null, // metres, while it is held
      since: Infinity, // frames since it was held
      last: [0, 0, 0], // metres, its shift then
      near: 0, // share of its way onto its next place that it has eased
      given: [0, 0, 0], // metres, its last shift
      easing: 0, // frames ahead in which it eases onto its next place
    });
  }

  /**
   * How far the foot is to be moved now and, as it looks, in the next frames; called once a frame. A frame each, this one
   * first: `labels`, whether toes are said to be down, `speeds` m/s of them, and where they are. `height`: of resting toes.
   */
  shifts(labels, speeds, toes, height) {
    const { rules } = this;
    const on = this.clean(labels.map((down, k) => down && speeds[k] < FASTEST));
    const still = on.map((down, k) => down && speeds[k] < RESTS);
    this.count(on, still);
    let begin = 0;
    let { place } = this;
    if (!place) {
      begin = this.begins(toes, on, still);
      place = placeOf(toes, speeds, on, still, begin, height);
      if (begin === 0 && apart(place, toes[0]) < FARTHEST) this.place = place;
      else if (begin === 0) this.barred = begin = rules.sure + 1;
    }
    if (this.place) {
      const end = this.ends(toes, on, still);
      if (end) return this.held(toes, end);
      Object.assign(this, { place: null, barred: Math.ceil(rules.blend) + rules.sure });
      begin = on.length;
    }
    return this.free(toes, begin, place);
  }

  /** Labels without gaps and flickers; a contact that may be a flicker does not count yet. */
  clean(labels) {
    const { gap, shortest } = this.rules;
    const on = [...labels];
    let away = this.on ? this.away : Infinity;
    this.away = labels[0] ? 0 : this.away + 1;
    if (!labels.includes(true) || (this.on && !labels.includes(false))) {
      this.on = labels[0];
      return on;
    }
    labels.forEach((down, k) => {
      if (down && away > 0 && away <= gap) on.fill(true, Math.max(k - away, 0), k);
      away = down ? 0 : away + 1;
    });
    for (let [k, start] = [0, 0]; k <= on.length; k++) {
      if (k < on.length && on[k]) continue;
      if (k - start < shortest && !(start === 0 && this.on)) on.fill(false, start, k);
      start = k + 1;
    }
    [this.on] = on;
    return on;
  }

  /** Keep count of the frames of a contact, and of those in which toes are still. */
  count(on, still) {
    if (on[0]) Object.assign(this, { seen: this.seen + 1, rests: this.rests + still[0], barred: Math.max(this.barred - 1, 0) });
    else Object.assign(this, { seen: 0, rests: 0, barred: 0 });
  }

  /**
   * In which frame ahead the foot will begin to be held; the number of frames if in none. Where toes come to rest, if
   * they do, or else have come down. A foot that was let go is not taken up again before its shift is gone.
   */
  begins(toes, on, still) {
    const first = Math.max(next(on, true), this.on ? this.barred : 0);
    const stop = next(on, false, first);
    if (first >= stop) return on.length;
    const rests = still.indexOf(true, first);
    if (rests >= 0 && rests < stop) return rests;
    const heights = toes.slice(first, stop).map(([, height]) => height);
    const lowest = Math.min(...heights) + FALLS;
    return first + heights.findIndex((height) => height < lowest);
  }

  /** In which frame ahead a held foot is let go; the number of frames if in none. */
  ends(toes, on, still) {
    const stop = next(on, false);
    if (2 * this.rests > this.seen && !still.slice(0, stop).includes(true)) return 0; // it moves, whatever its label
    const far = toes.findIndex((toe) => apart(toe, this.place) >= FARTHEST);
    return far < 0 ? stop : Math.min(far, stop);
  }

  /** Shifts of a foot that is held, and let go in frame `end`. */
  held(toes, end) {
    const onto = toes.slice(0, end).map((toe) => plus(this.place, -1, toe));
    Object.assign(this, { since: 0, last: [...onto[0]], near: 0, easing: 0 });
    const after = toes.slice(end).map((_, k) => times(fade((k + 1) / this.rules.blend), onto[end - 1]));
    return [...onto, ...after];
  }

  /** Shifts of a foot that is not held: the last one fades out, and the next one, from frame `begin`, fades in. */
  free(toes, begin, place) {
    const { blend, sure } = this.rules;
    const comes = begin < toes.length && apart(place, toes[begin]) < FARTHEST;
    const near = Array.from({ length: begin }, (_, k) => (comes ? fade((begin - k) / (sure + 1)) : 0));
    const now = comes ? near[0] : 0;
    if (now < this.near) Object.assign(this, { since: 0, last: this.given }); // it comes down later than it seemed
    Object.assign(this, { since: this.since + 1, near: now, easing: comes ? begin : 0 });
    const onto = comes ? toes.slice(begin).map((toe) => plus(place, -1, toe)) : [];
    const shifts = toes.map((_, k) => {
      if (comes && k >= begin) return onto[k - begin];
      const old = times(fade((this.since + k) / blend) * (1 - near[k]), this.last);
      return comes ? plus(old, near[k], onto[0]) : old;
    });
    this.given = [...shifts[0]];
    return shifts;
  }
}
