// What a page plays and saves of a player's payload, for test_saving.py: the points that are drawn, and
// the text of a BVH file.
import { readFileSync } from "node:fs";
import { decode } from "../../../web/src/motion.js";
import { toBvh } from "../../../web/src/save_bvh.js";

const payload = JSON.parse(readFileSync(process.argv[2], "utf8"));
const tracks = decode(payload).map((track) => {
  const points = [];
  for (let stored = 0; stored < track.stored; stored++) {
    track.seek(stored * payload.stride);
    points.push(Array.from(track.points.slice(0, 3 * track.pointCount)));
  }
  return { points, bvh: toBvh(track.clip()) };
});
process.stdout.write(JSON.stringify(tracks));
