"""ezc3d: points as markers in millimetres into a C3D file, and out of it."""

import ezc3d
import numpy as np
from given import FOLDER, numbers, see

clip, path = numbers(), str(FOLDER / "clip.c3d")
out = ezc3d.c3d()
out["parameters"]["POINT"]["RATE"]["value"] = [clip["fps"]]
out["parameters"]["POINT"]["LABELS"]["value"] = list(clip["points"])
out["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
places = 1000 * np.array(clip["positions"]).transpose(2, 1, 0)
out["data"]["points"] = np.concatenate([places, np.ones_like(places[:1])])
out.write(path)
back = ezc3d.c3d(path)
point = back["parameters"]["POINT"]
see(
    names=point["LABELS"]["value"],
    fps=float(point["RATE"]["value"][0]),
    positions=back["data"]["points"][:3].transpose(2, 1, 0),
)
