"""Long, wide and gappy captures: what ezc3d writes, and what ezc3d and c3d read."""

import json
import warnings

import c3d
import ezc3d
import numpy as np
from given import FOLDER

PATH = str(FOLDER / "capture.c3d")


def write(points, names):
    out = ezc3d.c3d()
    out["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    out["parameters"]["POINT"]["LABELS"]["value"] = names
    out["data"]["points"] = points
    out.write(PATH)


def read():
    """Points of all frames, by ezc3d and by c3d, and c3d's names."""
    with open(PATH, "rb") as file:
        reader = c3d.Reader(file)
        frames = [points for _, points, _ in reader.read_frames()]
        return ezc3d.c3d(PATH)["data"]["points"], frames, list(reader.point_labels)


warnings.simplefilter("ignore")
said, told = {}, lambda: {"ezc3d": by_ezc3d.shape[2], "c3d": len(by_c3d)}
for count in (65_534, 65_535, 70_000):
    write(np.ones((4, 1, count)), ["A"])
    by_ezc3d, by_c3d, _ = read()
    said[f"frames read of {count}"] = told()
write(np.ones((4, 300, 3)), [f"M{i:03d}" for i in range(300)])
_, _, names = read()
said["names that c3d has of 300"] = len(names)
lost = np.full((4, 1, 3), 500.0)
lost[:3, 0, 1] = np.nan
write(lost, ["A"])
by_ezc3d, by_c3d, _ = read()
said["a lost marker"] = {"ezc3d": str(by_ezc3d[0, 0, 1]), "c3d": str(float(by_c3d[1][0, 0]))}
said["c3d marks it by its fourth value"] = float(by_c3d[1][0, 3])
print(json.dumps(said))
