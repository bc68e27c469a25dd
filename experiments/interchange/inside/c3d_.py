"""c3d: points as markers in millimetres into a C3D file, and out of it."""

import c3d
import numpy as np
from given import FOLDER, numbers, see

clip, path = numbers(), FOLDER / "clip.c3d"
writer = c3d.Writer(point_rate=clip["fps"])
writer.set_point_labels(clip["points"])
for places in np.array(clip["positions"]):
    rows = np.zeros((len(places), 5), dtype=np.float32)
    rows[:, :3] = 1000 * places
    writer.add_frames([(rows, np.zeros((0, 0)))])
with open(path, "wb") as file:
    writer.write(file)
with open(path, "rb") as file:
    reader = c3d.Reader(file)
    frames = [points[:, :3] for _, points, _ in reader.read_frames()]
    names = [label.strip() for label in reader.point_labels]
    see(names=names, fps=float(reader.point_rate), positions=np.array(frames, dtype=float))
