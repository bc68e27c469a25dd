"""OpenSim: what its low-pass of 6 Hz leaves of a motion of 6 Hz, and which lost markers it reads."""

import json
import math

import opensim
from given import FOLDER

opensim.Logger.setLevelString("Off")
table = opensim.TimeSeriesTable()
table.setColumnLabels(["wave"])
for frame in range(1000):
    table.appendRow(frame / 100, opensim.RowVector([math.sin(2 * math.pi * 6 * frame / 100)]))
opensim.TableUtilities.filterLowpass(table, 6, False)
kept = [table.getRowAtIndex(frame)[0] for frame in range(300, 700)]


def reads(lost):
    """Whether a file is read in which a marker is lost in one frame."""
    rows = [["", "", ""] if marker == lost else ["1", "2", "3"] for marker in "ABC"]
    head = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"
    lines = [
        "PathFileType\t4\t(X/Y/Z)\tlost.trc",
        "\t".join(head.split()),
        "100\t100\t1\t3\tmm\t100\t1\t1",
        "Frame#\tTime\tA\t\t\tB\t\t\tC\t\t",
        "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in (1, 2, 3)),
        "",
        "\t".join(["1", "0.0", *sum(rows, [])]),
    ]
    path = FOLDER / "lost.trc"
    path.write_text("\n".join(lines) + "\n")
    try:
        opensim.TimeSeriesTableVec3(str(path))
    except RuntimeError:
        return False
    return True


print(
    json.dumps(
        {
            "OpenSim": (max(kept) - min(kept)) / 2,
            "reads, lost": {each: reads(each) for each in "ABC"},
        }
    )
)
