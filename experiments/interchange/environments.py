"""Where programs live: each in a folder of its own, installed as pinned, or not there."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).parent
SECONDS = 600  # for one run of one script


@dataclass(frozen=True)
class Program:
    """A program of registry.toml; one without script is there for traps alone."""

    name: str
    title: str
    script: str = ""
    ways: dict[str, str] = field(default_factory=dict)
    pip: tuple[str, ...] = ()
    npm: tuple[str, ...] = ()

    @property
    def pin(self) -> tuple[str, str]:
        """Package and version."""
        package, _, version = (self.pip or self.npm)[0].replace("==", "@").rpartition("@")
        return package, version


@dataclass(frozen=True)
class Trap:
    """A script of registry.toml that shows one thing to know."""

    name: str
    program: str
    script: str


def registry() -> tuple[list[Program], list[Trap]]:
    """What registry.toml lists."""
    listed = tomllib.loads((HERE / "registry.toml").read_text(encoding="utf-8"))
    programs = [Program(name, **what) for name, what in listed["program"].items()]
    return programs, [Trap(name, **what) for name, what in listed.get("trap", {}).items()]


def installed(program: Program, work: Path) -> str | None:
    """The version that is there, None if it is another than the pinned one, or none."""
    package, version = program.pin
    if program.npm:
        about = work / program.name / "node_modules" / package / "package.json"
        there = about.exists() and json.loads(about.read_text(encoding="utf-8"))["version"]
    else:
        ask = f"import importlib.metadata as m; print(m.version({package!r}))"
        python = interpreter(program, work)
        there = python.exists() and said([python, "-c", ask], work)[1].strip()
    return version if there == version else None


def interpreter(program: Program, work: Path) -> Path:
    """What runs a program's scripts."""
    if program.npm:
        return Path(shutil.which("node") or "node")
    inner = ("Scripts", "python.exe") if os.name == "nt" else ("bin", "python")
    return work.joinpath(program.name, *inner)


def install(program: Program, work: Path) -> None:
    """Put a program into its folder, from the registries that pip and npm are set to."""
    folder = work / program.name
    if program.npm:
        folder.mkdir(parents=True, exist_ok=True)
        npm = shutil.which("npm") or sys.exit("npm is not there; install node.")
        subprocess.run([npm, "install", "--silent", "--prefix", folder, *program.npm], check=True)
        return
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    pip = [interpreter(program, work), "-m", "pip", "install", "--quiet", *program.pip]
    subprocess.run(pip, check=True)


def run(program: Program, script: str, folder: Path, way: str, work: Path) -> tuple[bool, str, str]:
    """Run a script of inside/ in a program's folder: whether it came to its end, and what it said on
    its two streams. `folder` is where it finds a clip and leaves what it saw."""
    home = work / program.name
    for path in (HERE / "inside").iterdir():  # node looks for packages beside the script
        if path.suffix in (".py", ".mjs"):
            shutil.copy(path, home / path.name)
    ended, out, err = said([interpreter(program, work), home / script, folder, way], folder)
    return ended, out, err


def said(command: list, where: Path) -> tuple[bool, str, str]:
    """Whether a command succeeded, and its two streams."""
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    try:
        ran = subprocess.run(
            command, cwd=where, env=clean, capture_output=True, text=True, errors="replace",
            timeout=SECONDS,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        return False, "", str(error)
    return ran.returncode == 0, ran.stdout, ran.stderr
