"""BVH text of a body of three joints, for tests that need files but not people."""

from __future__ import annotations

import math

_HEADER = """HIERARCHY
ROOT Hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {{
    OFFSET 0 20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Neck
    {{
      OFFSET 0 30.5 {seed}
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {{
        OFFSET 0 10 0
      }}
    }}
  }}
}}
MOTION
Frames: {frames}
Frame Time: 0.008333
"""


def tiny_bvh(frames: int, seed: int = 0) -> bytes:
    """A clip that starts with a T-pose (all rotations zero) and then sways; in centimetres."""
    rows = []
    for t in range(frames):
        angles = [0.0] * 9 if t == 0 else [30 * math.sin(t / 9 + i + seed) for i in range(9)]
        rows.append(" ".join(f"{v:.5f}" for v in (t * 1.5, 90.0, seed, *angles)))
    return (_HEADER.format(seed=seed, frames=frames) + "\n".join(rows) + "\n").encode()
