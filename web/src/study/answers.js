// The file of answers, as motionlab.studies.answers reads it. All numbers in it are integers, so that Python writes
// the body again letter for letter, and can tell by the checksum whether it was changed.

const TABLE = Array.from({ length: 256 }, (_, byte) => {
  let value = byte;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});

/** CRC-32 of a text's UTF-8, as zlib has it, in eight hexadecimal digits. */
export function crc32(text) {
  let value = 0xffffffff;
  for (const byte of new TextEncoder().encode(text)) value = (value >>> 8) ^ TABLE[(value ^ byte) & 255];
  return ((value ^ 0xffffffff) >>> 0).toString(16).padStart(8, "0");
}

/** The text of the file: what was answered so far, whole or not. */
export function answersText(study, state) {
  const body = {
    study: study.id,
    hash: study.hash,
    rater: state.rater,
    order: state.order,
    simulated: false,
    agreed: state.agreed,
    saved: Date.now(),
    answers: state.answers,
  };
  return JSON.stringify({ format: "motionlab-answers", version: 1, checksum: crc32(JSON.stringify(body)), body }, null, 1);
}

/** What a saved file knows of how far its rater was; throws an Error that says what is wrong with it. */
export function stateFrom(study, text) {
  let file;
  try {
    file = JSON.parse(text);
  } catch {
    throw new Error("this file is damaged, or none of answers.");
  }
  const { format, checksum, body } = file ?? {};
  if (format !== "motionlab-answers" || !Array.isArray(body?.answers)) throw new Error("this is no file of answers.");
  if (body.hash !== study.hash) throw new Error("this file belongs to another study.");
  if (checksum !== crc32(JSON.stringify(body))) throw new Error("this file was changed after it was saved.");
  const { rater, order, agreed, answers } = body;
  return { rater, order, agreed, answers };
}

/** Let the browser save a text as a file. */
export function saveAs(text, name) {
  const url = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  const link = Object.assign(document.createElement("a"), { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}
