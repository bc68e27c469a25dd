// A stick to be dragged with finger or mouse: how far and which way its knob is from the middle.

const REACH = 34; // pixels that the knob can go

export class Stick {
  /** `moved([left, ahead])` is called with shares from -1 to 1, [0, 0] when it is let go. */
  constructor(moved) {
    this.moved = moved;
    this.element = Object.assign(document.createElement("div"), { className: "ml-stick" });
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", "Stick: drag it to steer. The arrow keys do the same while the picture has the focus.");
    this.knob = document.createElement("span");
    this.element.append(this.knob);
    this.element.addEventListener("pointerdown", (event) => this.press(event));
    this.element.addEventListener("pointermove", (event) => event.pointerId === this.pointer && this.drag(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      this.element.addEventListener(end, (event) => event.pointerId === this.pointer && this.release());
    }
  }

  press(event) {
    if (this.pointer !== undefined || event.button > 0) return;
    event.preventDefault(); // no text is chosen, and the canvas below doesn't turn
    event.stopPropagation();
    this.pointer = event.pointerId;
    this.element.setPointerCapture(event.pointerId);
    this.drag(event);
  }

  drag({ clientX, clientY }) {
    const { left, top, width, height } = this.element.getBoundingClientRect();
    const off = [clientX - left - width / 2, clientY - top - height / 2];
    const far = Math.max(Math.hypot(...off), REACH);
    this.put(off.map((pixels) => pixels / far));
  }

  release() {
    this.pointer = undefined;
    this.put([0, 0]);
  }

  /** Shares to the right and down. */
  put([right, down]) {
    this.knob.style.transform = `translate(${REACH * right}px, ${REACH * down}px)`;
    this.moved([-right, -down]);
  }
}
