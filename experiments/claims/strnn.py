"""Rules of the claims S, of STRNN, as they are written in claims.yaml: see verdicts.py."""

from __future__ import annotations

from .verdict import NOT, PARTLY, REPRODUCED, Absent, Verdict

STARTS, FRAMES, WINDOWS = 50, 20_000, 512
SHORT = 10.0  # seconds; a cycle that is shorter is a loop that is seen


def _row(found: dict) -> dict:
    """The one network that a result is of, judged on test clips."""
    if found["split"] != "test" or len(found["rows"]) != 1:
        raise Absent("the result there is not of test clips, or of more than one network")
    return next(iter(found["rows"].values()))


# -- S2 -------------------------------------------------------------------------------------------


def s2_seams(limits: dict, found: dict) -> Verdict:
    row = _row(found)
    steps = {}
    for title, key in (("with", "open loop, noise 0"),
                       ("without", "open loop, noise 0, without residual")):  # fmt: skip
        if "steps across seams" not in row.get(key, {}):
            raise Absent(f"the result there has no open loop {title} the residual network")
        steps[title] = row[key]["steps across seams"]
    numbers = {f"step across seams over elsewhere, {t} residual network": its
               for t, its in steps.items()}  # fmt: skip
    good = [steps["with"] <= limits["steps"], steps["with"] < steps["without"]]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


# -- S3 -------------------------------------------------------------------------------------------


def s3(limits: dict, found: dict) -> Verdict:
    return _endless(limits, found, _row(found)["open loop, noise 0"])


def s3_noise(limits: dict, found: dict) -> Verdict:
    noises = [noise for noise in found["noise"] if noise]
    if len(noises) != 1:
        raise Absent("the result there is of no noise, or of several, so that one could be picked")
    return _endless(limits, found, _row(found)[f"open loop, noise {noises[0]:g}"])


def _endless(limits: dict, found: dict, loop: dict) -> Verdict:
    if found["starts"] < STARTS or found["frames"] < FRAMES:
        raise Absent("the result there is of fewer or shorter rollouts than the rule asks for")
    numbers = {
        "rollouts": found["starts"], "frames each": found["frames"],
        "alive at the end": loop["alive"],
        **{f"{kind} rollouts": count for kind, count in loop["failed"].items()},
    }  # fmt: skip
    if "periods (s)" not in loop:
        return Verdict(NOT, numbers)
    numbers |= {
        "in a loop of under 10 s, of those alive": short_loops(loop),
        "in any loop, of those alive": loop["in loops, of those alive"],
        "movement of the last minute over real": loop["movement, last minute, over real"],
        "largest share with the same end": loop["largest shared end"],
        "bones off, mean (cm)": loop["bones, mean (cm)"],
    }
    if loop["alive"] < limits["half"]:
        return Verdict(NOT, numbers)
    return Verdict(REPRODUCED if holds(limits, loop) else PARTLY, numbers)


def holds(limits: dict, loop: dict) -> bool:
    """Whether an open loop keeps all limits of S3, however long it is."""
    return (
        loop["alive"] >= limits["alive"]
        and short_loops(loop) <= limits["loops"]
        and loop["movement, last minute, over real"] >= limits["movement"]
    )


def short_loops(loop: dict) -> float:
    """Share of the rollouts that are alive which end in a cycle of under 10 s."""
    if not loop["periods (s)"]:
        return 0.0
    short = sum(period < SHORT for period in loop["periods (s)"])
    return loop["in loops, of those alive"] * short / len(loop["periods (s)"])


# -- S4 -------------------------------------------------------------------------------------------


def _denoised(found: dict) -> dict:
    if found["split"] != "test" or found["windows"] < WINDOWS:
        raise Absent("the result there is not of test clips, or of fewer windows than asked for")
    return found["rows"]


def s4(limits: dict, found: dict) -> Verdict:
    rows, numbers, good = _denoised(found), {}, []
    for bits in (3, 5):
        row = rows[f"positions 0.3, contacts {bits}"]
        numbers[f"squared error, contacts' noise {bits}, STRNN"] = row["strnn"]["squared error"]
        numbers[f"squared error, contacts' noise {bits}, SC"] = row["sc"]["squared error"]
        good.append(row["strnn"]["squared error"] <= limits["less"] * row["sc"]["squared error"])
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


def s4_filters(limits: dict, found: dict) -> Verdict:
    row = _denoised(found)["positions 0.3"]
    rivals = {name: row[name]["squared error"] for name in ("gaussian", "savitzky-golay")}
    error, best = row["strnn"]["squared error"], min(rivals.values())
    numbers = {
        "squared error, STRNN": error, "squared error, best tuned filter": best,
        "of the filter's": error / best,
        "squared error, best linear guess": row["wiener"]["squared error"],
        "squared error, doing nothing": row["nothing"]["squared error"],
        "clean windows said again, mean joint error (cm)":
            found["rows"]["clean"]["strnn, reconstructed"]["mean joint error (cm)"],
    }  # fmt: skip
    verdict = REPRODUCED if error <= limits["less"] * best else PARTLY if error < best else NOT
    return Verdict(verdict, numbers)


RULES = {
    "S2-seams": s2_seams, "S3": s3, "S3-noise": s3_noise, "S4": s4, "S4-filters": s4_filters,
}  # fmt: skip
