#!/usr/bin/env bash
# OpenSim reads a TRC file in which any marker is lost for a while, unless it is the last one.
#
# OpenSim 4.6 (the package opensim), Python 3.11. Seen November 2026.
#
# A marker that is lost has empty cells in TRC. OpenSim makes NaN of them, and of the last marker's too
# if each row ends with one more tab. Without that tab, as the format's rows end, a row whose last marker
# is lost is said to have a column too few, and the whole file is refused: "Unexpected number of columns".
# The same capture with its markers in another order is read.
# Who writes TRC for OpenSim: end each row with a tab, or put a marker last that is never lost.
#
# Guessed before it was run: empty cells are NaN, whichever marker's they are.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet opensim==4.6

cat >lost.py <<'PY'
import math

import opensim

opensim.Logger.setLevelString("Off")
HEAD = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"


def read(lost, end):
    """What OpenSim makes of three markers, one of them lost in the second of three frames."""
    names = ["A", "B", "C"]
    rows = [
        "PathFileType\t4\t(X/Y/Z)\tlost.trc",
        "\t".join(HEAD.split()),
        "100\t100\t3\t3\tmm\t100\t1\t3",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t" + end,
        "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in (1, 2, 3)) + end,
        "",
    ]
    for frame in range(3):
        cells = [["", "", ""] if (frame, name) == (1, lost) else ["1", "2", "3"] for name in names]
        rows.append("\t".join([str(frame + 1), f"{frame / 100}", *sum(cells, [])]) + end)
    with open("lost.trc", "w") as file:
        file.write("\n".join(rows) + "\n")
    try:
        row = opensim.TimeSeriesTableVec3("lost.trc").getRowAtIndex(1)
    except RuntimeError as error:
        return "refused: " + str(error).split("'lost.trc'. ")[1].split(" in line")[0]
    return "read, NaN: " + "".join(name for i, name in enumerate(names) if math.isnan(row[i][0]))


for end, words in (("", "as they are"), ("\t", "ended by a tab")):
    for lost in ("A", "B", "C"):
        print(f"rows {words}, {lost} lost: {read(lost, end)}")
PY
venv/bin/python lost.py | tee said.txt

diff said.txt - <<'EXPECTED'
rows as they are, A lost: read, NaN: A
rows as they are, B lost: read, NaN: B
rows as they are, C lost: refused: Unexpected number of columns
rows ended by a tab, A lost: read, NaN: A
rows ended by a tab, B lost: read, NaN: B
rows ended by a tab, C lost: read, NaN: C
EXPECTED
echo "As described: a file is refused for its last marker."
