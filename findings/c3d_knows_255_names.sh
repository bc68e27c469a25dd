#!/usr/bin/env bash
# The package c3d has names for the first 255 markers of a capture and none for the rest.
#
# c3d 0.6.0, on a file of ezc3d 1.7.2, Python 3.11. Seen November 2026.
#
# A C3D parameter holds 255 entries; for more, the format goes on in LABELS2. ezc3d writes it so, and leaves
# it to its caller to join both. c3d's `point_labels` is LABELS alone, while its frames have all points.
# zip(reader.point_labels, points) silently ends at marker 255: of a body and face with 300 markers,
# 45 are gone. Who reads captures of many markers: join LABELS, LABELS2, ... and compare with `point_used`.
#
# Guessed before it was run: 300 names for 300 points from either of the two.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the packages.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet c3d==0.6.0 ezc3d==1.7.2

cat >names.py <<'PY'
import warnings

import c3d
import ezc3d
import numpy as np

out = ezc3d.c3d()
out["parameters"]["POINT"]["RATE"]["value"] = [100.0]
out["parameters"]["POINT"]["LABELS"]["value"] = [f"M{i:03d}" for i in range(300)]
points = np.ones((4, 300, 5))
points[0] = np.arange(300)[:, None]
out["data"]["points"] = points
out.write("many.c3d")

back = ezc3d.c3d("many.c3d")
point = back["parameters"]["POINT"]
print("ezc3d:", back["data"]["points"].shape[1], "points, names", end=" ")
print(*(len(point[key]["value"]) for key in point if key.startswith("LABELS")))
with open("many.c3d", "rb") as file, warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    reader = c3d.Reader(file)
    _, points, _ = next(reader.read_frames())
    names = list(reader.point_labels)
print("c3d:", len(points), "points, names", len(names), "the last", names[-1].strip())
print("c3d warns of names:", any("label" in str(each.message).lower() for each in said))
PY
venv/bin/python names.py | tee said.txt

diff said.txt - <<'EXPECTED'
ezc3d: 300 points, names 255 45
c3d: 300 points, names 255 the last M254
c3d warns of names: False
EXPECTED
echo "As described: 45 of 300 markers have no name."
