"""Bad Acclaim files: an error that names file, line, fault and remedy, or the right motion."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import pytest
import tiny_acclaim as tiny
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionlab import read_amc, read_bvh
from motionlab.__main__ import main
from motionlab.errors import AmcError, BvhError
from motionlab.io.acclaim import parse_amc

AMC, ASF = tiny.amc(tiny.sway(4)), tiny.asf()
FIRST = AMC.split("\n")[4]  # the root's first row


def line_of(text: str, part: str) -> int:
    return text.count("\n", 0, text.index(part)) + 1


# What is in the file instead of what, in which line that is told (None: where it now stands), and
# how.
BAD_MOTION = [
    ("ltibia ", "ltiba ", None, "'ltiba' is no bone of {asf}; mend the line, or name the .asf"),
    ("ltibia ", "", line_of(AMC, "ltibia "), "values without a bone"),
    (FIRST, FIRST + " 1", None, "7 values for 'root', which has 6 (tx ty tz rx ry rz in {asf})"),
    (FIRST, "root 1 2 3", None, "3 values for 'root', which has 6"),
    (FIRST, "root", None, "0 values for 'root'"),
    (FIRST, FIRST.replace("16.5", "nan"), None, "value 2 of 'root', 'nan', is not a number"),
    (FIRST, FIRST.replace("16.5", "inf"), None, "value 2 of 'root', 'inf', is not a number"),
    (FIRST, FIRST.replace("16.5", "1e300"), None, "'1e300', is not a number or too large for one"),
    (FIRST, FIRST.replace("16.5", "16,5"), None, "'16,5', is not a number or too large for one; write a"),
    (FIRST, FIRST.replace("16.5", "1_6"), None, "value 2 of 'root', '1_6', is not a number"),
    (FIRST, FIRST.replace("16.5", "٣"), None, "is not a number"),
    (FIRST, FIRST + "\n" + FIRST, 6, "'root' is there twice in a frame; remove one"),
    ("\n2\n", "\n", None, "'root' is there twice in a frame"),
    ("\n1\n", "\n", 4, "a row stands before the first frame's number; write 1"),
    ("\n3\n", "\n1\n", None, "frame 1 comes after frame 2; frames must ascend"),
    ("\n3\n", "\n2\n", None, "frame 2 comes after frame 2"),
    ("\n3\n", "\n:DEGREES\n3\n", None, "':DEGREES' stands among the frames"),
    (":DEGREES", ":SAMPLES-PER-SECOND fast", None, "'fast' is no number of frames per second"),
    (":DEGREES", ":SAMPLES-PER-SECOND 0", None, "'0' is no number of frames per second"),
]  # fmt: skip
BAD_SKELETON = [
    (":hierarchy", "hierarchy", None, "'hierarchy' stands outside of a bone"),
    (ASF[ASF.index(":hierarchy") :], "", None, "there is no :hierarchy section before the file ends"),
    (ASF[: ASF.index(":hierarchy")], "", None, "there is no bone 'lowerback'; correct"),
    (ASF[ASF.index("    limits") :], "", None, "does not end; add 'end', or copy"),
    ("length 0.45", "length 0", None, "0 is no unit of length; write 'length 1.0'"),
    ("length 0.45", "length", None, "'length' is followed by 0 numbers; it needs one"),
    ("length 0.45", "length half", None, "'half' is not a number"),
    ("angle deg", "angle gon", None, "'gon' is no unit of angles; write 'deg' or 'rad'"),
    ("order TX TY TZ RX RY RZ", "order TX TY TZ RX RY RX", None, "is listed twice"),
    ("order TX TY TZ RX RY RZ", "order TX TY TZ L", None, "the root has no length"),
    ("   order TX TY TZ RX RY RZ\n", "", 1, "the :root section has no 'order'; add 'order TX"),
    ("axis XYZ", "axis XYX", None, "'XYX' is no order of axes; write one as XYZ"),
    ("position 0 0 0", "position 0 0", None, "'position' is followed by 2 numbers; it needs three"),
    ("name ltibia", "name lfemur", None, "bone 'lfemur' is there twice (first in line"),
    ("name ltibia", "name root", None, "bone 'root' is there twice"),
    ("     name ltibia\n", "", None, "the bone has no name; add what is missing"),
    ("direction 0 1 0", "direction 0 1", None, "'direction' is followed by 2 numbers"),
    ("direction 0 1 0", "direction 0 0 0", None, "'lowerback' has no direction but 0 0 0"),
    ("direction 0 1 0", "direction 0 nan 0", None, "'nan' is not a number"),
    ("     direction 0 1 0  \n", "", None, "bone 'lowerback' has no direction; add"),
    ("     length 7.7\n", "", None, "bone 'ltibia' has no length; add"),
    ("length 7.7", "length -7.7", None, "a bone's length is -7.7; it must not be negative"),
    ("axis 0.0 0.0 0.0  XYZ", "axis 0.0 0.0  XYZ", None, "'axis' is followed by 2 numbers"),
    ("axis 0.0 0.0 0.0  XYZ", "axis 0.0 0.0 0.0  XXZ", None, "'XXZ' is no order of axes"),
    ("dof ry rz", "dof ry sz", None, "'sz' is no degree of freedom; use rx ry rz"),
    ("dof ry rz", "dof ry ry", None, "a degree of freedom is listed twice"),
    ("    ltibia lfoot", "    ltibia lfoot rfoot", None, "'rfoot' already hangs on 'ltibia'"),
    ("    ltibia lfoot", "    ltibia root", None, "'root' already hangs on 'nothing'"),
    ("    ltibia lfoot", "    ltibia lfood", None, "there is no bone 'lfood'; correct the name"),
    ("    ltibia lfoot\n", "", None, "bone 'lfoot' does not hang on the root; name it in"),
    ("    lfemur ltibia\n", "    ltoes ltibia\n", None, "bone 'ltibia' does not hang on the root"),
    (ASF[ASF.index("  begin\n     id") : ASF.index(":hierarchy")], "", None, "there is no bone 'lowerback'"),
    ("  begin\n     id 1\n", "     id 1\n", None, "'id' stands outside of a bone; write 'begin'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "said"), BAD_MOTION)
def test_bad_motions_are_refused_with_line_and_remedy(old, new, line, said):
    refused(AMC.replace(old, new, 1), ASF, "x.amc", line, said)


@pytest.mark.parametrize(("old", "new", "line", "said"), BAD_SKELETON)
def test_bad_skeletons_are_refused_with_line_and_remedy(old, new, line, said):
    refused(AMC, ASF.replace(old, new, 1), "x.amc (its .asf)", line, said)


def refused(amc: str, asf: str, where: str, line: int | None, said: str) -> None:
    assert (amc, asf) != (AMC, ASF), "nothing is wrong with it"
    with pytest.raises(AmcError) as caught:
        parse_amc(amc.encode(), asf.encode(), "x.amc", fps=120)
    message = str(caught.value)
    assert said.replace("{asf}", "x.amc (its .asf)") in message
    found = re.match(rf"{re.escape(where)}, line (\d+): ", message)
    assert found, message
    if line is not None:
        assert int(found[1]) == line
    assert re.search(r"[;:,] \S.*\.$", message) and len(message) < 300, "no remedy"


def test_the_line_is_the_one_at_fault():
    row = AMC.split("\n")[41]
    bad = AMC.replace(row, row + "e")
    assert bad.count("\n") == AMC.count("\n") and bad != AMC
    refused(bad, ASF, "x.amc", 42, "is not a number")
    name = "     name rhand\n"
    bad = ASF.replace(name, name + "     name lhand\n")
    refused(AMC, bad, "x.amc (its .asf)", line_of(ASF, name) - 2, "'lhand' is there twice")


def test_a_motion_cut_between_any_two_words_is_refused_or_whole():
    """Of four frames: whole ones are read, a last one that is not whole is refused."""
    whole = {AMC.index(f"\n{number}\n"): number - 1 for number in (3, 4)} | {len(AMC) - 1: 4}
    found = {}
    for blank in re.finditer(r"\s", AMC[AMC.index("\n3\n") :]):
        place = AMC.index("\n3\n") + blank.start()
        try:
            found[place] = len(parse_amc(AMC[:place].encode(), ASF.encode(), "cut.amc", fps=120))
        except AmcError as error:
            assert re.match(r"cut\.amc, line \d+: .*is cut off", str(error)), error
    assert found == whole


@pytest.mark.parametrize(
    "data", [b"", b" \n", b":FULLY-SPECIFIED\n:DEGREES\n", b"\0\1", b"\xff\xfe"]
)
def test_nothing_in_it(data):
    with pytest.raises(AmcError, match=r"^x\.amc, line \d+: .*; .*\.$"):
        parse_amc(data, ASF.encode(), "x.amc")
    with pytest.raises(AmcError, match=r"^x\.amc \(its \.asf\), line \d+: .*; .*\.$"):
        parse_amc(AMC.encode(), data, "x.amc")


def test_options_that_make_no_sense():
    for wrong, said in (
        ({"fps": 0}, "fps=0 is not a positive number"),
        ({"units": "ells"}, "Unknown unit 'ells'"),
        ({"up": "w"}, "up='w' is no axis"),
        ({"rigid": "yes"}, "rigid='yes' is not known"),
        ({"root": "Hips"}, r"x\.amc: an \.amc file holds one body"),
        ({"roles": {"head": "Kopf"}}, r"x\.amc: .*no such joint"),
        ({"roles": {"nose": "head"}}, r"x\.amc: .*no role"),
    ):
        with pytest.raises(AmcError, match=said):
            parse_amc(AMC.encode(), ASF.encode(), "x.amc", **{"fps": 120, **wrong})


def test_skeletons_that_are_not_there(tmp_path, capsys):
    motion = tmp_path / "05_01.amc"
    with pytest.raises(AmcError, match="can't be opened"):
        read_amc(motion)
    with pytest.raises(AmcError, match="is not a path"):
        read_amc(None)
    motion.write_text(AMC, encoding="utf-8")
    with pytest.raises(AmcError, match=r"and none is there; put 05\.asf beside it, or name it"):
        read_amc(motion)
    for name in ("06.asf", "07.asf"):
        (tmp_path / name).write_text(ASF, encoding="utf-8")
    with pytest.raises(
        AmcError, match=r"of 2 \.asf files beside it none has its name; put 05\.asf"
    ):
        read_amc(motion)
    with pytest.raises(AmcError, match=r"08\.asf: can't be opened"):
        read_amc(motion, tmp_path / "08.asf")
    with pytest.raises(AmcError, match=r"06\.asf: is a skeleton without motion; name the \.amc"):
        read_amc(tmp_path / "06.asf")
    with pytest.raises(BvhError, match=r"05_01\.amc, line 1: .*read_amc"):
        read_bvh(motion)
    for wrong in (motion, tmp_path / "06.asf", tmp_path / "none.amc"):
        assert main(["info", str(wrong)]) == 1
        assert wrong.name in capsys.readouterr().err


def test_a_motion_of_another_skeleton():
    """One bone more or fewer degrees of freedom than the skeleton has, or hardly a bone of it."""
    other = [bone for bone in tiny.PERSON if "thumb" not in bone.name]
    refused(AMC, tiny.asf(other), "x.amc", None, "'lthumb' is no bone of {asf}")
    other = {"root": tiny.sway(1)[0]["root"], "head": [0.0, 0.0, 0.0]}
    refused(tiny.amc([other]), ASF, "x.amc", None, "most bones of {asf} have no row; name the .asf")


PLACES = st.tuples(
    st.sampled_from([0, 1]), st.integers(0, 12000), st.integers(0, 30),
    st.text(max_size=4) | st.sampled_from(
        ["", "\n", "nan", "-", "1e400", ",", "begin", "end", "#", ":", ":root", ":units\nlength 1e-9",
         "root", "lfemur", "\0", "0", "٣", "rx", "l", "é", "9" * 400, "\x85", "\u2028", "\r"]),
)  # fmt: skip


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(PLACES, max_size=4))
def test_whatever_is_in_the_files_is_read_or_refused(edits):
    texts = [AMC, ASF]
    for which, place, length, new in edits:
        at = place % len(texts[which])
        texts[which] = texts[which][:at] + new + texts[which][at + length :]
    amc, asf = (text.encode("utf-8", errors="surrogatepass") for text in texts)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            motion = parse_amc(amc, asf, Path("x.amc"))
        except AmcError as error:
            assert str(error).startswith("x.amc") and len(str(error)) < 400
        else:
            assert torch.isfinite(motion.positions()).all()
