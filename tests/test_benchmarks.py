"""What benchmarks keep says where, when and how it was made, and nothing of anybody's folders."""

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "benchmarks" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def interleaved():
    return script("interleaved")


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


def test_all_results_are_remade_by_one_command(tmp_path, monkeypatch, capfd):
    remake = script("remake")
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    for folder in ("benchmarks", "results"):
        (tmp_path / folder).mkdir()
    shows = (
        "import sys, pathlib; print('ran', sys.argv[1:], pathlib.Path(sys.argv[2], 'old').exists())"
    )
    (tmp_path / "benchmarks" / "bench_a.py").write_text(shows)
    (tmp_path / "benchmarks" / "bench_b.py").write_text("raise SystemExit(3)")
    (tmp_path / "old").touch()
    subprocess.run([*git, "init", "-q"], check=True)
    subprocess.run([*git, "add", "."], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "x"], check=True)
    log = subprocess.run([*git, "log", "--format=%h"], check=True, capture_output=True, text=True)
    kept = {
        "bench_a": f"python benchmarks/bench_a.py --against={log.stdout.strip()} --save",
        "bench_b": None,  # an older result, without a command
        "bench_c": "python benchmarks/bench_c.py --blender python --save",
    }
    for name, command in kept.items():
        (tmp_path / "results" / f"{name}.json").write_text(json.dumps({"command": command}))
    monkeypatch.setattr(remake, "ROOT", tmp_path)
    monkeypatch.setattr(remake, "RESULTS", tmp_path / "results")
    with pytest.raises(SystemExit, match="failed: bench_b"):
        remake.main([])
    out = capfd.readouterr().out
    assert "'--save'] True" in out and "bench_c is left out, it needs a Python that has bpy" in out
    trees = subprocess.run([*git, "worktree", "list"], capture_output=True, text=True).stdout
    assert len(trees.splitlines()) == 1  # nothing is left behind
    with pytest.raises(SystemExit, match="No result bench_d; there are bench_a"):
        remake.main(["bench_d"])


def test_each_kept_command_is_of_a_script_that_there_is():
    remake = script("remake")
    for path in (ROOT / "results").glob("bench_*.json"):
        assert (ROOT / remake.command_of(path)[0]).exists(), path.name
