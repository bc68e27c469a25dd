// What one rater's own answers say, shown to that rater at the end, where the page knows which clip is whose.
import { make } from "./dom.js";

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
const row = (cells, tag = "td") => make("tr", {}, cells.map((cell) => make(tag, {}, cell)));

/** For each method and gait the answers given: ratings, or for pairs 1 taken, 0 not, 0.5 for no difference. */
export function byMethod({ study, key }, { order, answers }) {
  const found = new Map();
  const add = (clip, value) => {
    const { method, gait } = key[clip];
    if (!found.has(method)) found.set(method, new Map());
    const gaits = found.get(method);
    gaits.set(gait, [...(gaits.get(gait) ?? []), value]);
  };
  const items = new Map(study.items.map((item) => [item.id, item]));
  for (const { item: id, value } of answers) {
    const { clips, asks } = items.get(id);
    if (asks !== null) continue;
    const shown = order % 2 ? [...clips].reverse() : clips;
    shown.forEach((clip, side) => add(clip, clips.length === 1 ? value : value === 0 ? 0.5 : Number(value === side + 1)));
  }
  return found;
}

/** A table of them: means of ratings, or how often a method was taken. */
export function ownAnswers(content, state) {
  const pairs = content.study.design === "pairs";
  const found = byMethod(content, state);
  const gaits = [...new Set([...found.values()].flatMap((each) => [...each.keys()]))].sort();
  const said = (values) => (pairs ? `${Math.round(100 * mean(values))} %` : mean(values).toFixed(2));
  const total = (each) => mean([...each.values()].flat());
  const methods = [...found].sort((a, b) => total(b[1]) - total(a[1]));
  return make("div", {},
    make("h3", {}, "Your own answers"),
    make("div", { className: "ml-wide" }, make("table", {},
      make("thead", {}, row(["method", ...gaits, ...(gaits.length > 1 ? ["all"] : [])], "th")),
      make("tbody", {}, methods.map(([name, each]) => row([name, ...gaits.map((gait) => said(each.get(gait))), ...(gaits.length > 1 ? [said([...each.values()].flat())] : [])]))),
    )),
    make("p", {}, pairs ? "How often you took each method, no difference counted half. " : "Means of your ratings, 5 is most realistic. ",
      "One person says nothing of others: that takes many, and tests over them."),
  );
}
