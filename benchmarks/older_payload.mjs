// Motions as today's player is given them, written as the player of commit 1dea26a read them: its script can then
// show today's page. For bench_memory.py: node older_payload.mjs FROM TO, JSON lists of payloads.
import { readFileSync, writeFileSync } from "node:fs";
import { decode } from "../web/src/motion.js";

const MOST = 32767; // of 16 bits
const FINEST = 1e-4; // metres

const base64 = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString("base64");

/** Whole numbers as changes of their changes, seven bits a byte: what fromFewBytes in motion.js reads. */
function inFewBytes(numbers, width) {
  const sent = [];
  numbers.forEach((number, i) => {
    const change = number - (i < width ? 0 : 2 * numbers[i - width]) + (i < 2 * width ? 0 : numbers[i - 2 * width]);
    const bent = (change << 16) >> 16; // past the sixteenth bit it goes round
    let rest = bent < 0 ? -2 * bent - 1 : 2 * bent;
    for (; rest > 127; rest >>>= 7) sent.push((rest & 127) | 128);
    sent.push(rest);
  });
  return Uint8Array.from(sent);
}

function older(track, contacts) {
  const { label, color, pointCount, stored, root, local, extras, bones, contactPoints } = track;
  const scale = Math.max(local.reduce((most, value) => Math.max(most, Math.abs(value)), 0) / MOST, FINEST);
  const steps = Int16Array.from(local, (value) => Math.round(value / scale));
  return {
    label, color, points: pointCount, frames: stored, scale, extras, bones, contacts, contact_points: contactPoints,
    root: base64(Int32Array.from(root, (value) => Math.round(value / 1e-4))),
    local: base64(inFewBytes(steps, 3 * pointCount)),
  };
}

const [from, to] = process.argv.slice(2);
const payloads = JSON.parse(readFileSync(from, "utf8"));
writeFileSync(to, JSON.stringify(payloads.map(({ bodies, magnified, ...payload }) => ({
  ...payload,
  version: 1,
  tracks: decode({ bodies, magnified, ...payload }).map((track, i) => older(track, payload.tracks[i].contacts)),
}))));
