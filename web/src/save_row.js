// What the bar's last button opens: every motion that is seen, as .bvh and as .glb. Files are made here,
// in the page, from what it plays; no kernel, no server.
import { toBvh } from "./save_bvh.js";
import { toGlb } from "./save_glb.js";

const KINDS = { bvh: toBvh, glb: toGlb };
const LONGEST = 60; // letters of a file's name

export class SaveRow {
  /** `player` has saved (tracks), savedHow (words), payload and host. */
  constructor(player) {
    this.player = player;
    this.element = document.createElement("div");
    this.element.className = "ml-saving";
    this.element.hidden = true;
    this.said = document.createElement("small");
    this.said.setAttribute("role", "status");
    this.listed = [];
  }

  toggle(button) {
    this.element.hidden = !this.element.hidden;
    button.setAttribute("aria-expanded", String(!this.element.hidden));
    this.listed = [];
    this.show();
  }

  /** List the motions anew if there are others: another was chosen, a character came. */
  show() {
    if (this.element.hidden) return;
    const { saved, savedHow } = this.player;
    if (saved.length === this.listed.length && saved.every((track, i) => track === this.listed[i])) return;
    this.listed = [...saved];
    this.said.textContent = savedHow;
    const names = saved.map((track) => this.fileName(track));
    const alike = new Set(names).size < names.length;
    this.element.replaceChildren(...saved.map((track, i) => this.line(track, alike ? `${names[i]}_${i + 1}` : names[i])), this.said);
  }

  line(track, name) {
    const line = document.createElement("span");
    line.className = "ml-file";
    const label = Object.assign(document.createElement("span"), { className: "ml-name", textContent: name, title: name });
    label.style.setProperty("--ml-color", track.color);
    line.append(label);
    for (const kind of Object.keys(KINDS)) {
      const button = Object.assign(document.createElement("button"), { type: "button", className: "ml-kind", textContent: `.${kind}` });
      button.setAttribute("aria-label", `Save ${name}.${kind}`);
      button.addEventListener("click", () => this.save(track, name, kind));
      line.append(button);
    }
    return line;
  }

  async save(track, name, kind) {
    const file = `${name}.${kind}`;
    try {
      download(new Blob([await KINDS[kind](track.clip(), track, name)]), file, this.element);
      this.said.textContent = `${file}: ${this.player.savedHow}`;
    } catch (error) {
      this.said.textContent = `${file} could not be made: ${error.message}`;
    }
  }

  /** What a motion is called: by its own name and its label here, or else by the caption. */
  fileName({ name, label }) {
    const { payload, host } = this.player;
    const called = [...new Set([name, label && payload.choose, label])].filter(Boolean).join(" ");
    const caption = host.closest("figure, .ml-player")?.querySelector("figcaption")?.textContent;
    const words = (called || caption || "motion").normalize("NFC").replace(/[^\p{L}\p{N}.+-]+/gu, "_");
    return words.slice(0, LONGEST).replace(/^[_.-]+|[_.-]+$/g, "") || "motion";
  }
}

function download(blob, file, home) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: file, hidden: true });
  home.append(link); // some browsers and notebooks follow only links that are in the page
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000); // a reader may be asked first where to
}
