// Which keys steer while something else than the picture has the focus, and how the picture gets it back.

/** Whether an element has a use of its own for a key (its name or code) that steers: arrows move a slider. */
export function takes(element, key) {
  if (element.matches("select, input[type=number], input[type=text]")) return true;
  return key.startsWith("Arrow") && element.matches("input[type=range], svg");
}

/** After a click or a choice by mouse or finger the keys are the picture's again; who came by Tab stays where he is. */
export function giveBack(host, canvas) {
  const back = ({ type }) => {
    const now = host.getRootNode().activeElement;
    if (host.contains(now)) {
      const chooses = type === "click" && takes(now, ""); // his choice comes later
      if (chooses || now.matches(":focus-visible")) return;
    }
    canvas.focus({ preventScroll: true });
  };
  host.addEventListener("click", back);
  host.addEventListener("change", back);
  return () => {
    host.removeEventListener("click", back);
    host.removeEventListener("change", back);
  };
}
