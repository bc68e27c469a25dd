"""OpenSim: points as markers in millimetres in a TRC file, read and written by OpenSim."""

import opensim
from given import FOLDER, numbers, see

clip = numbers()
names, fps, positions = clip["points"], clip["fps"], clip["positions"]
rows = [
    "PathFileType\t4\t(X/Y/Z)\tclip.trc",
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
    f"{fps:g}\t{fps:g}\t{len(positions)}\t{len(names)}\tmm\t{fps:g}\t1\t{len(positions)}",
    "Frame#\tTime\t" + "\t\t\t".join(names),
    "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, len(names) + 1)),
    "",
]
for frame, points in enumerate(positions):
    numbers_of = "\t".join(f"{1000 * x:.6f}" for point in points for x in point)
    rows.append(f"{frame + 1}\t{frame / fps:.6f}\t{numbers_of}")
(FOLDER / "clip.trc").write_text("\n".join(rows) + "\n")
opensim.TRCFileAdapter.write(
    opensim.TimeSeriesTableVec3(str(FOLDER / "clip.trc")), str(FOLDER / "back.trc")
)
table = opensim.TimeSeriesTableVec3(str(FOLDER / "back.trc"))
times, count = table.getIndependentColumn(), table.getNumRows()
places = [
    [[row[i][axis] for axis in range(3)] for i in range(table.getNumColumns())]
    for row in map(table.getRowAtIndex, range(count))
]
rate = (count - 1) / (times[count - 1] - times[0])
see(names=list(table.getColumnLabels()), fps=rate, positions=places, start=times[0])
