"""What benchmarks keep says where, when and how it was made, and nothing of anybody's folders."""

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def interleaved():
    path = ROOT / "benchmarks" / "interleaved.py"
    spec = importlib.util.spec_from_file_location("interleaved", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_recorded_command_names_no_folder_of_a_machine(interleaved, tmp_path):
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run([*git, "init", "-q"], check=True)
    subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "x"], check=True)
    called = ["/some/where/bench_x.py", "--against", str(tmp_path), "--rounds=3", "--save"]
    words = interleaved.command(called).split()
    assert words[:3] == ["python", "benchmarks/bench_x.py", "--against"]
    assert re.fullmatch("[0-9a-f]{7,}", words[3]) and words[4:] == ["--rounds=3", "--save"]
    told = interleaved.command(["bench_x.py", f"--against={tmp_path}"])
    assert told.endswith(f"--against={words[3]}")
    program = str(tmp_path / "bin" / "python")
    assert interleaved.command(["bench_x.py", "--blender", program]).endswith(" --blender python")
    plain = tmp_path.parent / "plain"
    plain.mkdir()
    assert interleaved.command(["bench_x.py", "--against", str(plain)]).endswith("unknown")


def test_a_result_says_where_and_when_it_was_made(interleaved, tmp_path, monkeypatch):
    monkeypatch.setattr(interleaved, "RESULTS", tmp_path)
    monkeypatch.setattr(sys, "argv", ["benchmarks/bench_x.py", "--save"])
    interleaved.save("bench_x", {"ratio": 0.5})
    record = json.loads((tmp_path / "bench_x.json").read_text())
    assert record["command"] == "python benchmarks/bench_x.py --save" and record["ratio"] == 0.5
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", record["date"]) and record["cores"] >= 1


def test_no_kept_result_names_a_folder_of_a_machine():
    for path in (ROOT / "results").glob("bench_*.json"):
        command = json.loads(path.read_text(encoding="utf-8")).get("command", "")
        assert not re.search(r"(^|[\s=])(/|[A-Z]:|~)", command), path.name
