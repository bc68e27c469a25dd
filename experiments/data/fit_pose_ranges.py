"""How far bodies of the training data go, channel by channel: what lies beyond is a broken pose.

    python -m experiments.data.fit_pose_ranges

Writes src/motionlab/metrics/pose_ranges.json: least and largest height, tilt and numbers of each
joint (`JointAngles` of the canonical skeleton) in the training split of `locomotion`, and margins: the
least tenth of a radian, and two centimetres, with which no clip of the validation split has a broken
frame.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import torch

from motionlab.training import Prepared

TARGET = Path(__file__).parents[2] / "src" / "motionlab" / "metrics" / "pose_ranges.json"
FIRST = 3  # channels before it are steps and turns; it is the height
STEPS = 0.02, 0.1  # metres and radians that margins are whole numbers of, at least one


def main() -> None:
    data = Prepared.find("locomotion")
    last = data.encoding.slices["pose"].stop
    body = lambda split: [clip[:, FIRST:last] for clip in data.clips(split)]
    frames = torch.cat(body("train"))
    low, high = frames.amin(0), frames.amax(0)
    beyond = lambda clip: torch.maximum(low - clip, clip - high).amax(0)
    worst = torch.stack([beyond(clip) for clip in body("val")]).amax(0)
    margins = [
        step * max(1, math.ceil(float(most) / step))
        for step, most in zip(STEPS, (worst[0], worst[1:].max()), strict=True)
    ]
    names = data.encoding.feature_names[FIRST:last]
    rounded = lambda values: [round(value, 4) + 0.0 for value in values.tolist()]
    ranges = dict(zip(names, zip(rounded(low), rounded(high), strict=True), strict=True))
    head = {
        "source": "locomotion, training split; margins: validation split",
        "frames": len(frames), "unit": "metres, of the height; radians", "margins": margins,
    }  # fmt: skip
    rows = ",\n".join(f"  {json.dumps(name)}: {json.dumps(span)}" for name, span in ranges.items())
    TARGET.write_text(
        json.dumps(head, indent=1)[:-2] + f',\n "ranges": {{\n{rows}\n }}\n}}\n', encoding="utf-8"
    )
    tested = torch.stack([beyond(clip) for clip in body("test")])
    over = (tested[:, 0] > margins[0]) | (tested[:, 1:].amax(1) > margins[1])
    print(
        f"margins {margins}; clips of the test split with a broken frame: {int(over.sum())} of {len(over)}"
    )


if __name__ == "__main__":
    main()
