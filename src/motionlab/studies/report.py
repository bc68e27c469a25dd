"""An analysis in words and tables, as the command line prints it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .analysis import Analysis, Table
from .answers import LeftOut
from .ratings import Difference
from .study import RATINGS

SHOWN = 20  # files left out that are listed one by one
FEW = 6  # raters: of five all of one mind, no signed rank has p below 0.05
SIMULATED = "SIMULATED: a program made these answers; no person has judged anything."


def in_words(analysis: Analysis, out: Sequence[LeftOut]) -> str:
    """The whole report."""
    study = analysis.study
    head = [SIMULATED] if analysis.simulated else []
    who = "simulated rater" if analysis.simulated else "rater"
    head += [
        f"{study.title} (study {study.id}, {study.design}): {_count(analysis.raters, who)}, "
        f"{len(out)} files left out",
        f"{len(analysis.orders)} of {len(study.orders)} orders used; an answer took "
        f"{analysis.seconds:.1f} s (median)",
        "Rules, fixed before anybody answered:",
        *(f"  {rule}" for rule in study.rules.in_words()),
    ]
    if analysis.raters < FEW:
        head.append(f"{_count(analysis.raters, who)}: too few for any test to tell methods apart.")
    lines = [*head, ""]
    for table in analysis.tables:
        lines += [*_table(analysis, table), ""]
    scale = "ordinal" if study.design == RATINGS else "nominal"
    lines.append(
        f"Agreement between raters: {_number(analysis.agreement)} (Krippendorff's alpha, {scale})"
    )
    unit = "points" if study.design == RATINGS else "beyond half"
    for gait, count in analysis.needed.items():
        lines.append(
            f"To tell two methods {analysis.difference:g} {unit} apart in {gait}: {count} raters "
            "(power 0.8, level 0.05 over all pairs)"
        )
    if study.design == RATINGS:
        lines.append(
            "Intervals hold for these clips and people like these raters; 95 %, bootstrap."
        )
    else:
        lines.append("Strengths are log odds, all add up to 0; intervals 95 %, errors by rater.")
    if analysis.simulated:
        lines.append(SIMULATED)
    return "\n".join([*lines, *left_out(out)])


def left_out(out: Sequence[LeftOut]) -> list[str]:
    """The files that don't count, each with the reason; of very many the first, and counts."""
    lines = []
    for rule, title in ((False, "Left out:"), (True, "Left out by the rules:")):
        chosen = [left for left in out if left.rule == rule]
        if not chosen:
            continue
        lines += ["", title, *(f"  {left.file.name}: {left.why}" for left in chosen[:SHOWN])]
        if len(chosen) > SHOWN:
            lines.append(f"  and {len(chosen) - SHOWN} more; --out lists all")
    return lines


def _table(analysis: Analysis, table: Table) -> list[str]:
    study = analysis.study
    wide = max(len(name) for name in ["method", *study.methods])
    if study.design == RATINGS:
        lines = [f"{table.gait}", f"  {'method':{wide}}   mean     sd   95 % interval"]
        for name, row in zip(study.methods, table.rows, strict=True):
            lines.append(
                f"  {name:{wide}} {_number(row.mean):>6} {_number(row.sd):>6}   "
                f"{_number(row.low)} to {_number(row.high)}"
            )
    else:
        lines = [f"{table.gait}", f"  {'method':{wide}}  taken  strength   95 % interval"]
        for name, row in zip(study.methods, table.rows, strict=True):
            lines.append(
                f"  {name:{wide}} {row.share:>6.0%} {_number(row.strength):>9}   "
                f"{_number(row.low)} to {_number(row.high)}"
            )
        if math.isnan(table.rows[0].strength):
            lines.append(
                "  A method never won or never lost, so that strengths have no finite value."
            )
    return lines + [_compared(study.methods, each) for each in table.compared]


def _compared(methods: Sequence[str], each: Difference) -> str:
    a, b = methods[each.first], methods[each.second]
    told = ""
    if each.holm < 0.05:
        told = f": {a if each.mean > 0 else b} is judged better"
    return (
        f"  {a} - {b}: {each.mean:+.2f} [{_number(each.low)}, {_number(each.high)}], "
        f"p {_p(each.p)}, Holm {_p(each.holm)}{told}"
    )


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2f}"


def _p(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
