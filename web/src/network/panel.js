// Sliders and what stands around them. What there is to set comes from Python (CONTROLS in
// motionlab/viewer/live/dream_settings.py), so that a notebook's widgets have the same names and ranges.

const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });

export class Panel {
  /** `change(name, value)` is called for every setting the reader changes. */
  constructor(controls, starts, facts, change) {
    this.element = make("div", "ml-panel");
    this.status = make("p", "ml-status");
    this.status.setAttribute("role", "status");
    this.load = make("button", "ml-load");
    this.load.type = "button";
    this.controls = Object.fromEntries(controls.map((control) => [control.name, field(control, starts, change)]));
    this.grid = make("div", "ml-grid");
    this.grid.append(...Object.values(this.controls));
    this.element.append(this.grid, this.load, this.status, provenance(facts));
    this.setLive(false);
  }

  /** Clips have only a start to choose; a network has all settings. */
  setLive(live) {
    this.load.hidden = live;
    for (const [name, control] of Object.entries(this.controls)) control.hidden = !live && name !== "start";
  }
}

/** A label, its control, and its value. */
export function field(control, starts, change) {
  const { name, label, help, min, max, step, value } = control;
  const box = make("label", "ml-field");
  box.title = help;
  const caption = make("span", "ml-caption", label);
  const shown = make("span", "ml-value"); // an <output> would take the label for its own
  let input;
  if (name === "start") {
    input = make("select", "ml-choice");
    starts.forEach((start, i) => input.add(new Option(start, min + i)));
    input.value = value;
  } else {
    input = make("input", name === "seed" ? "ml-choice" : "ml-range");
    Object.assign(input, { type: name === "seed" ? "number" : "range", min, max, step });
    input.value = value;
  }
  if (min === 0 && max === 1 && step === 1) Object.assign(input, { type: "checkbox", className: "ml-tick", checked: Boolean(value) });
  const tell = () => { shown.textContent = input.type === "range" ? input.value : ""; };
  input.addEventListener("input", () => {
    tell();
    if (input.type === "checkbox") return change(name, Number(input.checked));
    if (input.value !== "" && input.checkValidity()) change(name, Number(input.value));
  });
  tell();
  input.setAttribute("aria-label", label); // without the value, which a slider says itself
  box.append(caption, shown, input);
  return box;
}

/** Where the weights come from, on demand. */
export function provenance(facts) {
  const details = make("details", "ml-facts");
  const list = make("dl", "");
  for (const [name, value] of facts) list.append(make("dt", "", name), make("dd", "", value));
  details.append(make("summary", "", "Where these weights come from"), list);
  return details;
}
