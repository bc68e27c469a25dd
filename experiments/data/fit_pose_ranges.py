"""How far bodies of the training data go, channel by channel: what lies beyond is a broken pose.

    python -m experiments.data.fit_pose_ranges

Writes src/motionlab/metrics/pose_ranges.json: least and largest tilt and numbers of each
joint (`JointAngles` of the canonical skeleton) in the training split of `locomotion`, and a margin:
the least tenth of a radian with which no clip of the validation split has a broken frame.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import torch

from motionlab.training import Prepared

TARGET = Path(__file__).parents[2] / "src" / "motionlab" / "metrics" / "pose_ranges.json"
FIRST = 4  # channels before it are steps, turns and the height, which depends on the legs


def main() -> None:
    data = Prepared.find("locomotion")
    last = data.encoding.slices["pose"].stop
    body = lambda split: [clip[:, FIRST:last] for clip in data.clips(split)]
    frames = torch.cat(body("train"))
    low, high = frames.amin(0), frames.amax(0)
    beyond = lambda clip: float(torch.maximum(low - clip, clip - high).max())
    margin = max(1, math.ceil(10 * max(map(beyond, body("val"))))) / 10
    names = data.encoding.feature_names[FIRST:last]
    rounded = lambda values: [round(value, 4) + 0.0 for value in values.tolist()]
    ranges = dict(zip(names, zip(rounded(low), rounded(high), strict=True), strict=True))
    head = {
        "source": "locomotion, training split; margin: validation split",
        "frames": len(frames), "unit": "radians", "margin": margin,
    }  # fmt: skip
    rows = ",\n".join(f"  {json.dumps(name)}: {json.dumps(span)}" for name, span in ranges.items())
    TARGET.write_text(
        json.dumps(head, indent=1)[:-2] + f',\n "ranges": {{\n{rows}\n }}\n}}\n', encoding="utf-8"
    )
    tested = [beyond(clip) for clip in body("test")]
    over = sum(some > margin for some in tested)
    print(f"margin {margin}; clips of the test split with a broken frame: {over} of {len(tested)}")


if __name__ == "__main__":
    main()
