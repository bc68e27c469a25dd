"""Every kept ratio measured anew, by the command that its result names, one after another.

    python benchmarks/remake.py [NAME ...] [--list]

NAME: of a result, such as bench_design; all of them if left out. Older builds that a command names by
their commit are checked out for the time. What needs more than this repository, a book of another build
or Blender, is named and left out: call its command yourself. Exit status 1 if a benchmark failed. Takes
hours on two cores; a busy machine slows both sides of a ratio, but let it rest all the same.
"""

from __future__ import annotations

import argparse
import json
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "results"
NEEDS = {"--book": "a built book of that commit", "--blender": "a Python that has bpy"}
COMMIT = re.compile(r"[0-9a-f]{7,40}")


def command_of(path: Path) -> list[str]:
    """Words of the command that made a result, without the program."""
    told = json.loads(path.read_text(encoding="utf-8")).get("command")
    words = shlex.split(told.replace("=", " "))[1:] if told else [f"benchmarks/{path.stem}.py"]
    return words + ["--save"] * ("--save" not in words)


def lacking(words: Sequence[str]) -> str:
    """What a command needs besides this repository; nothing: ''."""
    return ", ".join(what for option, what in NEEDS.items() if option in words)


def checked_out(words: Sequence[str], folder: Path) -> list[str]:
    """The same words, commits after ``--against`` as folders, which are checked out below `folder`."""
    found, against = [], False
    for word in words:
        against = word == "--against" or (against and not word.startswith("--"))
        if against and COMMIT.fullmatch(word):
            tree = folder / word
            if not tree.exists():
                git("worktree", "add", "--detach", str(tree), word)
            word = str(tree)
        found.append(word)
    return found


def git(*words: str) -> None:
    subprocess.run(["git", "-C", ROOT, *words], check=True, capture_output=True)


def remake(path: Path, folder: Path) -> int:
    """Run one; its exit status."""
    words = checked_out(command_of(path), folder)
    print(f"\n== {path.stem}: python {shlex.join(words)}", flush=True)
    return subprocess.run([sys.executable, *words], cwd=ROOT).returncode


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--list", action="store_true", help="show the commands, and stop")
    chosen = parser.parse_args(arguments)
    paths = {path.stem: path for path in sorted(RESULTS.glob("bench_*.json"))}
    if unknown := set(chosen.names) - set(paths):
        sys.exit(f"No result {', '.join(sorted(unknown))}; there are {', '.join(paths)}.")
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen.names or paths:
            words = command_of(paths[name])
            if lack := lacking(words):
                print(f"\n-- {name} is left out, it needs {lack}: python {shlex.join(words)}")
            elif chosen.list:
                print(f"python {shlex.join(words)}")
            elif remake(paths[name], Path(folder)):
                failed.append(name)
    git("worktree", "prune")
    if failed:
        sys.exit(f"\nfailed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
