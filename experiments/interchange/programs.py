"""Motion through the field's programs and back: writes results/interchange.json.

    MOTIONLAB_DATA=folder python -m experiments.interchange.programs [--install] [--work FOLDER]

Each program of registry.toml is asked in an environment of its own under --work; --install makes
those that lack. Two clips go through, one recorded, one made (`clips`); `measure` says what arrives.
A program that is not there gets a row that says so.
"""

from __future__ import annotations

import argparse
import json
import platform
import re
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import motionlab

from ..common import record
from . import clips, environments, measure
from .environments import Program, Trap


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, default=Path("runs/interchange"))
    parser.add_argument("--install", action="store_true", help="install what is not there")
    parser.add_argument("--only", nargs="+", help="names of programs and traps to ask again")
    parser.add_argument("--output", default="results/interchange.json")
    chosen = parser.parse_args(arguments)
    begin, work = time.perf_counter(), chosen.work.resolve()
    given = [clips.known(), clips.real()]
    programs, traps = environments.registry()
    named = {each.name: each for each in (*programs, *traps)}
    if unknown := set(chosen.only or ()) - set(named):
        sys.exit(f"No program or trap {', '.join(sorted(unknown))}; there are {', '.join(named)}.")
    before = Path(chosen.output)
    kept = json.loads(before.read_text(encoding="utf-8")) if chosen.only and before.exists() else {}
    asked = chosen.only or list(named)
    needed = {named[each].program if each in {t.name for t in traps} else each for each in asked}
    there = {}
    for program in programs:
        if program.name in needed:
            if chosen.install and not environments.installed(program, work):
                environments.install(program, work)
            there[program.name] = environments.installed(program, work)
    rows, shown = kept.get("programs", {}), kept.get("traps", {})
    for each in asked:
        print(each, flush=True)
        if isinstance(named[each], Trap):
            shown[each] = trap(named[each], named[named[each].program], there, work)
        else:
            rows[each] = through(named[each], given, there[each], work)
    facts = {
        "command": " ".join(record.command()[:3]),  # where programs live is nobody's business
        "code_version": motionlab.__version__,
        "clips": {motion.name: about(motion) for motion in given},
        "machine": platform.platform(),
        "seconds": round(kept.get("seconds", 0) + time.perf_counter() - begin, 1),
    }
    order = lambda rows, of: {each.name: rows[each.name] for each in of if each.name in rows}
    record.write(
        facts | {"programs": order(rows, programs), "traps": order(shown, traps)}, chosen.output
    )


def about(motion: motionlab.Motion) -> dict:
    """What a clip is."""
    return {
        "source": motion.source or "made",
        "frames": len(motion),
        "fps": motion.fps,
        "joints": motion.skeleton.joints,
        "end sites": len(motion.skeleton.end_parents),
    }


def through(
    program: Program, given: list[motionlab.Motion], version: str | None, work: Path
) -> dict:
    """A program's rows: each of its ways, with each clip."""
    facts = {"title": program.title, "package": program.pin[0], "pinned": program.pin[1]}
    if version is None:
        return facts | {"installed": False}
    rows: list[dict] = []
    for way, words in program.ways.items():
        for motion in given:
            row = {"way": words, "clip": motion.name}
            rows.append(row | sent(program, way, motion, work))
    return facts | {"installed": True, "rows": rows}


def sent(program: Program, way: str, motion: motionlab.Motion, work: Path) -> dict:
    """What arrives of a motion, and what the program says to it."""
    words = re.sub(r"\W+", "-", f"{program.name} {way} {motion.name}")
    folder = work / "clips" / words
    shutil.rmtree(folder, ignore_errors=True)
    clips.lay(motion, folder)
    ended, _, err = environments.run(program, program.script, folder, way, work)
    if not ended:
        return {"failed": last(err)}
    try:
        found = measure.read(folder)
    except motionlab.MotionLabError as error:
        return {"unreadable": str(error).replace(f"{folder}/", "")}
    points = program.script in ("ezc3d_.py", "c3d_.py", "opensim_.py")
    return measure.compare(measure.Seen.of(motion, points), found) | {"said": warned(err)}


def trap(what: Trap, program: Program, there: dict[str, str | None], work: Path) -> dict:
    """What a trap's script prints as JSON."""
    facts = {"program": program.title, "packages": [*program.pip, *program.npm]}
    if there[program.name] is None:
        return facts | {"installed": False}
    folder = work / "clips" / f"trap-{what.name}"
    shutil.rmtree(folder, ignore_errors=True)
    clips.lay(clips.known(), folder)
    ended, out, err = environments.run(program, what.script, folder, "", work)
    if not ended:
        return facts | {"installed": True, "failed": last(err)}
    return facts | {"installed": True, "said": warned(err)} | json.loads(out.splitlines()[-1])


def last(text: str) -> str:
    """The line that says what failed: the last one that is not of a trace."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if re.match(r"[\w.]*Error", line)]
    return (errors or lines or ["said nothing"])[-1][:200]


def warned(text: str) -> list[str]:
    """Warnings among what a program said, without places in files."""
    lines = [line.strip() for line in text.splitlines() if re.search(r"warn|error", line, re.I)]
    return [
        re.sub(r"/\S+/|\s+", lambda at: "" if "/" in at[0] else " ", line)[:160]
        for line in lines[:3]
    ]


if __name__ == "__main__":
    record.run(main)
