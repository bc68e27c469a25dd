#!/usr/bin/env bash
# three.js cuts clips at the wrong frame: subclip() by frame numbers loses the first frame, or doubles it.
#
# three 0.187.0, AnimationUtils.subclip(). Seen November 2026 with node 20.
#
# It multiplies each key's time by the rate and compares with the frame's number. Times are kept as 32-bit
# floats, so that frame 17 of a clip at 30 fps is a hair before 17 and goes with what ends there. Of 200
# cuts of five frames, three in four are wrong at 30, 60 and 120 fps, two in three at 24: they begin a frame
# late, have one too many, or both. Since the first key is put at time 0, a piece that begins late comes
# early, all of it. Cuts of a single frame (a still, an additive pose) may be empty. No warning.
# Who cuts clips for three.js: ask for half a frame less, subclip(clip, name, 9.5, 19.5, fps).
#
# Guessed before it was run: frame `start` is in, frame `end` is out, exactly.
#
# Exit 0: as described. Exit 1: it changed. Needs node, npm and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-save three@0.187.0

cat >cut.mjs <<'JS'
import { AnimationClip, AnimationUtils, NumberKeyframeTrack } from "three";

function frames(fps, from, to) {
  // A clip of ten seconds whose value at each key is the number of its frame.
  const numbers = [...Array(10 * fps + 1).keys()];
  const track = new NumberKeyframeTrack(".x", numbers.map((frame) => frame / fps), numbers);
  const piece = AnimationUtils.subclip(new AnimationClip("walk", -1, [track]), "piece", from, to, fps);
  return piece.tracks.length ? [...piece.tracks[0].values] : [];
}

console.log("at 30 fps, from 16 to 17:", ...frames(30, 16, 17));
console.log("at 30 fps, from 17 to 18:", ...frames(30, 17, 18));
for (const shift of [0, 0.5]) {
  for (const fps of [24, 30, 60, 120]) {
    let wrong = 0;
    for (let from = 1; from <= 200; from += 1) {
      const kept = frames(fps, from - shift, from + 5 - shift);
      wrong += kept[0] !== from || kept.length !== 5;
    }
    console.log(`cut ${shift} earlier, at ${fps} fps, wrong of 200:`, wrong);
  }
}
JS
node cut.mjs | tee said.txt

diff said.txt - <<'EXPECTED'
at 30 fps, from 16 to 17: 16 17
at 30 fps, from 17 to 18:
cut 0 earlier, at 24 fps, wrong of 200: 127
cut 0 earlier, at 30 fps, wrong of 200: 153
cut 0 earlier, at 60 fps, wrong of 200: 153
cut 0 earlier, at 120 fps, wrong of 200: 153
cut 0.5 earlier, at 24 fps, wrong of 200: 0
cut 0.5 earlier, at 30 fps, wrong of 200: 0
cut 0.5 earlier, at 60 fps, wrong of 200: 0
cut 0.5 earlier, at 120 fps, wrong of 200: 0
EXPECTED
echo "As described: frames are lost and doubled where a clip is cut by their numbers."
