// Where a rater's answers are kept while he gives them, so that no reload, step back or crash loses any: in the
// browser's store of this page, or, where that is refused, in the state of this window; or nowhere, which is told.

export class Store {
  /** `key` names the study. `lost` is called when another window goes on with it. */
  constructor(key, lost) {
    this.key = `motionlab-study-${key}`;
    this.lost = lost;
    this.token = Math.random().toString(36).slice(2);
    this.place = this.find();
    globalThis.addEventListener("storage", (event) => {
      if (event.key === this.key && event.newValue && JSON.parse(event.newValue).token !== this.token) lost();
    });
  }

  /** "local", "window" or "none". */
  find() {
    try {
      localStorage.setItem(`${this.key}-try`, "1");
      localStorage.removeItem(`${this.key}-try`);
      return "local";
    } catch {
      return this.inWindow(history.state?.[this.key] ?? null) ? "window" : "none";
    }
  }

  read() {
    try {
      const text = this.place === "local" ? localStorage.getItem(this.key) : history.state?.[this.key];
      return text ? JSON.parse(text) : null;
    } catch {
      return null; // what is damaged is as good as nothing
    }
  }

  /** Keep a state, unless another window has gone on meanwhile: a page that comes back by a step back was told nothing. */
  write(state, takeOver) {
    const other = this.place === "local" && this.read()?.token;
    if (!takeOver && other && other !== this.token) return this.lost();
    const text = JSON.stringify({ ...state, token: this.token });
    try {
      if (this.place === "local") return localStorage.setItem(this.key, text);
    } catch {
      this.place = "window"; // full, or refused by now
    }
    if (this.place === "window" && !this.inWindow(text)) this.place = "none";
  }

  inWindow(text) {
    try {
      history.replaceState({ ...history.state, [this.key]: text }, "");
      return true;
    } catch {
      return false;
    }
  }
}
