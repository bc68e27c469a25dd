"""Sources whose clips are not one BVH file each: parts of a take, a person's skeleton beside a clip,
files that are published under other names."""

import hashlib
import shutil

import pytest
import tiny_acclaim
import torch
from tiny_bvh import tiny_bvh

from motionlab import datasets
from motionlab.__main__ import main
from motionlab.datasets import registry
from motionlab.errors import DataError

# requests leaves a socket to the garbage collector if the server says 404
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore:.*from frame 0 to frame 1"),  # the toy take begins at rest
]
UNIT = 0.0254 / 0.45  # metres
TAKE = tiny_bvh(200, 1)
AMC = tiny_acclaim.amc(tiny_acclaim.sway(30)).encode()
ASF = tiny_acclaim.asf().encode()
PUBLISHED = {"odd/take.txt": TAKE, "people/7/7_01.amc": AMC, "people/7.asx": ASF}
SOURCES = """
    [odd]
    title = "Odd"
    url = "{url}"
    home = ""
    units = {units}
    licence = "MIT"
    commercial = true
    citation = "nobody"
    quirks = []
    published = [
      ['(take)\\.bvh', 'odd/\\1.txt'],
      ['(\\d+)\\.asf', 'people/\\1.asx'],
      ['(\\d+)(_.*)', 'people/\\1/\\1\\2'],
    ]
    [odd.besides]
    7_ = {{ path = "7.asf", sha256 = "{hash}", bytes = {bytes} }}
    [examples]
    title = "none"
    clips = []
"""
ROWS = [
    ("7_01.amc", AMC, 28, 120, 2, "train"),
    ("take.bvh", TAKE, 100, 60, 1, "train"),
    ("take.bvh", TAKE, 40, 60, 150, "test"),
]


def sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


@pytest.fixture
def odd(toy, monkeypatch):
    """The data set "odd", on the server only."""
    lines = [registry._text("clips.tsv").splitlines()[0]]
    for path, data, frames, fps, skip, split in ROWS:
        row = ("odd", path, sha(data), len(data), frames, fps, skip, "walk", "normal", "", split)
        lines.append("\t".join(map(str, row)))
    texts = {
        "clips.tsv": "\n".join(lines) + "\n",
        "sources.toml": SOURCES.format(
            units=UNIT, url=toy.server.url, hash=sha(ASF), bytes=len(ASF)
        ),
    }
    monkeypatch.setattr(registry, "_text", texts.__getitem__)
    for cached in (registry._toml, registry.sources, registry.clips):
        cached.cache_clear()
    toy.server.files.update(PUBLISHED)
    return toy


def test_each_file_is_fetched_once_from_where_it_is(odd):
    motions = datasets.load("odd")
    assert sorted(odd.server.requests) == sorted(f"/{path}" for path in PUBLISHED)
    assert [(m.name, len(m), m.fps) for m in motions] == [
        ("7_01", 28, 120), ("take_0001-0101", 100, 60), ("take_0150-0190", 40, 60),
    ]  # fmt: skip
    assert datasets.info("odd").bytes == len(AMC) + len(ASF) + len(TAKE)


def test_parts_are_those_frames_and_again_from_the_cache(odd, tmp_path):
    path = tmp_path / "take.bvh"
    path.write_bytes(TAKE)
    whole = datasets.from_folder(tmp_path, units=UNIT, fps=60, pattern="take.bvh")[0]
    for _ in range(2):
        first, second = datasets.load("odd", clips=["take_0001-0101", "take_0150-0190"])
        for part, frames in ((first, slice(1, 101)), (second, slice(150, 190))):
            torch.testing.assert_close(
                part.positions(), whole[frames].positions(), atol=1e-5, rtol=0
            )
        odd.server.files.clear()  # what was read is kept
    assert [m.name for m in datasets.load("odd", "test")] == ["take_0150-0190"]


def test_a_skeleton_that_is_missing_or_damaged_is_told(odd, capsys):
    del odd.server.files["people/7.asx"]
    with pytest.raises(DataError, match=r"7\.asx failed .*404"):
        datasets.load("odd", clips=["7_01"])
    odd.server.files.update(PUBLISHED)
    assert main(["data", "fetch", "odd", "--yes"]) == main(["data", "verify", "odd"]) == 0
    assert "3 of 3 files right" in capsys.readouterr().out
    (odd.cache / "clips/odd/7.asf").write_bytes(b"rot")
    assert main(["data", "verify", "odd"]) == 1
    assert "7.asf: is not the file it should be" in capsys.readouterr().err


def test_files_at_hand_have_the_names_of_the_table(odd, monkeypatch):
    datasets.load("odd")
    shutil.copytree(odd.cache / "clips/odd", odd.folder / "odd")
    assert sorted(p.name for p in (odd.folder / "odd").iterdir()) == [
        "7.asf",
        "7_01.amc",
        "take.bvh",
    ]
    shutil.rmtree(odd.cache)
    odd.server.files.clear()
    monkeypatch.setenv("MOTIONLAB_DATA", str(odd.folder))
    assert len(datasets.load("odd")) == 3
