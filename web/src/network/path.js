// Ways over the ground, as motionlab/paths.py makes them: what is drawn becomes a curve one can
// walk, evenly spaced, with a timetable. Places are [x, z] in metres.

const SPACING = 0.03; // m between the places of a curve
const CORNER = 0.4; // m, radius to which corners are rounded
export const LEAST = 0.1; // m: a shorter path is none
const BEYOND = 8; // m that a curve goes on straight, at both ends
const SIDEWAYS = 2.5; // m/s²: people slow down where a curve would push them harder
const SLOWEST = 0.4; // m/s that even a hairpin is walked at
const CHANGE = 1; // m/s² of slowing down for it
const SETTLED = 1; // seconds after which a path should be kept, as design.py counts

export class Path {
  /** Through `points`, at least two that differ: corners of a line, rounded to a radius of `corner` metres. */
  constructor(points, corner = CORNER) {
    this.drawn = points.filter((point, i) => i === 0 || distance(point, points[i - 1]) > 0);
    const curve = even(this.drawn);
    this.places = corner ? even(rounded(curve, corner)) : curve;
    this.length = arcsOf(this.places).at(-1);
    this.spacing = this.length / (this.places.length - 1);
  }

  /** The place at so many metres of path; before its beginning and beyond its end it is straight. */
  at(arc) {
    const last = this.places.length - 1;
    const most = Math.ceil(BEYOND / this.spacing);
    const step = Math.min(Math.max(arc / this.spacing, -most), last + most);
    const low = Math.min(Math.max(Math.floor(step), 0), last - 1);
    return mixed(this.places[low], this.places[low + 1], step - low);
  }

  /** Metres of path at the place nearest to a point, of those from `first` to `last` metres. */
  nearest([x, z], first, last) {
    const count = Math.max(2, Math.ceil((last - first) / 0.05) + 1);
    const arcs = Array.from({ length: count }, (_, i) => first + ((last - first) * i) / (count - 1));
    const [piece, share] = nearestOf([x, z], arcs.map((arc) => this.at(arc)));
    return arcs[piece] + share * (arcs[piece + 1] - arcs[piece]);
  }

  /**
   * Metres of path that should lie behind the body, frame by frame, at `speed` metres a second, less where
   * the path bends sharply, and never more than `fastest`.
   */
  timetable(speed, fastest, fps) {
    const paces = this.paces(speed).map((pace) => Math.min(pace, fastest));
    const arcs = arcsOf(this.places);
    const seconds = [0];
    for (let i = 1; i < arcs.length; i++) seconds.push(seconds[i - 1] + (2 * (arcs[i] - arcs[i - 1])) / (paces[i] + paces[i - 1]));
    const frames = Math.max(1, Math.ceil(seconds.at(-1) * fps - 1e-6));
    return interpolated(Array.from({ length: frames + 1 }, (_, frame) => frame / fps), seconds, arcs);
  }

  /** Metres a second at each place: slower in bends, and before and after them. */
  paces(speed) {
    const paces = bends(this.places, 0.3).map((bend) => Math.max(Math.min(speed, Math.sqrt(SIDEWAYS / Math.max(bend, 1e-6))), Math.min(speed, SLOWEST)));
    const hold = (i, before) => { paces[i] = Math.min(paces[i], Math.sqrt(paces[before] ** 2 + 2 * CHANGE * SPACING)); };
    for (let i = 1; i < paces.length; i++) hold(i, i - 1);
    for (let i = paces.length - 2; i >= 0; i--) hold(i, i + 1);
    return paces;
  }

  /**
   * Root mean square distance in cm of a root [[x, z], ...] from the curve, and from the line as it was drawn,
   * after the first second: what "error (cm)" in design.py's records is. Null if it is not that long.
   */
  error(root, fps) {
    const kept = root.slice(Math.min(Math.round(SETTLED * fps), root.length - 1));
    const off = (line) => 100 * Math.sqrt(kept.reduce((sum, point) => sum + nearestOf(point, line)[2], 0) / kept.length);
    return kept.length ? { curve: off(this.places), drawn: off(this.drawn) } : null;
  }

  /** Metres between the curve and the place that was drawn farthest from it. */
  get farthest() {
    return Math.sqrt(Math.max(...this.drawn.map((point) => nearestOf(point, this.places)[2])));
  }

  /** How often it crosses itself. */
  get crossings() {
    const line = interpolatedPlaces(this.places, Math.ceil(this.length / 0.15));
    let found = 0;
    for (let i = 0; i + 1 < line.length; i++) {
      for (let j = i + 2; j + 1 < line.length; j++) found += cross(line[i], line[i + 1], line[j], line[j + 1]);
    }
    return found;
  }
}

const distance = ([x, z], [u, v]) => Math.hypot(x - u, z - v);

const mixed = ([x, z], [u, v], share) => [x + share * (u - x), z + share * (v - z)];

/** The nearest piece of a line to a point, the share of it that lies before, and the squared distance. */
function nearestOf([x, z], line) {
  let best = [0, 0, Infinity];
  for (let i = 0; i + 1 < line.length; i++) {
    const [[a, b], [c, d]] = [line[i], line[i + 1]];
    const [u, v] = [c - a, d - b];
    const share = Math.min(Math.max(((x - a) * u + (z - b) * v) / Math.max(u * u + v * v, 1e-12), 0), 1);
    const off = (x - a - share * u) ** 2 + (z - b - share * v) ** 2;
    if (off < best[2]) best = [i, share, off];
  }
  return best;
}

/** Metres before each place of a curve. */
function arcsOf(curve) {
  const arcs = [0];
  for (let i = 1; i < curve.length; i++) arcs.push(arcs[i - 1] + distance(curve[i], curve[i - 1]));
  return arcs;
}

/** Values at rising `wanted`, on the line through `known` and `values`. */
function interpolated(wanted, known, values) {
  let at = 0;
  return wanted.map((x) => {
    while (at < known.length - 2 && known[at + 1] < x) at++;
    const share = Math.min(Math.max((x - known[at]) / Math.max(known[at + 1] - known[at], 1e-12), 0), 1);
    return values[at] + share * (values[at + 1] - values[at]);
  });
}

function interpolatedPlaces(curve, pieces) {
  const arcs = arcsOf(curve);
  const wanted = Array.from({ length: pieces + 1 }, (_, i) => (arcs.at(-1) * i) / pieces);
  const [xs, zs] = [0, 1].map((axis) => interpolated(wanted, arcs, curve.map((place) => place[axis])));
  return xs.map((x, i) => [x, zs[i]]);
}

const even = (curve) => interpolatedPlaces(curve, Math.max(1, Math.ceil(arcsOf(curve).at(-1) / SPACING)));

/** Curvature in 1/m at each place: the turn within `span` metres about it, by their length. */
function bends(curve, span) {
  const reach = Math.max(1, Math.round(span / 2 / SPACING));
  const found = curve.map(() => 0);
  if (curve.length < 2 * reach + 2) return found;
  const going = [];
  for (let i = 1; i < curve.length; i++) {
    const way = Math.atan2(curve[i][0] - curve[i - 1][0], curve[i][1] - curve[i - 1][1]);
    going.push(i === 1 ? way : going.at(-1) + Math.atan2(Math.sin(way - going.at(-1)), Math.cos(way - going.at(-1))));
  }
  for (let i = 0; i + 2 * reach - 1 < going.length; i++) {
    found[i + reach] = Math.abs(going[i + 2 * reach - 1] - going[i]) / (SPACING * (2 * reach - 1));
  }
  return found;
}

/**
 * The curve with what bends more sharply than the radius drawn straighter, and nothing else: there, each
 * place moves towards the middle of its neighbours, until all is gentle enough. A hairpin keeps what is left.
 */
function rounded(curve, radius) {
  const reach = Math.max(1, Math.round(radius / 4 / SPACING));
  for (let round = 0; round < 40; round++) {
    const sharp = bends(curve, radius / 2).map((bend) => bend > 1 / radius);
    if (!sharp.includes(true)) break;
    const soft = curve.map((_, i) => i > 0 && i < curve.length - 1 && sharp.slice(Math.max(i - reach, 0), i + reach + 1).includes(true));
    for (let step = 0; step < 20; step++) {
      curve = curve.map((place, i) => (soft[i] ? mixed(place, mixed(curve[i - 1], curve[i + 1], 0.5), 0.5) : place));
    }
  }
  return curve;
}

/** Whether two pieces of line cross. */
function cross(a, b, c, d) {
  const side = ([x, z], [u, v], [s, t]) => (u - x) * (t - z) - (v - z) * (s - x);
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}
