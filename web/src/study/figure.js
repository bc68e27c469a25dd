// A rating study in the page: consent, practice, one item after another, and a file of answers at the end.
import { addStyle } from "../style.js";
import { currentTheme, watchTheme } from "../theme.js";
import { answersText, saveAs, stateFrom } from "./answers.js";
import { make } from "./dom.js";
import { consent, end, Question } from "./screens.js";
import { Store } from "./store.js";
import css from "./study.css";

const PRACTICE = { ratings: ["practice"], pairs: ["practice", "check"] };
const CHECK = { ratings: ["check"], pairs: ["check", "check"] };

export class StudyFigure {
  constructor(host, content) {
    addStyle(host);
    host.append(make("style", { textContent: css }));
    host.classList.add("ml-study");
    Object.assign(this, { host, content, study: content.study });
    this.place = make("div");
    host.append(this.place);
    watchTheme((theme) => { host.dataset.mlTheme = theme; });
    host.dataset.mlTheme = currentTheme();
    this.store = new Store(this.study.hash, () => this.taken());
    document.addEventListener("keydown", (event) => this.asked && this.question?.key(event));
    this.state = this.fits(this.store.read()) ?? this.fresh();
    if (this.state.agreed) this.keep(true); // which tells a window that has it open that this one goes on
    this.show({ focus: false }); // a page that has just opened begins at its top
    globalThis.addEventListener("pageshow", ({ persisted }) => persisted && this.resume());
  }

  /** Go on where the study is by now, whichever window brought it there. */
  resume() {
    this.elsewhere = false;
    this.state = this.fits(this.store.read()) ?? this.fresh();
    if (this.state.agreed) this.keep(true);
    this.show();
  }

  fresh() {
    return { hash: this.study.hash, rater: randomName(), order: null, agreed: 0, practised: false, answers: [], now: null, saved: 0 };
  }

  /** What was kept, if it is of this study and makes sense. */
  fits(state) {
    const whole = state?.hash === this.study.hash && Array.isArray(state.answers) && (!state.agreed || this.study.orders[state.order]);
    return whole ? state : null;
  }

  /** Keep the state; whether it is kept where it was before. */
  keep(takeOver = false) {
    const before = this.store.place;
    this.store.write(this.state, takeOver);
    return before === this.store.place;
  }

  get sequence() { return this.study.orders[this.state.order]; }

  get at() { return this.state.answers.length; }

  show({ focus = true } = {}) {
    if (this.elsewhere) return;
    this.question?.dispose();
    this.question = null;
    this.place.replaceChildren();
    const { state } = this;
    if (!state.agreed) consent(this.place, this.content, this.store.place, (number) => this.begin(number), (text) => this.goOn(text));
    else if (!state.practised) this.ask({ clips: PRACTICE[this.study.design], practice: true }, "Practice", 0);
    else if (this.at < this.sequence.length) this.ask(this.task(), `${this.at + 1} of ${this.sequence.length}`, this.at / this.sequence.length);
    else this.finish();
    if (focus) this.place.querySelector("h2").focus({ preventScroll: true });
  }

  /** Whether keys are meant for the study: it has the focus, or it is in sight and nothing has. */
  get asked() {
    const { activeElement: focused, body, documentElement: { clientHeight } } = document;
    const { top, bottom } = this.place.getBoundingClientRect();
    return this.place.contains(focused) || ((!focused || focused === body) && top < clientHeight && bottom > 0);
  }

  begin(number) {
    if (this.fits(this.store.read())?.agreed) return this.resume(); // begun in another window meanwhile
    const { orders } = this.study;
    this.state.order = number === null ? crypto.getRandomValues(new Uint32Array(1))[0] % orders.length : number % orders.length;
    this.state.agreed = Date.now();
    this.keep(true);
    this.show();
  }

  goOn(text) {
    const found = stateFrom(this.study, text);
    if (!this.study.orders[found.order]) throw new Error("this file is damaged.");
    if (this.fits(this.store.read())?.agreed) return this.resume();
    this.state = { ...this.fresh(), ...found, practised: true };
    this.keep(true);
    this.show();
  }

  /** What is asked now. */
  task() {
    const item = this.study.items[this.sequence[this.at]];
    if (item.asks !== null) return { item: item.id, clips: CHECK[this.study.design], asks: item.asks };
    const clips = this.state.order % 2 ? [...item.clips].reverse() : item.clips; // odd orders see sides exchanged
    return { item: item.id, clips };
  }

  ask(task, title, part) {
    const { state } = this;
    state.now ??= { plays: 0, seen: false, value: null, shown: Date.now() };
    this.question = new Question(this.place, this.content, task, state.now, {
      title, part, place: this.store.place,
      changed: () => this.keep() || this.show(),
      next: () => this.next(task),
      stop: () => this.save(),
    });
    this.keep();
  }

  next(task) {
    const { state } = this;
    const { value, plays, shown } = state.now;
    if (task.practice) state.practised = true;
    else state.answers.push({ item: task.item, value, plays, shown, answered: Date.now() });
    state.now = null;
    this.keep();
    this.show();
  }

  save() {
    saveAs(answersText(this.study, this.state), `answers-${this.study.id}-${this.state.rater}.json`);
    this.state.saved = this.at;
    this.keep();
  }

  finish() {
    end(this.place, this.content, {
      saved: () => this.state.saved === this.at,
      state: this.state,
      text: answersText(this.study, this.state),
      save: () => this.save(),
      anew: () => {
        this.state = this.fresh();
        this.keep();
        this.show();
      },
    });
  }

  /** Another window of this browser goes on with the study: nothing is answered here until it is asked for. */
  taken() {
    this.elsewhere = true;
    this.question?.dispose();
    this.question = null;
    const here = make("button", { type: "button", className: "ml-load" }, "Go on here");
    here.addEventListener("click", () => this.resume());
    this.place.replaceChildren(
      make("h2", { tabIndex: -1 }, "This study is open in another window"),
      make("p", {}, "Nothing is lost: go on there, or here, where you are by now."),
      make("div", { className: "ml-buttons" }, here),
    );
  }
}

/** Twelve hexadecimal digits that stand for a rater. */
function randomName() {
  return Array.from(crypto.getRandomValues(new Uint8Array(6)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}
