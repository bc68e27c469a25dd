// What a rater reads and presses, screen by screen.
import { ClipView } from "./clip.js";
import { make } from "./dom.js";
import { ownAnswers } from "./own.js";

const RATINGS = {
  question: "How realistic is this motion?",
  ends: ["1 is least realistic", "5 is most realistic"],
  options: [1, 2, 3, 4, 5].map((value) => ({ value, label: String(value), key: String(value) })),
};
const PAIRS = {
  question: "Which motion is more realistic?",
  ends: [],
  options: [
    { value: 1, label: "Left", key: "1" },
    { value: 0, label: "No difference", key: "2" },
    { value: 2, label: "Right", key: "3" },
  ],
};
export const formOf = (study) => (study.design === "pairs" ? PAIRS : RATINGS);

const KEPT = {
  local: "Answers are kept in this browser as you give them: you may reload or close this page, and go on later.",
  window: "This browser keeps answers for this window only: don't close it before you have saved your file.",
  none: "This browser keeps nothing: if you reload or close this page, answers are lost that you have not saved.",
};
const kept = (place) => make("p", { className: `ml-kept${place === "local" ? "" : " ml-warn"}` }, KEPT[place]);
const heading = (text) => make("h2", { tabIndex: -1 }, text);

/** What it is about, and whether the rater wants to. `begin(number)`, `goOn(text)`. */
export function consent(host, { study, contact, rules, key }, place, begin, goOn) {
  const agree = make("input", { type: "checkbox", id: "ml-agree" });
  const number = make("input", { type: "number", min: 0, step: 1, id: "ml-number", className: "ml-choice" });
  const start = make("button", { type: "button", className: "ml-load", disabled: true }, "Begin");
  const said = make("p", { role: "alert", className: "ml-warn" });
  agree.addEventListener("change", () => { start.disabled = !agree.checked; });
  const given = () => (/^\d{1,6}$/.test(number.value) ? Number(number.value) : null);
  start.addEventListener("click", () => begin(given()));
  const file = make("input", { type: "file", accept: ".json,application/json", id: "ml-file" });
  file.addEventListener("change", async () => {
    try {
      goOn(await file.files[0].text());
    } catch (error) {
      said.textContent = `Not taken: ${error.message}`;
    }
  });
  const items = study.orders[0].length;
  const minutes = Math.ceil((items * (2 * study.seconds + 4)) / 60);
  host.append(
    heading("Before you begin"),
    make("p", {}, `You will see ${items} ${study.design === "pairs" ? "pairs of short motions" : "short motions"} of a figure, and say of each how it looks to you. It takes about ${minutes} minute${minutes > 1 ? "s" : ""}. There is no right or wrong: what you see counts.`),
    make("p", {}, `Some motions were recorded from people, others were made by programs. You are not told which${key ? " before the end" : ""}.`),
    make("p", {}, "Your answers stay on this device. This page asks for no name, and sends nothing: at the end you save a file, and whether you hand it on is up to you. It holds your answers, their times, how often you played each motion, and a random number in place of a name. You can stop at any time."),
    kept(place),
    ...(contact ? [make("p", {}, `Questions, and the file, go to: ${contact}`)] : []),
    make("details", { className: "ml-more" }, make("summary", {}, "When answers count"), rules.map((rule) => make("p", {}, rule))),
    make("label", { className: "ml-agree", for: "ml-agree" }, agree, "I am an adult, I have read this, and I take part of my own will."),
    make("details", { className: "ml-more" },
      make("summary", {}, "I was given a number, or have a saved file"),
      make("label", { className: "ml-line", for: "ml-number" }, "Number", number),
      make("label", { className: "ml-line", for: "ml-file" }, "Go on from a saved file", file),
      said,
    ),
    make("div", { className: "ml-buttons" }, start),
  );
}

/** One item. `task`: its clips, what a check asks, or that it is practice; `now`: plays, seen and value so far. */
export class Question {
  constructor(host, content, task, now, { title, part, place, changed, next, stop }) {
    Object.assign(this, { host, now, task, changed, next, form: formOf(content.study) });
    host.append(make("div", { className: "ml-head" }, heading(title), make("progress", { max: 1, value: part, "aria-label": "How far you are" })));
    if (task.practice) host.append(make("p", {}, "Practice: this answer does not count. Press Play, or the space bar; watch to the end; answer, by keys ", this.form.options.map((o) => `${o.key} (${o.label})`.replace(/^(\d) \(\1\)$/, "$1")).join(", "), "; press Next, or Enter."));
    this.clip = new ClipView(host, content, task.clips, now, () => this.update());
    this.fields = this.choices();
    this.hint = make("p", { className: "ml-status", role: "status" });
    this.button = make("button", { type: "button", className: "ml-load", onclick: () => this.done() }, "Next");
    const later = make("button", { type: "button", className: "ml-kind", onclick: stop }, "Save what I have so far");
    host.append(this.fields, this.hint, make("div", { className: "ml-buttons" }, this.button, ...(task.practice ? [] : [later])));
    if (place !== "local") host.append(kept(place));
    this.show();
  }

  choices() {
    const { options, ends, question } = this.form;
    const asked = options.find(({ value }) => value === this.task.asks);
    const words = asked ? `This one checks that somebody looks: whatever you see, choose ${asked.label}.` : question;
    this.radios = options.map(({ value }) => make("input", {
      type: "radio", name: "ml-answer", value, checked: this.now.value === value, onchange: () => this.choose(value),
    }));
    const labels = options.map(({ label }, i) => make("label", { className: "ml-option" }, this.radios[i], make("span", {}, label)));
    return make("fieldset", { className: "ml-fields" }, make("legend", {}, words), make("div", { className: "ml-options" }, labels),
      ...(ends.length ? [make("p", { className: "ml-ends" }, ...ends.map((end) => make("span", {}, end)))] : []));
  }

  choose(value) {
    if (!this.now.seen) return;
    this.now.value = value;
    this.update();
  }

  done() {
    if (this.now.seen && this.now.value != null) this.next();
  }

  update() {
    this.show();
    this.changed();
  }

  show() {
    const { now, fields, form } = this;
    fields.disabled = !now.seen;
    this.radios.forEach((radio, i) => { radio.checked = form.options[i].value === now.value; });
    this.button.disabled = !now.seen || now.value == null;
    this.hint.textContent = this.clip?.blind
      ? "This browser shows no moving figures (it has no WebGL): please take another one."
      : now.seen ? (now.value == null ? "Now you can answer." : "") : "Watch it to its end; then you can answer.";
  }

  key(event) {
    const { target, key } = event;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const option = this.form.options.find((each) => each.key === key);
    if (option) this.choose(option.value);
    else if (key === " " && !(target.matches("button, summary") && target !== this.clip.button) && !target.matches("input:not(:checked)")) this.clip.play();
    else if (key === "Enter" && !this.button.disabled && !(target.matches("button") && target !== this.clip.button)) this.done();
    else return;
    event.preventDefault();
  }

  dispose() { this.clip.dispose(); }
}

/** The end: save, or let another person begin. */
export function end(host, content, { saved, state, text, save, anew }) {
  const { contact, key } = content;
  const again = make("button", { type: "button", className: "ml-kind" }, "Another person begins");
  const sure = make("p", { role: "alert", className: "ml-warn" });
  again.addEventListener("click", () => {
    if (saved() || sure.textContent) anew();
    else sure.textContent = "Your answers are not saved yet, and would be lost. Press again to go on all the same.";
  });
  const whole = make("textarea", { readOnly: true, rows: 6, value: text, "aria-label": "Your answers as text" });
  host.append(
    heading("That was all. Thank you!"),
    make("p", {}, "Save your answers now: until then they are in this browser alone."),
    make("div", { className: "ml-buttons" }, make("button", { type: "button", className: "ml-load", onclick: save }, "Save my answers"), again),
    sure,
    ...(key ? [ownAnswers(content, state)] : []),
    make("p", {}, contact ? `Please send the file to: ${contact}` : "If somebody asked you to take part, hand the file to them."),
    make("details", { className: "ml-more" }, make("summary", {}, "If no file can be saved"), make("p", {}, "Copy this text, and hand it on in place of the file:"), whole),
  );
}
