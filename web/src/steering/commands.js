// What keys, stick, gamepad and sliders ask for, put together: a speed and a way on the ground.

const RUN = 2.6; // m/s at least, with Shift
const QUIET = 0.15; // share of a stick's way within which it says nothing
const KEYS = { // as [left, ahead]; by where keys are, so that other keyboards have them in the same place
  ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [1, 0], ArrowRight: [-1, 0],
  KeyW: [0, 1], KeyS: [0, -1], KeyA: [1, 0], KeyD: [-1, 0],
};
const radians = (degrees) => (Math.PI * degrees) / 180;

/** Whether a key steers. */
export const steers = ({ code, key }) => (KEYS[code] ? code : KEYS[key] ? key : null);

export class Commands {
  /** `settings`: speed m/s, direction in degrees, onward; `turned(degrees)` is told of a way that a hand asked for. */
  constructor(settings, turned) {
    Object.assign(this, { settings, turned, keys: new Set(), stick: [0, 0], pad: [0, 0], running: false, padRuns: false });
    this.path = null; // a Path to go along, until a hand does something
    this.used = false; // something was asked, so nobody need be told how
  }

  /** Nothing is pressed any more: the page has lost the focus, or nobody looks. */
  release() {
    this.keys.clear();
    this.running = false;
    this.stick = this.pad = [0, 0];
  }

  /** [left, ahead], each from -1 to 1, of the hand that does something; keys before stick before gamepad. */
  get hand() {
    const keys = [...this.keys].reduce((sum, key) => sum.map((value, i) => value + KEYS[key][i]), [0, 0]).map(Math.sign);
    return [keys, this.stick, this.pad].find(([left, ahead]) => Math.hypot(left, ahead) > QUIET) ?? [0, 0];
  }

  /** {speed, direction} that is asked for, or {speed, path}; seen from a camera that looks `view` radians off +z. */
  asked(view) {
    const { settings } = this;
    const [left, ahead] = this.hand;
    const far = Math.min(Math.hypot(left, ahead), 1);
    if (far) this.path = null;
    this.used ||= Boolean(far || this.path);
    if (this.path) return { speed: settings.speed, path: this.path };
    if (!far) return { speed: settings.onward ? settings.speed : 0, direction: radians(settings.direction) };
    const direction = view + Math.atan2(left, ahead);
    const degrees = Math.round((180 * Math.atan2(Math.sin(direction), Math.cos(direction))) / Math.PI);
    if (degrees !== settings.direction) this.turned(degrees);
    const speed = this.running || this.padRuns ? Math.max(settings.speed, RUN) : far * settings.speed;
    return { speed, direction };
  }

  /** Look at the first gamepad there is. */
  poll() {
    const pad = [...(globalThis.navigator?.getGamepads?.() ?? [])].find((one) => one?.connected);
    this.pad = pad ? [-(pad.axes[0] ?? 0), -(pad.axes[1] ?? 0)] : [0, 0];
    this.padRuns = Boolean(pad && [0, 7].some((button) => pad.buttons[button]?.pressed));
  }
}
