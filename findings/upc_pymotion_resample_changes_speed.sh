#!/usr/bin/env bash
# upc-pymotion's resampling changes how fast people walk, and moves frames that both rates have.
#
# upc-pymotion 0.3.4, Python 3.11. Seen November 2026.
#
# BVH.resample() takes frames x (new rate / old rate), rounded, spreads so many from the first frame to the
# last, and then says that they come at the new rate. They are nearer or farther: the shorter the clip, the
# more. Poses that both rates have at one moment differ. From 120 to 30 fps a quarter second is 7 % too
# fast; half the rate is exact, since there every second frame is picked. Nothing is said.
# Who compares clips of several rates, or feeds a network speeds: resample elsewhere.
#
# Guessed before it was run, from memory: the motion keeps its speed and, to a frame, its duration.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet upc-pymotion==0.3.4

cat >resample.py <<'PY'
from pymotion.io.bvh import BVH

FILE = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  End Site
  {
    OFFSET 0 20 0
  }
}
MOTION
"""


def sped(frames, old, new):
    """A walk of 100 units a second at another rate: its frames, seconds and speed."""
    with open("walk.bvh", "w") as file:
        file.write(FILE + f"Frames: {frames}\nFrame Time: {1 / old:.9f}\n")
        file.writelines(f"0 90 {100 * frame / old:.6f} 0 0 0\n" for frame in range(frames))
    clip = BVH()
    clip.load("walk.bvh")
    clip.resample(1 / new)
    ahead, step = clip.data["positions"][:, 0, 2], clip.data["frame_time"]
    lasts = (len(ahead) - 1) * step
    print(
        f"{frames} frames, {old} to {new} fps: {len(ahead)} frames, {lasts:.2f} s of",
        f"{(frames - 1) / old:.2f} s, {(ahead[-1] - ahead[0]) / lasts:.1f} units a second of 100",
    )


for frames, old, new in ((61, 30, 15), (61, 30, 60), (11, 30, 60), (301, 120, 30), (31, 120, 30),
                         (51, 25, 12)):  # fmt: skip
    sped(frames, old, new)
PY
venv/bin/python resample.py | tee said.txt

diff said.txt - <<'EXPECTED'
61 frames, 30 to 15 fps: 31 frames, 2.00 s of 2.00 s, 100.0 units a second of 100
61 frames, 30 to 60 fps: 122 frames, 2.02 s of 2.00 s, 99.2 units a second of 100
11 frames, 30 to 60 fps: 22 frames, 0.35 s of 0.33 s, 95.2 units a second of 100
301 frames, 120 to 30 fps: 75 frames, 2.47 s of 2.50 s, 101.4 units a second of 100
31 frames, 120 to 30 fps: 8 frames, 0.23 s of 0.25 s, 107.1 units a second of 100
51 frames, 25 to 12 fps: 26 frames, 2.08 s of 2.00 s, 96.0 units a second of 100
EXPECTED
echo "As described: what was resampled walks at another speed."
