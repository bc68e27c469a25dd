"""Verdicts of the claims in claims.yaml, computed from results/ by the rules written there.

    python -m experiments.claims.verdicts [ID ...]

One function a claim, in rnn_gan.py, denoising.py, aclstm.py, strnn.py and comparison.py: it takes the claim's limits and its results, and
returns the verdict and the numbers that decided it. A result that is not there gives "open".
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

from . import aclstm, comparison, denoising, rnn_gan, strnn
from .verdict import BADGES, NOT, OPEN, VERDICTS, Absent, Verdict

__all__ = [
    "BADGES", "NOT", "VERDICTS", "Verdict", "claims", "judge", "results_of", "rule_of",
]  # fmt: skip

ROOT = Path(__file__).resolve().parents[2]
RULES = rnn_gan.RULES | denoising.RULES | aclstm.RULES | strnn.RULES | comparison.RULES


def claims() -> list[dict]:
    """Claims in the order of the file."""
    text = Path(__file__).with_name("claims.yaml").read_text(encoding="utf-8")
    return yaml.safe_load(text)["claims"]


def rule_of(claim: dict) -> str:
    """The rule with its limits filled in."""
    return claim["rule"].format(**claim["limits"]) if "rule" in claim else ""


def results_of(claim: dict) -> list[str]:
    """Files of results/ that settle a claim, without .json."""
    names = claim.get("result", [])
    return [names] if isinstance(names, str) else names


def judge(claim: dict, results: Path = ROOT / "results") -> Verdict:
    """The verdict on a claim."""
    if "rule" not in claim:
        return Verdict(OPEN, {}, "its rule is to be written before its run")
    found = []
    for name in results_of(claim):
        path = results / f"{name}.json"
        if not path.exists():
            return Verdict(OPEN, {}, f"no results/{name}.json yet")
        found.append(json.loads(path.read_text(encoding="utf-8")))
    try:
        return RULES[claim["id"]](claim["limits"], *found)
    except Absent as absent:
        return Verdict(OPEN, {}, str(absent))


def main(wanted: Sequence[str]) -> None:
    for name in wanted:
        if not any(matches(claim["id"], name) for claim in claims()):
            sys.exit(
                f"There is no claim {name!r}; there are {', '.join(c['id'] for c in claims())}."
            )
    for claim in claims():
        if wanted and not any(matches(claim["id"], name) for name in wanted):
            continue
        found = judge(claim)
        if found.verdict == OPEN and not wanted:
            print(f"{claim['id']:16} {OPEN}: {found.remark}")
            continue
        print(f"\n{claim['id']}: {found.verdict.upper()}. {claim['claim']}")
        if found.remark:
            print(f"  {found.remark}")
        for what, value in found.numbers.items():
            print(f"  {what}: {value if isinstance(value, str) else f'{value:.3g}'}")


def matches(identity: str, name: str) -> bool:
    """W1 names W1-variety too."""
    return identity == name or identity.startswith(f"{name}-")


if __name__ == "__main__":
    main(sys.argv[1:])
