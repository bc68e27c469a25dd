"""BVH files, good, odd and bad, made by code."""

from __future__ import annotations

import re

PLAIN = """HIERARCHY
ROOT Hips
{
  OFFSET 0.0 90.0 0.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Chest
  {
    OFFSET 0.0 20.0 1.0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT LeftArm
    {
      OFFSET 15.0 10.0 0.0
      CHANNELS 3 Xrotation Yrotation Zrotation
      End Site
      {
        OFFSET 60.0 0.0 0.0
      }
    }
    JOINT RightArm
    {
      OFFSET -15.0 10.0 0.0
      CHANNELS 3 Yrotation Zrotation Xrotation
      End Site
      {
        OFFSET -60.0 0.0 0.0
      }
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
1.5 90.0 -2.0 10.0 20.0 30.0 -5.0 4.0 3.0 70.0 -80.0 15.0 1.0 2.0 3.0
2.5 91.0 -1.0 11.0 21.0 31.0 -6.0 5.0 4.0 71.0 -81.0 16.0 2.0 3.0 4.0
3.5 92.0 0.0 12.0 22.0 32.0 -7.0 6.0 5.0 72.0 -82.0 17.0 3.0 4.0 5.0
"""
ROWS = PLAIN.index("1.5 90.0")
_ROW = "2.5 91.0 -1.0 11.0 21.0 31.0"
_ZXY = "CHANNELS 3 Zrotation Xrotation Yrotation"
_XYZ = "CHANNELS 3 Xrotation Yrotation Zrotation"
_SIX = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"


def line_of(text: str, part: str) -> int:
    return text.count("\n", 0, text.index(part)) + 1


def replaced(old: str, new: str, times: int = 1) -> str:
    assert old in PLAIN, old
    return PLAIN.replace(old, new, times)


def _columns(order: list[int], root_channels: str) -> str:
    """The root's columns in another order."""
    head, rows = PLAIN[:ROWS], PLAIN[ROWS:].splitlines()
    cells = [row.split() for row in rows]
    rows = [" ".join([row[i] for i in order] + row[6:]) for row in cells]
    head = head.replace(_SIX, f"CHANNELS 6 {root_channels}", 1)
    return head + "\n".join(rows) + "\n"


def six_channels(shifts: list[tuple[float, float, float]], joint: str = "Chest") -> str:
    """A joint with position channels too, shifted so in the three frames."""
    channels, column = {"Chest": (_ZXY, 6), "LeftArm": (_XYZ, 9)}[joint]
    position = "CHANNELS 6 Xposition Yposition Zposition"
    head = PLAIN[:ROWS].replace(channels, channels.replace("CHANNELS 3", position), 1)
    cells = [row.split() for row in PLAIN[ROWS:].splitlines()]
    rows = [
        " ".join(row[:column] + [f"{value:.6f}" for value in shift] + row[column:])
        for row, shift in zip(cells, shifts, strict=True)
    ]
    return head + "\n".join(rows) + "\n"


def without(dropped: set[int]) -> tuple[str, str]:
    """PLAIN without some of its 15 channels, and what that means: these at zero, or at the OFFSET."""
    lists = re.findall(r"CHANNELS \d (.*)", PLAIN)
    names = iter(range(15))
    kept = [[name for name in line.split() if next(names) not in dropped] for line in lists]
    lines = iter(" ".join(["CHANNELS", str(len(names)), *names]) for names in kept)
    head, rows = PLAIN[:ROWS], [row.split() for row in PLAIN[ROWS:].splitlines()]
    less = [[row[i] for i in range(15) if i not in dropped] for row in rows]
    zero = [
        [("90" if i == 1 else "0") if i in dropped else row[i] for i in range(15)] for row in rows
    ]
    join = lambda cells: "".join(" ".join(row) + "\n" for row in cells)
    return re.sub(r"CHANNELS.*", lambda _: next(lines), head) + join(less), head + join(zero)


def spellings() -> dict[str, str]:
    """What exporters write and other programs read, all of it with the motion of PLAIN."""
    head, rows = PLAIN[:ROWS], PLAIN[ROWS:].splitlines()
    one = "# made by hand\n"
    scale = head.replace(_SIX, _SIX.replace("6", "9") + " Xscale Yscale Zscale")
    wrapped = [" ".join(row.split()[i : i + 4]) for row in rows for i in range(0, 15, 4)]
    return {
        "lower case": PLAIN.replace("Hips", "@").lower().replace("@", "Hips")
        .replace("chest", "Chest").replace("leftarm", "LeftArm").replace("rightarm", "RightArm"),
        "keywords in upper case": replaced("Frame Time", "FRAME TIME").replace("Frames", "FRAMES"),
        "channels in upper case": PLAIN.replace("rotation", "ROTATION").replace("posit", "POSIT"),
        "channels in both cases": replaced("Zposition", "ZPosition").replace("Xrot", "xRot"),
        "no blanks after colons": PLAIN.replace(": ", ":"),
        "blanks before colons": PLAIN.replace(":", " :"),
        "no colons": PLAIN.replace(":", ""),
        "FrameTime": replaced("Frame Time", "FrameTime"),
        "comments": one + replaced("  JOINT Chest", "  // spine\n  JOINT Chest").replace(
            "20.0 1.0", "20.0 1.0 # up").replace("Frames", "\t" + one + "Frames"),
        "comments among the rows": head + one + rows[0] + "\n  //\n" + "\n".join(rows[1:]) + "\n#",
        "Frames after Frame Time": replaced("Frames: 3\n", "").replace(
            "0.0333333\n", "0.0333333\n\nFrames: 3\n# numbers\n"),
        "seconds": replaced("0.0333333", "0.0333333 sec"),
        "seconds, in one word": replaced("0.0333333", "0.0333333s"),
        "milliseconds": replaced("0.0333333", "33.3333 ms"),
        "a rate that is called one": replaced("0.0333333", "30 FPS"),
        "rows wrapped": head + "\n".join(wrapped) + "\n",
        "rows wrapped by joint": head + "\n\n".join(
            " ".join(row.split()[i:j]) for row in rows for i, j in ((0, 6), (6, 9), (9, 15))),
        "scale": scale + "\n".join(
            " ".join([*row.split()[:6], "1", "1.0", "1.0004", *row.split()[6:]]) for row in rows),
        "Ctrl-Z": PLAIN + "\x1a",
        "Ctrl-Z and blanks": PLAIN + "\n \x1a\r\n",
    }  # fmt: skip


def same_motion() -> dict[str, bytes]:
    """Files that hold the motion of PLAIN."""
    texts = {
        "plain": PLAIN,
        "CRLF": PLAIN.replace("\n", "\r\n"),
        "CR": PLAIN.replace("\n", "\r"),
        "mixed line ends": PLAIN.replace("\n", "\r\n", 20),
        "byte order mark": "\ufeff" + PLAIN,
        "tabs": PLAIN.replace("  ", "\t").replace(" ", "\t").replace("Frame\tTime", "Frame Time"),
        "many blanks": PLAIN.replace(" ", "   "),
        "blanks at line ends": PLAIN.replace("\n", " \t \n"),
        "blank lines": "\n\n" + PLAIN.replace("\n", "\n\n"),
        "very many blank lines": PLAIN + "\n" * 10_000,
        "no last line end": PLAIN.rstrip("\n"),
        "brace on the joint's line": PLAIN.replace("Chest\n  {", "Chest {").replace(
            "Site\n", "Site"
        ),
        "braces on one line": replaced("  }\n}\nMOTION", "}}\nMOTION"),
        "exponents and signs": replaced("1.5 90.0 -2.0", "+1.5e0 9E+1 -.2e+01"),
        "whole numbers": replaced("1.5 90.0 -2.0", "1.5 90 -2"),
        "rotations before positions": _columns(
            [3, 4, 5, 0, 1, 2],
            "Zrotation Xrotation Yrotation Xposition Yposition Zposition",
        ),
        "positions as Z, X, Y": _columns(
            [2, 0, 1, 3, 4, 5],
            "Zposition Xposition Yposition Zrotation Xrotation Yrotation",
        ),
        "rigid position channels": six_channels([(0, 20, 1)] * 3),
        "rigid position channels with noise": six_channels(
            [(0.0004, 20.0004, 1), (-0.0004, 19.9996, 1), (0, 20, 1)]
        ),
        "full turns": replaced("10.0 20.0 30.0", "370.0 -340.0 3630.0"),
        **spellings(),
    }
    files = {name: text.encode() for name, text in texts.items()}
    files["UTF-16"] = PLAIN.encode("utf-16")
    files["UTF-16 big-endian"] = b"\xfe\xff" + PLAIN.encode("utf-16-be")
    return files


def bad() -> dict[str, tuple[bytes, int, str]]:
    """Files that can't be read: bytes, the line to blame, words of the message."""
    chest = line_of(PLAIN, "JOINT Chest")
    first = line_of(PLAIN, "1.5 90.0")
    end = line_of(PLAIN, "MOTION")
    wobble = six_channels([(15, 10, 0), (15, 13, 0), (15, 10, 0)], "LeftArm")
    cases: dict[str, tuple[str, int, str]] = {
        "only blanks": (" \n\t\n", 1, "empty"),
        "other text": ("solid cube\n", 1, "HIERARCHY"),
        "no MOTION": (PLAIN[: PLAIN.index("MOTION")], end, "MOTION"),
        "two MOTION": (replaced("Frames: 3", "MOTION\nFrames: 3"), end + 1, "second MOTION"),
        "no Frames": (replaced("Frames: 3\n", ""), end + 1, "Frames:"),
        "no Frame Time": (replaced("Frame Time: 0.0333333\n", ""), end, "Frame Time"),
        "too few channels in a row": (
            replaced(" 16.0 2.0 3.0 4.0", ""),
            first + 1,
            "11 values for",
        ),
        "too many channels in a row": (replaced(_ROW, "1 " + _ROW), first + 1, "16 values for"),
        "too many in the first row": (replaced("1.5 90.0", "1.5 90.0 1"), first, "16 values for"),
        "channel count": (replaced(_ZXY, _ZXY.replace("3", "4")), chest + 3, "lists 3"),
        "channel count no number": (replaced(_ZXY, "CHANNELS"), chest + 3, "lists 0"),
        "unknown channel": (replaced("Zrotation Xrotation", "Wrotation Xrotation"), 5, "Wrotation"),
        "channel twice": (replaced(_ZXY, _ZXY.replace("X", "Z")), chest + 3, "twice"),
        "two rotations, three values": (
            replaced(_ZXY, "CHANNELS 2 Zrotation Xrotation"),
            first,
            "15 values for 14",
        ),
        "scale twice": (replaced(_ZXY, "CHANNELS 2 Xscale xScale"), chest + 3, "twice"),
        "no channels": (
            re.sub("CHANNELS.*", "CHANNELS 0", PLAIN[:ROWS]),
            end + 1,
            "no joint has a channel",
        ),
        "rows wrapped, one value less": (
            PLAIN[:ROWS] + PLAIN[ROWS:].replace(" 10.0 ", "\n").replace(" 11.0 ", "\n"),
            first,
            "3 values for 15",
        ),
        "rows wrapped, one row less": (
            PLAIN[:ROWS] + PLAIN[ROWS:].replace(" -5.0", "\n-5.0").replace(" -6.0", "\n-6.0")[:-50],
            first,
            "6 values for 15",
        ),
        "NaN": (replaced("21.0", "nan"), first + 1, "'nan'"),
        "indefinite": (replaced("21.0", "-1.#IND"), first + 1, "'-1.#IND'"),
        "infinite": (replaced("21.0", "inf"), first + 1, "'inf'"),
        "number too large": (replaced("21.0", "1e400"), first + 1, "'1e400'"),
        "number too large for float32": (replaced("21.0", "1e39"), first + 1, "'1e39'"),
        "text in numbers": (replaced("21.0", "twenty"), first + 1, "value 5, 'twenty'"),
        "underscore": (replaced("21.0", "2_1"), first + 1, "'2_1'"),
        "all True": (
            PLAIN[:ROWS] + "True " * 15 + "\n" + "False " * 15 + "\n" + "True " * 15,
            first,
            "'True'",
        ),
        "hash": (replaced("21.0", "#21.0"), first + 1, "'#21.0'"),
        "comment": (replaced("3.0 4.0 5.0\n", "3.0 4.0 5.0 # end\n"), first + 2, "'#'"),
        "quotes": (replaced("21.0", '"21.0"'), first + 1, "is not a number"),
        "decimal comma": (replaced("21.0", "21,0"), first + 1, "decimal point"),
        "decimal comma in OFFSET": (replaced("20.0 1.0", "20,0 1.0"), chest + 2, "decimal point"),
        "decimal comma in Frame Time": (replaced("0.0333333", "0,033"), end + 2, "decimal point"),
        "NaN in OFFSET": (replaced("0.0 20.0 1.0", "0.0 nan 1.0"), chest + 2, "'nan'"),
        "short OFFSET": (replaced("0.0 20.0 1.0", "0.0 20.0"), chest + 2, "2 numbers"),
        "no OFFSET": (replaced("    OFFSET 0.0 20.0 1.0\n", ""), chest + 3, "no OFFSET"),
        "two OFFSET": (replaced(_ZXY, f"OFFSET 1 2 3\n{_ZXY}"), chest + 3, "one too many"),
        "no CHANNELS, but values": (replaced(f"    {_ZXY}\n", ""), first - 1, "15 values for 12"),
        "no OFFSET and no CHANNELS": (
            replaced(f"    OFFSET 0.0 20.0 1.0\n    {_ZXY}\n", ""),
            chest + 2,
            "no OFFSET",
        ),
        "no channels, but values": (
            re.sub("CHANNELS.*", "CHANNELS 0", PLAIN),
            end + 1,
            "no joint has a channel",
        ),
        "two CHANNELS": (replaced(_ZXY, f"{_ZXY}\n{_ZXY}"), chest + 4, "one too many"),
        "zero frame time": (replaced("0.0333333", "0.0"), end + 2, "frame time is 0 s"),
        "negative frame time": (replaced("0.0333333", "-0.03"), end + 2, "fps="),
        "tiny frame time": (replaced("0.0333333", "1e-320"), end + 2, "frame time"),
        "a rate for a frame time": (replaced("0.0333333", "30"), end + 2, "a rate"),
        "milliseconds for a frame time": (replaced("0.0333333", "33.333"), end + 2, "fps=30."),
        "a unit of time that is none": (
            replaced("0.0333333", "0.03 days"),
            end + 2,
            "not a number",
        ),
        "endless frame time": (replaced("0.0333333", "inf"), end + 2, "'inf'"),
        "missing frame time": (replaced(" 0.0333333", ""), end + 2, "not a number"),
        "absurd frame count": (replaced("Frames: 3", "Frames: " + "9" * 5000), end + 1, "count"),
        "negative frame count": (replaced("Frames: 3", "Frames: -3"), end + 1, "no count"),
        "superscript frame count": (replaced("Frames: 3", "Frames: ²"), end + 1, "no count"),
        "no frames": (PLAIN[:ROWS].replace("Frames: 3", "Frames: 0"), end + 1, "no frames"),
        "no rows": (PLAIN[:ROWS], end + 2, "holds 0"),
        "joint name twice": (replaced("RightArm", "LeftArm"), 19, "first in line 10"),
        "joint inside itself": (replaced("JOINT LeftArm", "JOINT Chest"), 10, "twice"),
        "joint without name": (replaced("JOINT Chest", "JOINT"), chest, "no name"),
        "block before ROOT": (replaced("ROOT", "{\n}\nROOT"), 2, "'{' stands before ROOT"),
        "joint outside ROOT": (replaced("ROOT Hips", "JOINT Hips"), 2, "Hips"),
        "joint before ROOT": (
            replaced("ROOT", f"JOINT A\n{{\nOFFSET 0 0 0\n{_ZXY}\n}}\nROOT"),
            2,
            "A",
        ),
        "ROOT inside ROOT": (replaced("JOINT LeftArm", "ROOT LeftArm"), 10, "on a joint"),
        "second tree": (
            replaced("MOTION", f"ROOT B\n{{\nOFFSET 0 0 0\n{_SIX}\n}}\nMOTION"),
            end,
            "root='Hips'",
        ),
        "two trees of one name": (
            replaced("MOTION", f"ROOT Hips\n{{\nOFFSET 0 0 0\n{_SIX}\n}}\nMOTION"),
            end,
            "rename all but one",
        ),
        "joint inside End Site": (
            replaced(
                "OFFSET 60.0 0.0 0.0", f"OFFSET 60 0 0\nJOINT A\n{{\nOFFSET 0 0 0\n{_ZXY}\n}}"
            ),
            14,
            "JOINT",
        ),
        "End Site with CHANNELS": (
            replaced("OFFSET 60.0 0.0 0.0", f"OFFSET 60 0 0\n{_ZXY}"),
            17,
            "CHANNELS",
        ),
        "brace missing at the end": (replaced("}\nMOTION", "MOTION"), end - 1, "not closed"),
        "brace too many": (replaced("MOTION", "}\nMOTION"), end, "closes nothing"),
        "unknown keyword": (replaced("  JOINT Chest", "  BONE Chest"), chest, "'BONE'"),
        "joint after MOTION": (replaced("Frames: 3", "JOINT A\nFrames: 3"), end + 1, "'JOINT'"),
        "empty hierarchy": ("HIERARCHY\n" + PLAIN[PLAIN.index("MOTION") :], 2, "no ROOT"),
        "wobbling position channels": (wobble, 10, "'LeftArm' moves"),
        "very long line of numbers": (PLAIN + "1 " * 500_000, first + 3, "500000 values"),
        "very long word": (replaced("21.0", "7" * 500_000), first + 1, "too large"),
        "very long name of a channel": (replaced(_ZXY, "CHANNELS 1 " + "Z" * 10_000), 9, "unknown"),
        "short rows, very many": (PLAIN + "1\n" * 200_000, first + 3, "1 values"),
        "first row long, others short": (
            PLAIN[:ROWS] + "1 " * 50_000 + "\n" + "1\n" * 50_000,
            first,
            "50000 values",
        ),
    }
    files = {name: (text.encode(), line, words) for name, (text, line, words) in cases.items()}
    files["empty"] = (b"", 1, "empty")
    files["binary"] = (bytes(range(256)) * 40, 1, "binary")
    files["PNG"] = (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(100), 3, "binary")
    files["zero bytes in the middle"] = (
        PLAIN.encode().replace(b"21.0", b"\0\0\0\0"),
        first + 1,
        "binary",
    )
    files["UTF-16 without its mark"] = (PLAIN.encode("utf-16-le"), 1, "binary")
    files["UTF-16, cut inside a letter"] = (PLAIN.encode("utf-16")[:101], 5, "MOTION")
    return files


def _many(frames: int, joints: int, hierarchy: list[str]) -> bytes:
    row = " ".join(["0.5"] * (3 + 3 * joints))
    lines = ["HIERARCHY", *hierarchy, "MOTION", f"Frames: {frames}", "Frame Time: 0.01"]
    return "\n".join(lines + [row] * frames).encode()


def chain(joints: int, frames: int = 2) -> bytes:
    """Every joint hangs on the one before."""
    lines = []
    for i in range(joints):
        lines += [f"{'JOINT' if i else 'ROOT'} j{i}", "{", "OFFSET 0 0.01 0", _ZXY if i else _SIX]
    lines += ["End Site", "{", "OFFSET 0 1 0", "}"] + ["}"] * joints
    return _many(frames, joints, lines)


def star(joints: int, frames: int = 2) -> bytes:
    """Every joint hangs on the root."""
    lines = ["ROOT j0", "{", "OFFSET 0 0 0", _SIX]
    for i in range(1, joints):
        lines += [
            f"JOINT j{i}",
            "{",
            "OFFSET 0 1 0",
            _ZXY,
            "End Site",
            "{",
            "OFFSET 0 1 0",
            "}",
            "}",
        ]
    return _many(frames, joints, [*lines, "}"])
