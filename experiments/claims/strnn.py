"""Rules of the claims S, of STRNN, as they are written in claims.yaml: see verdicts.py."""

from __future__ import annotations

from collections.abc import Iterable

from .verdict import NOT, PARTLY, REPRODUCED, Absent, Verdict

STARTS, FRAMES, WINDOWS = 50, 20_000, 512
CONTROLLED = 1_000  # frames of a run along a path
RIVALS = ("lstm-3lr", "erd", "seq2seq", "crbm", "6-gram", "gpdm")
SHORT = 10.0  # seconds; a cycle that is shorter is a loop that is seen


def _row(found: dict) -> dict:
    """The one network that a result is of, judged on test clips."""
    if found["split"] != "test" or len(found["rows"]) != 1:
        raise Absent("the result there is not of test clips, or of more than one network")
    return next(iter(found["rows"].values()))


# -- S1, S2, S8, S9, S10: ablations ---------------------------------------------------------------


LENGTHS = ("39_1", "35_5", "30_10", "20_20")  # that are read and foretold
SHORTER = ("20_20", "10_10", "5_5")


def _counts(found: dict) -> dict:
    if found["split"] != "test" or found["preset"] not in ("long", "table"):
        raise Absent("the result there is not of test clips, or of another preset than these")
    return found


def _rows(budgets: tuple[dict, ...], names: Iterable[str]) -> tuple[dict, dict]:
    """The first result, the longest budget coming first, in which all of these rows are; and its rows."""
    for found in map(_counts, budgets):
        if all(name in found["rows"] for name in names):
            return found, found["rows"]
    raise Absent("no result there has all rows that are compared")


def _pairs(budgets: tuple[dict, ...], claim: str) -> tuple[dict, dict]:
    """Pairs of a claim in the first result that has as many of them as any; and its numbers, and those
    of the other results beside them."""
    most = max(len(_counts(found)["pairs"][claim]) for found in budgets)
    judged = next(found for found in budgets if len(found["pairs"][claim]) == most)
    told = {}
    for found in (judged, *(its for its in budgets if its is not judged)):
        for pair, its in found["pairs"][claim].items():
            updates = _updates(found)
            told[f"{pair}, {updates} updates: {its['found']}, by"] = -its["difference"]["value"]
    return judged["pairs"][claim], told


def _updates(found: dict) -> int:
    """Of each training of a result."""
    return next(iter(found["rows"].values()))["seeds"]["0"]["updates"]


def _distance(row: dict, seed: str = "0") -> float:
    far = row["seeds"][seed]["to real"]
    return sum(far) / len(far)


def s1(limits: dict, *budgets: dict) -> Verdict:
    names = {length: f"Temporal_{length}_MSE" for length in LENGTHS}
    found, rows = _rows(budgets, names.values())
    error = {n: rows[name]["seeds"]["0"]["errors"]["all"] for n, name in names.items()}
    far = {n: _distance(rows[name]) for n, name in names.items()}
    fits = (error["20_20"] <= limits["less"] * error["30_10"]
            and error["30_10"] <= limits["less"] * error["35_5"])  # fmt: skip
    numbers = {"updates": _updates(found)}
    numbers |= {f"squared error, {n}": its for n, its in error.items()}
    numbers |= {f"manifold distance, {n}": its for n, its in far.items()}
    numbers["manifold distance of real motion"] = found["real"]["to real"]
    good = [fits, min(far, key=far.get) == "20_20"]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


def s2(limits: dict, *budgets: dict) -> Verdict:
    pairs, told = _pairs(budgets, "S2")
    results = [its["found"] for its in pairs.values()]
    nearer = results.count("better") / len(results)
    full = pairs["Composite_20_20_HY < Temporal_39_1_MSE"]["found"] == "better"
    if full and nearer >= limits["most"] and "worse" not in results:
        return Verdict(REPRODUCED, told)
    return Verdict(PARTLY if full or nearer >= 0.5 else NOT, told)


def s8(limits: dict, *budgets: dict) -> Verdict:
    pairs, told = _pairs(budgets, "S8")
    results = [its["found"] for its in pairs.values()]
    if results.count("better") == len(results):
        return Verdict(REPRODUCED, told)
    partly = "better" in results and "worse" not in results
    return Verdict(PARTLY if partly else NOT, told)


def s9(limits: dict, *budgets: dict) -> Verdict:
    names = {n: f"Composite_{n}_HY" for n in SHORTER}
    found, rows = _rows(budgets, (*names.values(), "Temporal_20_20_MSE", "unconditional"))
    pairs, told = _pairs((found,), "S9")
    far = {n: _distance(rows[name]) for n, name in names.items()}
    good = [
        all(its["found"] == "better" for its in pairs.values()),
        max(far["10_10"], far["5_5"]) <= limits["more"] * far["20_20"],
    ]
    numbers = told | {f"manifold distance, {n}": its for n, its in far.items()}
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


def s10_noise(limits: dict, *budgets: dict) -> Verdict:
    pairs, told = _pairs(budgets, "S10-noise")
    none, steady = (pairs[f"Temporal_20_20_MSE < {name}"]["found"]
                    for name in ("no noise", "steady noise"))  # fmt: skip
    if none == "better" and steady != "worse":
        return Verdict(REPRODUCED, told)
    return Verdict(PARTLY if "better" in (none, steady) else NOT, told)


def s10_backward(limits: dict, found: dict) -> Verdict:
    found, rows = _rows((found,), ("Temporal_20_20_MSE", "forwards"))
    both = [rows[name]["seeds"]["0"] for name in ("Temporal_20_20_MSE", "forwards")]
    numbers = {"updates": _updates(found)}
    numbers |= {f"validation loss of the other's, after {updates} updates": its / both[1]["curve"][updates]
                for updates, its in both[0]["curve"].items()}  # fmt: skip
    losses = [its for name, its in numbers.items() if "loss" in name]
    said = both[0]["errors"]["decoded"] / both[1]["errors"]["decoded"]
    numbers["squared error of frames said again, of the other's"] = said
    if max(*losses, said) <= limits["less"]:
        return Verdict(REPRODUCED, numbers)
    return Verdict(PARTLY if max(losses) < 1 else NOT, numbers)


def s10_narrow(limits: dict, *budgets: dict) -> Verdict:
    pairs, told = _pairs(budgets, "S10-narrow")
    wide = all(its["found"] == "better" for its in pairs.values())
    return Verdict(REPRODUCED if wide else NOT, told)


# -- S10: cells, attention, angles ----------------------------------------------------------------

PLAIN = "Temporal_20_20_MSE"


def _chosen(limits: dict, found: dict, name: str) -> tuple[list[tuple[dict, dict]], dict]:
    """Trainings without a choice and with it, by seed; and how many weights and seeds they have."""
    if found["split"] != "test" or found["preset"] != "table":
        raise Absent("the result there is not of test clips, or of another preset than table")
    if missing := [its for its in (PLAIN, name) if its not in found["rows"]]:
        raise Absent(f"the result there has no {', '.join(missing)}")
    one, other = (found["rows"][its] for its in (PLAIN, name))
    both = [
        (its, other["seeds"][seed]) for seed, its in one["seeds"].items() if seed in other["seeds"]
    ]
    if len(both) < limits["seeds"]:
        raise Absent("the result there is of fewer seeds than the rule asks for")
    return both, {
        "seeds": len(both),
        "weights": one["weights"],
        f"weights, {name}": other["weights"],
    }


def _nearer_and_truer(limits: dict, found: dict, name: str, error: str) -> Verdict:
    """Whether the row without a choice is nearer to real motion than that with it, and errs less."""
    both, numbers = _chosen(limits, found, name)
    pair = found["pairs"][f"{PLAIN} < {name}"]
    ratios = [one[error]["all"] / other[error]["all"] for one, other in both]
    numbers |= {f"nearer than {name} ({pair['found']}) by": -pair["difference"]["value"],
                f"{error}, of that of {name}, worst seed": max(ratios),
                **{f"movement over real, {title}": sum(its[i]["movement over real"] for its in both)
                   / len(both) for i, title in enumerate((PLAIN, name))}}  # fmt: skip
    good = [pair["found"] == "better", max(ratios) <= limits["less"]]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


def s10_gru(limits: dict, found: dict) -> Verdict:
    return _nearer_and_truer(limits, found, "GRU", "squared error")


def s10_angles(limits: dict, found: dict) -> Verdict:
    return _nearer_and_truer(limits, found, "angles", "joint error (cm)")


def s10_attention(limits: dict, found: dict) -> Verdict:
    both, numbers = _chosen(limits, found, "attention")
    per_move = lambda its: its["acceleration (m/s²)"] / its["movement (m/s)"]
    trained = [one["loss in training"] / other["loss in training"] for one, other in both]
    tested = [one["squared error"]["all"] / other["squared error"]["all"] for one, other in both]
    livelier = [other["acceleration (m/s²)"] / one["acceleration (m/s²)"] for one, other in both]
    restless = [per_move(other) / per_move(found["real"]) for _, other in both]
    numbers |= {
        "loss in training, of that with attention, worst seed": max(trained),
        "squared error, of that with attention, worst seed": max(tested),
        "acceleration with attention over without, least of seeds": min(livelier),
        "acceleration for a movement, over recorded, least of seeds": min(restless),
    }
    good = [max(*trained, *tested) <= limits["less"],
            min(livelier) >= limits["more"] and min(restless) > 1]  # fmt: skip
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


# -- S2: seams ------------------------------------------------------------------------------------


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


# -- S5, S6, S7 -----------------------------------------------------------------------------------


def s5(limits: dict, found: dict) -> Verdict:
    if found["split"] != "test" or found["frames"] < CONTROLLED:
        raise Absent("the result there is not of test clips, or of fewer frames than asked for")
    full, alone = found["rows"]["weights"], found["rows"]["weights, control alone"]
    numbers = {
        "runs": full["runs"], "alive": full["alive"],
        "root to path, median (cm)": full["root to path, median (cm)"],
        "root to path, worst (cm)": full["root to path, worst (cm)"],
        **{f"{what}, {title}": row[what]
           for what in ("foot skate (cm/s)", "bones, mean (cm)")
           for title, row in (("all costs", full), ("control alone", alone))},
    }  # fmt: skip
    cleaner = all(full[what] < alone[what] for what in ("foot skate (cm/s)", "bones, mean (cm)"))
    rms, alive = full["root to path, median (cm)"], full["alive"]
    if rms <= limits["rms"] and alive >= limits["alive"] and cleaner and full["weights restored"]:
        return Verdict(REPRODUCED, numbers)
    return Verdict(PARTLY if rms <= limits["far"] and alive > 0.5 else NOT, numbers)


def s6(limits: dict, found: dict) -> Verdict:
    if found["split"] != "test":
        raise Absent("the result there is not of test clips")
    rows = found["rows"]
    if missing := [name for name in RIVALS if name not in rows]:
        raise Absent(f"the result there has no {', '.join(missing)}")
    ours, rivals = rows["Composite_20_20_HY"], [rows[name] for name in RIVALS]
    first = {ms: ours[ms] < min(rival[ms] for rival in rivals) for ms in ours}
    numbers = {f"{name}, {ms}": rows[name][ms]
               for ms in ("80 ms", "320 ms", "560 ms") for name in ("Composite_20_20_HY", *RIVALS)}  # fmt: skip
    later = [won for ms, won in first.items() if int(ms.split()[0]) >= limits["later"]]
    verdict = REPRODUCED if all(first.values()) else PARTLY if all(later) else NOT
    return Verdict(verdict, numbers)


def s7(limits: dict, bench: dict, found: dict) -> Verdict:
    numbers = {
        "frames a second, 256 characters in open loop":
            bench["open_loop"]["frames_per_second"]["ours, 256 characters"],
        "frames a second, one character, under control":
            found["rows"]["weights"]["frames a second, one character"],
    }  # fmt: skip
    good = [its >= limits[key] for its, key in zip(numbers.values(), ("open", "controlled"),
                                                   strict=True)]  # fmt: skip
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


RULES = {
    "S1": s1, "S2": s2, "S2-seams": s2_seams, "S3": s3, "S3-noise": s3_noise, "S4": s4,
    "S4-filters": s4_filters, "S5": s5, "S6": s6, "S7": s7, "S8": s8, "S9": s9,
    "S10-noise": s10_noise, "S10-narrow": s10_narrow,
    "S10-backward": s10_backward, "S10-gru": s10_gru, "S10-attention": s10_attention,
    "S10-angles": s10_angles,
}  # fmt: skip
