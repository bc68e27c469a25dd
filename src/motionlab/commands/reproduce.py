"""`motionlab reproduce`: run what a claim needs, in order, and say what came out."""

from __future__ import annotations

import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from ..errors import MotionLabError

BOOK = Path("experiments", "claims", "claims.yaml")  # in a clone


@dataclass
class Reproduce:
    """Run what claims of the papers need, in order, and print the verdicts; in a clone of the book.

    Which commands these are stands in experiments/claims/claims.yaml. Data and weights that are
    there are used; results are made anew.
    """

    claims: Positional[Annotated[tuple[str, ...], arg(metavar="ID")]]
    """As in the claim ledger; W1 is all that begin with W1-."""
    dry_run: bool = False
    """Show the commands only."""
    train: bool = False
    """Train the shipped weights that are not there. Takes hours; can be stopped and started again."""

    def run(self) -> None:
        root = _root()
        wanted, steps = _read(root, self.claims)
        for step in needed(steps, wanted, root, self.train):
            hours = f"   # about {step['hours']:g} hours on two cores" if "hours" in step else ""
            print(f"{step['command']}{hours}", flush=True)
            if not self.dry_run:
                _call(step["command"], root)
        verdicts = shlex.join(["python", "-m", "experiments.claims.verdicts", *self.claims])
        print(verdicts, flush=True)
        if not self.dry_run:
            _call(verdicts, root)


def needed(steps: list[dict], wanted: set[str], root: Path, train: bool) -> list[dict]:
    """Steps that make the wanted files, in their order, with those that these need.

    Raises
    ------
    MotionLabError : weights are absent, and it was not asked for training.
    """
    chosen, files = [], set(wanted)
    for step in reversed(steps):  # each stands behind what it needs
        made = step["makes"]
        there = (root / made).exists()
        if made not in files or (there and made not in wanted and not step.get("resumes")):
            continue
        if step.get("trains") and not train:
            raise MotionLabError(f"{made}: is not there; --train makes it, in hours.")
        chosen.insert(0, step)
        files.update(step.get("needs", ()))
    return chosen


def _read(root: Path, names: tuple[str, ...]) -> tuple[set[str], list[dict]]:
    """Result files of the named claims, and all steps."""
    try:
        import yaml
    except ModuleNotFoundError as error:
        raise MotionLabError("reproduce needs pyyaml: pip install 'motionlab[book]'.") from error
    book = yaml.safe_load((root / BOOK).read_text(encoding="utf-8"))
    wanted: set[str] = set()
    for name in names:
        found = [c for c in book["claims"] if c["id"] == name or c["id"].startswith(f"{name}-")]
        if not found:
            known = ", ".join(claim["id"] for claim in book["claims"])
            raise MotionLabError(f"There is no claim {name!r}; there are {known}.")
        results = [claim["result"] for claim in found if "result" in claim]
        if not results:
            raise MotionLabError(f"{name}: is open; its experiment is not there yet.")
        for result in results:
            files = [result] if isinstance(result, str) else result
            wanted |= {f"results/{file}.json" for file in files}
    return wanted, book["steps"]


def _root() -> Path:
    """The repository that we are in."""
    for folder in (Path.cwd(), *Path.cwd().parents):
        if (folder / BOOK).is_file():
            return folder
    raise MotionLabError(
        f"{Path.cwd()}: is not in a clone of the book, which has the experiments; go there first."
    )


def _call(command: str, root: Path) -> None:
    program, *rest = shlex.split(command)
    module = ["-m", "motionlab"] if program == "motionlab" else []
    found = subprocess.run([sys.executable, *module, *rest], cwd=root)
    if found.returncode:
        raise MotionLabError(f"{command}: ended with {found.returncode}; what it said is above.")
