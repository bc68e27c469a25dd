"""Rules of the claims W7 and what hangs on them, and W8's cases, as written in claims.yaml: see verdicts.py."""

from __future__ import annotations

from .verdict import GONE, NOT, PARTLY, REPRODUCED, UNTESTABLE, Absent, Verdict

GAITS = ("walking", "running")
ERROR, SKATE = "joint error (cm)", "foot skate (cm/s)"
MID, HIGH, OUTLIERS = "white, mid", "white, high", "outliers, 5 %"


def _kinds(found: dict) -> dict:
    if found["split"] != "test":
        raise Absent("the result there is not of test clips")
    return found["kinds"]


def _mean(cell: dict, method: str, measure: str) -> float:
    return cell["methods"][method]["means"][measure]["value"]


# -- W7 -------------------------------------------------------------------------------------------


def _told(text: str, holds: bool) -> str:
    """A line of a rule with many, marked if it does not hold."""
    return text if holds else f"{text} (missed)"


def w7(limits: dict, found: dict) -> Verdict:
    kinds, numbers, lines, close = _kinds(found), {}, [], []
    for gait in GAITS:
        for noise in (MID, HIGH, OUTLIERS):
            cell = kinds[gait][noise]
            error = _mean(cell, "ours", ERROR) / _mean(cell, "as seen", ERROR)
            acceleration = _mean(cell, "ours", "acceleration over the truth's")
            skate, f1 = _mean(cell, "ours", SKATE), _mean(cell, "ours", "contact F1")
            these = {
                f"error {error:.2f} of the input's": error <= limits["close"],
                f"acceleration {acceleration:.2f} of the truth's":
                    abs(acceleration - 1) <= limits["smooth"],
                f"skate {skate:.1f} cm/s": skate <= limits["slide"],
                f"F1 {f1:.2f}": f1 >= limits["found"],
            }  # fmt: skip
            close.append(error <= limits["close"])
            lines += these.values()
            numbers[f"{gait}, {noise}"] = ", ".join(map(_told, these, these.values()))
    numbers["lines that hold"] = f"{sum(lines)} of {len(lines)}"
    some = all(close) and sum(lines) >= limits["some"] * len(lines)
    return Verdict(REPRODUCED if all(lines) else PARTLY if some else NOT, numbers)


def w7_filters(limits: dict, found: dict) -> Verdict:
    kinds, numbers, lines = _kinds(found), {}, []
    least = {"white, low": "low", MID: "less", HIGH: "less", "outliers, 1 %": "less",
             OUTLIERS: "less", "dropped frames": "less"}  # fmt: skip
    for gait in GAITS:
        for noise, limit in least.items():
            ratio = kinds[gait][noise]["error over the best filter's"]["value"]
            lines.append(ratio <= limits[limit])
            numbers[f"{gait}, {noise}: error over the best filter's"] = _told(
                f"{ratio:.2f}", lines[-1]
            )
        gap = kinds[gait]["gap"]
        there = "error where it was hit (cm)"
        across = _mean(gap, "ours", there) / _mean(gap, "filled", there)
        lines.append(across <= limits["gap"])
        numbers[f"{gait}, gap: error there over the shortest way's"] = _told(
            f"{across:.2f}", lines[-1]
        )
        for noise in (MID, HIGH):
            cell = kinds[gait][noise]
            skate = _mean(cell, "ours", SKATE) / _mean(cell, cell["best filter"], SKATE)
            lines.append(skate <= limits["skate"])
            numbers[f"{gait}, {noise}: skate over the best filter's"] = _told(
                f"{skate:.2f}", lines[-1]
            )
    worst = max(cell["error over the best filter's"]["value"] for cell in kinds["unseen"].values())
    lines.append(worst <= limits["unseen"])
    numbers["unseen kinds, worst noise: error over the best filter's"] = _told(
        f"{worst:.2f}", lines[-1]
    )
    numbers["lines that hold"] = f"{sum(lines)} of {len(lines)}"
    sure = all(
        kinds[gait][noise]["error over the best filter's"]["high"] < 1
        for gait in GAITS for noise in (MID, HIGH, OUTLIERS)
    )  # fmt: skip
    return Verdict(REPRODUCED if all(lines) else PARTLY if sure else NOT, numbers)


# -- W8 -------------------------------------------------------------------------------------------


def w8_cases(limits: dict, found: dict) -> Verdict:
    if "cases" not in found:
        raise Absent("the result there was made before there were cases")
    cases = found["cases"]
    numbers = {"clips with a hop": cases["clips"], "clips in all": found["clips"]}
    if cases["clips"] < limits["clips"]:
        return Verdict(UNTESTABLE, numbers, "there are hardly any hops to remove")
    hop = cases["hop (m/s²)"]
    zero, estimated = (hop[state][0] / hop["observed"][0] for state in ("zero", "estimated"))
    after = hop["estimated"][1] / hop["observed"][1]
    numbers |= {
        "hop of the zero state over the warm one's": zero,
        "hop of the estimated state over the warm one's": estimated,
        "the same a frame later": after,
    }
    return _removed(limits, zero, estimated, max(estimated, after), numbers)


def w8_cleaning(limits: dict, found: dict) -> Verdict:
    _kinds(found)
    hop = found["first frame"]["acceleration over the truth's"]
    middle = hop["zeros"]["middle"]
    zeros, state = hop["zeros"]["frame 1"] / middle, hop["found"]["frame 1"] / middle
    numbers = {
        "clips": found["first frame"]["clips"],
        "hop at frame 1 with zeros, over the middle's": zeros,
        "the same with the state found": state,
    }
    return _removed(limits, zeros, state, state, numbers)


def _removed(limits: dict, zero: float, estimated: float, worst: float, numbers: dict) -> Verdict:
    """Whether a hop that is there with zeros is gone; ratios over what has none."""
    if zero < limits["hop"]:
        return Verdict(UNTESTABLE, numbers, "there is no hop to remove")
    gone = (zero - estimated) / (zero - 1)
    numbers |= {GONE: gone}
    if worst <= limits["smooth"]:
        return Verdict(REPRODUCED, numbers)
    return Verdict(PARTLY if gone >= limits["part"] else NOT, numbers)


RULES = {
    "W7": w7, "W7-filters": w7_filters, "W8-cases": w8_cases, "W8-cleaning": w8_cleaning,
}  # fmt: skip
