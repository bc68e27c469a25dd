"""Rules of the claims Z, of acLSTM, as they are written in claims.yaml: see verdicts.py."""

from __future__ import annotations

from collections import Counter

from .verdict import NOT, PARTLY, REPRODUCED, UNTESTABLE, Absent, Verdict

DANCERS = ("martial", "indian", "hybrid", "walking")
LENGTHS = {1: "length-1", 2: "length-2", 5: "aclstm-indian", 10: "length-10"}
WAYS = {"frozen": "freeze", "diverged": "diverge", "off floor": "leave the floor"}
STARTS, FRAMES, SEEDS = 20, 20_000, 3


def _dancers(found: dict) -> dict[str, dict]:
    """The four dancers, all of them followed for as long as the rules ask."""
    _long_enough(found)
    dancers = {style: found["dancers"].get(f"aclstm-{style}") for style in DANCERS}
    missing = [style for style, its in dancers.items() if its is None]
    if missing:
        raise Absent(f"no dancer has been followed yet of: {', '.join(missing)}")
    return dancers


def _seeds(found: dict, row: str, count: int = 1) -> list[dict]:
    """What was found of the first seeds of a row; raises Absent if there are fewer."""
    seeds = found["rows"].get(row, {}).get("seeds", {})
    if any(str(seed) not in seeds for seed in range(count)):
        raise Absent(f"row {row!r} has {len(seeds)} of {count} seeds")
    return [seeds[str(seed)] for seed in range(count)]


def _long_enough(found: dict) -> None:
    if found["starts"] < STARTS or found["frames"] < FRAMES:
        raise Absent("the result there is of fewer or shorter rollouts than the rule asks for")


def _texts(values: list[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


# -- rollouts -------------------------------------------------------------------------------------


def z1_endless(limits: dict, found: dict) -> Verdict:
    dancers, numbers = _dancers(found), {}
    for style, its in dancers.items():
        cycling = its["cycles"]["either, of those alive"]  # None if none is alive
        numbers[f"{style}, alive at the end"] = its["alive"]
        if cycling is not None:
            numbers[f"{style}, in a loop or in the motion of another"] = cycling
    good = [its["alive"] >= limits["alive"] for its in dancers.values()]
    verdict = REPRODUCED if all(good) else PARTLY if any(good) else NOT
    same = [its["cycles"]["either, of those alive"] or 0.0 for its in dancers.values()]
    if verdict == REPRODUCED and max(same) > limits["same"]:
        return Verdict(PARTLY, numbers, "rollouts of a dancer fall into cycles")
    return Verdict(verdict, numbers)


def z1_plain(limits: dict, found: dict) -> Verdict:
    _long_enough(found)
    medians, numbers, remark = [], {}, ""
    for method, name in (("lstm-3lr", "LSTM-3LR"), ("aclstm", "acLSTM")):
        seeds = _seeds(found, f"{method}-indian", SEEDS)
        medians.append([its["median seconds until failure"] for its in seeds])
        numbers[f"{name}, median seconds until failure"] = _texts(medians[-1])
        ways = Counter(way for its in seeds for way in its["how"] if way)
        for way, count in ways.most_common():
            numbers[f"{name}, rollouts that first {WAYS[way]}"] = count
        if method == "lstm-3lr" and ways["diverged"] > ways["frozen"]:
            remark = (
                f"it fails that soon, but does not freeze: {ways['diverged']} of {ways.total()} "
                "rollouts come apart first"
            )
    plain, auto = medians
    good = [
        all(seconds < limits["soon"] for seconds in plain),
        # where both fail in their first frame, none of them lasted longer
        all(
            longer > 0 and longer >= limits["times"] * seconds
            for longer, seconds in zip(auto, plain, strict=True)
        ),
    ]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers, remark)


def z3(limits: dict, found: dict) -> Verdict:
    _long_enough(found)
    pairs, numbers = [], {}
    for style, count in {"indian": SEEDS, "martial": 1}.items():
        auto, plain = (
            [its["change"]["last minute"] for its in _seeds(found, f"{method}-{style}", count)]
            for method in ("aclstm", "lstm-3lr")
        )
        numbers[f"acLSTM, {style}, change over real"] = _texts(auto)
        numbers[f"LSTM-3LR, {style}, change over real"] = _texts(plain)
        pairs += zip(auto, plain, strict=True)
    if all(auto >= limits["moving"] and plain <= limits["still"] for auto, plain in pairs):
        return Verdict(REPRODUCED, numbers)
    more = all(auto > 0 and auto >= limits["times"] * plain for auto, plain in pairs)
    return Verdict(PARTLY if more else NOT, numbers)


def z4(limits: dict, found: dict) -> Verdict:
    if found["starts"] < STARTS:
        raise Absent("the result there is of fewer rollouts than the rule asks for")
    failed, lasted = {}, {}
    for method in ("aclstm", "seq2seq", "erd", "scheduled"):
        its = _seeds(found, f"{method}-indian")[0]["first 1000 frames"]
        failed[method], lasted[method] = its["failed"], its["mean seconds until failure"]
    numbers = {f"{method}, failed of 20": count for method, count in failed.items()}
    numbers |= {f"{method}, mean seconds until failure": mean for method, mean in lasted.items()}
    ours, mean = failed.pop("aclstm"), lasted.pop("aclstm")
    if ours <= limits["few"] and min(failed.values()) >= limits["most"]:
        return Verdict(REPRODUCED, numbers)
    return Verdict(PARTLY if mean > max(lasted.values()) else NOT, numbers)


def z7(limits: dict, found: dict) -> Verdict:
    dancers, numbers = _dancers(found), {}
    soon = f"recovered within {limits['soon']:g} s"
    its = {style: dancer["stagnations"] for style, dancer in dancers.items()}
    for style, pauses in its.items():
        numbers[f"{style}, stagnations"] = pauses["number"]
    dances = [pauses for style, pauses in its.items() if style != "walking"]
    count = sum(pauses["number"] - pauses["cut off"] for pauses in dances)
    if not count:
        return Verdict(UNTESTABLE, numbers, "no dance stagnates")
    share = sum(pauses[soon] for pauses in dances) / count
    numbers[f"of the dances', {soon}"] = share
    good = [share >= limits["recover"], its["walking"]["number"] == 0]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


# -- prediction -----------------------------------------------------------------------------------


def _errors(found: dict, row: str) -> list[float]:
    """Errors of a row's first seed at each time; infinite where a prediction was no number."""
    values = _seeds(found, row)[0]["errors (m)"]["value"]
    return [float("inf") if value is None else value for value in values]


def z2(limits: dict, found: dict) -> Verdict:
    methods = ("aclstm", "lstm-3lr", "erd", "seq2seq", "scheduled")
    table = {
        style: {method: _errors(found, f"{method}-{style}") for method in methods}
        for style in ("indian", "martial", "walking")
    }
    best = lambda style, at: min(methods, key=lambda method: table[style][method][at])
    worst = lambda style, at: max(methods, key=lambda method: table[style][method][at])
    most = sum(best("indian", at) == "aclstm" for at in range(8))
    largest = sum(worst(style, -1) == "seq2seq" for style in table)
    numbers = {
        "styles in which acLSTM is below LSTM-3LR at 80 ms":
            sum(rows["aclstm"][0] < rows["lstm-3lr"][0] for rows in table.values()),
        "styles in which seq2seq is best at 80 ms": sum(best(s, 0) == "seq2seq" for s in table),
        "styles in which seq2seq is worst at 640 ms": largest,
        "times at which acLSTM is best, Indian dance": most,
    }  # fmt: skip
    hold = sum(value >= least for value, least in zip(numbers.values(), (3, 3, 2, 4), strict=True))
    return Verdict(REPRODUCED if hold == 4 else PARTLY if hold >= 2 else NOT, numbers)


def z5(limits: dict, predicted: dict, found: dict) -> Verdict:
    _long_enough(found)
    errors = {n: sum(_errors(predicted, row)) / 8 for n, row in LENGTHS.items()}
    change = {n: _seeds(found, row)[0]["change"]["whole"] for n, row in LENGTHS.items()}
    numbers = {f"length {n}, mean error (m)": error for n, error in errors.items()}
    numbers |= {f"length {n}, motion change over real": value for n, value in change.items()}
    falls = errors[1] > errors[2] > errors[5] > errors[10]
    if falls and abs(change[10] - change[1]) > limits["change"] * change[1]:
        return Verdict(REPRODUCED, numbers)
    smallest = errors[10] < min(errors[n] for n in (1, 2, 5))
    return Verdict(PARTLY if smallest else NOT, numbers)


# -- both styles, and in real time ----------------------------------------------------------------


def z6(limits: dict, found: dict) -> Verdict:
    right, sound = found["right"]["mean"], found["until they fail"]
    share, both = sound["share of windows"], sound["visit both"]
    numbers = {"classifier is right on held-out windows": right}
    if len(found["rollouts"]) < STARTS or found["seconds of a rollout"] < 60:
        raise Absent("the result there is of fewer or shorter rollouts than the rule asks for")
    if right < limits["right"]:
        return Verdict(UNTESTABLE, numbers, "the styles can't be told apart")
    numbers |= {f"share of windows, {style}": its for style, its in share.items()}
    numbers["rollouts that visit both"] = both
    numbers["rollouts that visit both, before or after they fail"] = found["visit both"]
    if min(share.values()) < limits["share"]:
        return Verdict(NOT, numbers)
    return Verdict(REPRODUCED if both >= limits["both"] else PARTLY, numbers)


def z8(limits: dict, speed: dict, gltf: dict) -> Verdict:
    if speed["threads"] != 1 or speed["width"] != 1024:
        raise Absent("the speed is not that of 3 x 1024 on one thread")
    rates = speed["generation"]["frames_per_second"]
    numbers = {
        f"frames a second, weights in {kind} precision": rate for kind, rate in rates.items()
    }
    numbers |= {"machine": speed["machine"], "errors of the glTF file": gltf["errors"]}
    good = [max(rates.values()) >= limits["rate"], gltf["errors"] == 0]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


RULES = {
    "Z1-endless": z1_endless, "Z1-plain": z1_plain, "Z2": z2, "Z3": z3, "Z4": z4, "Z5": z5,
    "Z6": z6, "Z7": z7, "Z8": z8,
}  # fmt: skip
