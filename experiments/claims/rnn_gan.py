"""Rules of the claims W, of RNN-GAN, as they are written in claims.yaml: see verdicts.py."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from .verdict import GONE, NOT, PARTLY, REPRODUCED, UNTESTABLE, Absent, Verdict

# -- W1 -------------------------------------------------------------------------------------------


def w1_variety(limits: dict, samples: dict) -> Verdict:
    numbers, ratios = {}, []
    for gait, found in samples["variety"].items():
        for quantity, spreads in found["quantities"].items():
            ratio = spreads["samples"]["spread"] / spreads["the same again"]["spread"]
            numbers[f"{gait}, spread of {quantity.split(' (')[0]} over people's"] = ratio
            ratios.append(ratio)
        numbers[f"{gait}, sound samples"] = found["sound"]
    enough = sum(ratio >= limits["spread"] for ratio in ratios)
    verdict = REPRODUCED if enough == len(ratios) else PARTLY if enough >= limits["some"] else NOT
    sound = all(found["sound"] >= limits["inside"] for found in samples["variety"].values())
    if verdict == REPRODUCED and not sound:
        return Verdict(PARTLY, numbers, "too few of the samples are sound")
    return Verdict(verdict, numbers)


def w1_endless(limits: dict, samples: dict) -> Verdict:
    found = samples["endless"]
    low, high = found["alive, 95 %"]
    numbers = {
        "rollouts": found["rollouts"], "seconds each": found["seconds each"],
        "alive at the end": found["alive"], "alive, 95 % interval": f"{low:.3g} to {high:.3g}",
        **{f"{kind} rollouts": count for kind, count in found["failed"].items()},
    }  # fmt: skip
    if found["rollouts"] < 100 or found["seconds each"] < 600:
        raise Absent("the result there is of fewer or shorter rollouts than the rule asks for")
    if found["alive"] < limits["half"]:
        return Verdict(NOT, numbers)
    drift = found["last minute's speed over the first's"]
    few = ("in a loop", "same end as another", "standing about")
    numbers |= {"last minute's speed over the first's": drift, **{key: found[key] for key in few}}
    good = (
        found["alive"] >= limits["alive"]
        and abs(drift - 1) <= limits["drift"]
        and all(found[key] <= limits["few"] for key in few)
    )
    return Verdict(REPRODUCED if good else PARTLY, numbers)


def w1_likeness(limits: dict, samples: dict) -> Verdict:
    found = samples["likeness"]
    failed = found["failed in the first minute"]
    numbers = {"failed in the first minute": failed}
    if "samples over data" not in found:
        return Verdict(NOT, numbers)
    ratios = found["samples over data"]
    numbers |= {f"{key.split(' (')[0]} over the data's": ratio for key, ratio in ratios.items()}
    if failed > limits["failed"]:
        return Verdict(NOT, numbers)
    close = [
        abs(ratios["acceleration (m/s²)"] - 1) <= limits["acceleration"],
        abs(ratios["speed (m/s)"] - 1) <= limits["speed"],
    ]
    skate = ratios.get("foot skate (cm/s)")
    remark = f"speed and acceleration count; feet slide {skate:.1f} times as fast" if skate else ""
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(close)], numbers, remark)


def w1_novelty(limits: dict, samples: dict) -> Verdict:
    found = samples["novelty"]
    if not found:
        return Verdict(NOT, {}, "no rollout lasted a minute")
    far = found["median over that of held-out clips"]
    numbers = {"replays": found["replays"], "median distance over held-out clips'": far}
    good = [found["replays"] <= limits["replay"], far <= limits["far"]]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


# -- W2 -------------------------------------------------------------------------------------------

BETTER, LEANING, SAME, WORSE = "better", "leaning", "no different", "worse"


def compare(claimed: Sequence[float], other: Sequence[float], least: float) -> str:
    """How seeds of two rows differ, higher being better: see the rules of W2."""
    difference = sum(claimed) / len(claimed) - sum(other) / len(other)
    if math.isnan(difference) or abs(difference) < least:  # NaN: both sides fell apart
        return SAME
    if difference < 0:
        return WORSE
    return BETTER if min(claimed) > max(other) else LEANING


def liveliness(ratio: float | None) -> float:
    """How far from the data's acceleration, as a negative number: higher is better."""
    return -abs(math.log(ratio)) if ratio else -math.inf


def seeds(recipe: dict, row: str) -> list[dict]:
    """The runs of a row; raises Absent if there are fewer than three."""
    runs = recipe["rows"].get(row, {}).get("runs", [])
    if len(runs) < 3:
        raise Absent(f"row {row!r} has {len(runs)} of 3 seeds")
    return runs


def _fit(run: dict) -> float:
    """Log-likelihood; a training that fell apart before its first weights has none."""
    found = run.get("log-likelihood")
    return -math.inf if found is None else found


def _robustness(limits: dict, recipe: dict, claimed: str, other: str) -> Verdict:
    measures = {
        "seconds until failure": (
            lambda run: run.get("seconds until failure", 0.0), limits["seconds"]
        ),
        "liveliness": (
            lambda run: liveliness(run.get("acceleration over data")), limits["liveliness"]
        ),
    }  # fmt: skip
    return _rows(recipe, claimed, other, measures, _better_and_not_worse)


def _rows(
    recipe: dict, claimed: str, other: str, measures: dict, rule: Callable[[dict], str]
) -> Verdict:
    numbers, outcomes = {}, {}
    for measure, (of, least) in measures.items():
        values = {row: [of(run) for run in seeds(recipe, row)] for row in (claimed, other)}
        outcomes[measure] = compare(values[claimed], values[other], least)
        for row, found in values.items():
            numbers[f"{measure}, {row}"] = ", ".join(f"{value:.3g}" for value in found)
        numbers[f"{measure}: {claimed} is"] = outcomes[measure]
    return Verdict(rule(outcomes), numbers)


def _better_and_not_worse(outcomes: dict[str, str]) -> str:
    found = set(outcomes.values())
    if BETTER in found and WORSE not in found:
        return REPRODUCED
    return PARTLY if found & {BETTER, LEANING} else NOT


def w2_noise(limits: dict, recipe: dict) -> Verdict:
    return _robustness(limits, recipe, "table", "no noise")


def w2_rate(limits: dict, recipe: dict) -> Verdict:
    found = _robustness(limits, recipe, "30 fps", "120 fps")
    verdict = PARTLY if found.verdict == REPRODUCED else found.verdict
    minutes = recipe["rows"]["30 fps"]["minutes"]
    return Verdict(verdict, found.numbers | {"minutes of training clips": minutes}, "underpowered")


def w2_optimiser(limits: dict, recipe: dict) -> Verdict:
    measures = {"nats a frame": (_fit, limits["nats"])}
    verdict, numbers, _ = _rows(recipe, "RMSProp", "SGD", measures, _only)
    edges = []
    for row in ("RMSProp", "SGD"):
        tried = recipe["rows"][row]["learning rates"]  # rate as text: validation loss
        best = min(tried, key=lambda rate: math.inf if tried[rate] is None else tried[rate])
        numbers[f"learning rate of {row}"] = best
        order = sorted(tried, key=float)
        if best in (order[0], order[-1]):
            edges.append(f"the best learning rate of {row} is at the edge of those tried")
    return Verdict(verdict, numbers, "; ".join(edges))


def _only(outcomes: dict[str, str]) -> str:
    (outcome,) = outcomes.values()
    return {BETTER: REPRODUCED, LEANING: PARTLY}.get(outcome, NOT)


def w2_pretraining(limits: dict, recipe: dict) -> Verdict:
    measures = {
        "nats a frame": (_fit, limits["nats"]),
        "liveliness": (
            lambda run: liveliness(run.get("acceleration over data")), limits["liveliness"]
        ),
    }  # fmt: skip
    return _rows(recipe, "pretrained", "scratch", measures, _fit_and_not_worse)


def _fit_and_not_worse(outcomes: dict[str, str]) -> str:
    if outcomes["nats a frame"] == BETTER and outcomes["liveliness"] != WORSE:
        return REPRODUCED
    return PARTLY if set(outcomes.values()) & {BETTER, LEANING} else NOT


# -- W3, W4, W8, W10, W11 -------------------------------------------------------------------------


SKATE, JERK = "foot skate (cm/s)", "jerk (m/s³)"


def w3(limits: dict, found: dict) -> Verdict:
    numbers, near, told, moved = {}, {SKATE: [], JERK: []}, [], []
    for gait, its in found["gaits"].items():
        raw, refined = (its["variants"][name] for name in ("RNN", "GAN1"))
        for key, so_far in near.items():
            ratio = refined["distance from real over RNN's"][key]
            numbers[f"{gait}, {key.split(' (')[0]}: distance from real over RNN's"] = ratio["value"]
            so_far.append(ratio["value"] <= limits["left"])
        before, after = (abs(one["critic"]["value"] - 0.5) for one in (raw, refined))
        numbers[f"{gait}, critic's accuracy above one half, over RNN's"] = after / before
        told.append(1 - after / before >= limits["critic"])
        moved += [one["50%"] for one in refined["root moved (cm)"]]
    numbers["roots moved, the worst refiner's median (cm)"] = max(moved)
    good = [all(so_far) for so_far in near.values()]
    verdict = REPRODUCED if all(good) and all(told) else PARTLY if any(good) else NOT
    if verdict == REPRODUCED and max(moved) >= 5:
        return Verdict(PARTLY, numbers, "roots are moved too far")
    return Verdict(verdict, numbers)


def w4(limits: dict, found: dict) -> Verdict:
    numbers, nearer, critics, labels = {}, [], [], []
    for gait, its in found["gaits"].items():
        plain, contact = (its["variants"][name] for name in ("GAN1", "GAN2"))
        gain = its["GAN2's distance from real minus GAN1's"][SKATE]
        numbers[f"{gait}, foot skate: GAN2's distance from real minus GAN1's (cm/s)"] = gain[
            "value"
        ]
        numbers[f"{gait}, the same, 95 % interval"] = f"{gain['low']:.3g} to {gain['high']:.3g}"
        nearer.append(gain["high"] < 0)
        pair = [one["critic"]["value"] for one in (plain, contact)]
        numbers[f"{gait}, critic's accuracy, GAN1 and GAN2"] = f"{pair[0]:.3g}, {pair[1]:.3g}"
        critics.append(pair[1] <= pair[0])
        numbers[f"{gait}, F1 of labels"] = contact["labels"]["F1"]
        labels.append(contact["labels"]["F1"] >= limits["f1"])
    parts = [all(nearer), all(labels)]
    if all(parts) and all(critics):
        return Verdict(REPRODUCED, numbers)
    return Verdict(PARTLY if any(parts) else NOT, numbers)


def w4_generator(limits: dict, fit: dict, plain: dict, contact: dict) -> Verdict:
    gain = fit["contacts minus plain"]["own contacts"]
    skates = [
        samples["likeness"].get("samples", {}).get("foot skate (cm/s)")
        for samples in (plain, contact)
    ]
    if None in skates:
        return Verdict(NOT, {}, "no rollout of one of both lasted a minute")
    ratio = skates[1]["value"] / skates[0]["value"]
    numbers = {
        "gain (nats a frame)": gain["value"],
        "gain, 95 % interval": f"{gain['low']:.3g} to {gain['high']:.3g}",
        "gain with labels that look ahead": fit["contacts minus plain"]["labels"]["value"],
        "foot skate over the plain one's": ratio,
    }
    good = [gain["low"] > 0, ratio <= 1 - limits["skate"]]
    return Verdict((NOT, PARTLY, REPRODUCED)[sum(good)], numbers)


def w5(limits: dict, found: dict) -> Verdict:
    ours, rival = "ours, refined and locked", "PFNN, the authors'"
    numbers, held, middle, whole = {}, {}, {}, []
    for gait, its in found["gaits"].items():
        told, error = its["methods"][ours], "rms (cm)"
        seeds = {name: [row[error] for row in rows] for name, rows in its["curves"][ours].items()}
        if any(len(each) < 3 for each in seeds.values()):
            raise Absent("fewer than three seeds a curve")
        theirs = {name: rows[0][error] for name, rows in its["curves"][rival].items()}
        papers = [name for name in seeds if name.startswith(("circle", "sine"))]
        nearer = [sum(seeds[name]) / len(seeds[name]) < theirs[name] for name in papers]
        ratio = told["rms over PFNN's"]
        held[gait], middle[gait] = all(nearer), ratio["high"] < 1
        whole += [told["without broken frames"] >= limits["sound"]]
        whole += [told["finished"] >= limits["finished"]]
        numbers |= {
            f"{gait}: root mean square error, median (cm)": told["median"][error]["value"],
            f"{gait}: PFNN's": its["methods"][rival]["median"][error]["value"],
            f"{gait}: ours over PFNN's, median": ratio["value"],
            f"{gait}: the same, 95 % interval": f"{ratio['low']:.3g} to {ratio['high']:.3g}",
            f"{gait}: circles and sines on which ours is nearer": f"{sum(nearer)} of {len(nearer)}",
            f"{gait}: without broken frames": told["without broken frames"],
            f"{gait}: came to the end": told["finished"],
        }
    if set(held) != {"walk", "run"}:
        raise Absent("walking and running are both asked for")
    if all(held.values()) and all(middle.values()):
        if all(whole):
            return Verdict(REPRODUCED, numbers)
        return Verdict(PARTLY, numbers, "too many broken or unfinished motions")
    some = (held["walk"] and middle["walk"]) or all(middle.values())
    return Verdict(PARTLY if some else NOT, numbers)


def w6(limits: dict, found: dict) -> Verdict:
    if found["seeds"] < 20 or found["survival"]["minutes"] < 5:
        raise Absent("fewer than 20 seeds, or less than 5 minutes of random commands")
    if "astray" not in found["survival"]:
        raise Absent("measured before who runs away or glides was counted")
    share, errors, skates, sound = {}, [], [], []
    walking = lambda name: name.startswith(("45°", "90°", "179°"))
    for name, its in found["scripts"].items():
        ours = its["ways"]["futures"]
        share[name] = _succeeded(limits, its, ours["rows"])
        sound += [not row["broken frames"] for row in ours["rows"]]
        middle = ours["summary"]
        if walking(name):
            errors.append(_at_most(middle["direction error (°)"], limits["direction"]))
            skates.append(middle[SKATE])
        elif its["kind"] == "pace":
            errors.append(_at_most(middle["speed error"], limits["speed"]))
    skate = sorted(skates)[len(skates) // 2] / found["free"]["walk"][SKATE]
    rate = found["speed"]["futures, K 16"]["frames a second"]
    alive, whole = found["survival"]["alive"], sum(sound) / len(sound)
    numbers = {f"{name}: succeeded": each for name, each in share.items()} | {
        "foot skate over free refined samples'": skate, "without broken frames": whole,
        "alive after random commands": alive, "frames a second": rate,
        "errors after settling within the limits": f"{sum(errors)} of {len(errors)}",
    }  # fmt: skip
    strict = [name for name in share if name.startswith(("45°", "90°"))] + ["faster", "slower"]
    others = [name for name in share if name.startswith("179°")]
    others += ["start", "stop", "walk, run, walk"]
    fast = rate >= limits["fps"]
    good = all(share[name] >= limits["turns"] for name in strict)
    good &= all(share[name] >= limits["others"] for name in others)
    good &= all(errors) and skate <= limits["skate"] and whole >= limits["sound"]
    if good and fast and alive >= limits["alive"]:
        return Verdict(REPRODUCED, numbers)
    main = [n for n in share if n.startswith(("90°", "179°")) or n == "walk, run, walk"]
    some = fast and all(share[name] >= limits["others"] for name in main)
    return Verdict(PARTLY if some else NOT, numbers)


def _succeeded(limits: dict, its: dict, rows: list[dict]) -> float:
    """Share of a script's runs that succeed."""
    if its["kind"] == "stop":
        return sum(_at_most(row["left (m/s)"], limits["stands"]) for row in rows) / len(rows)
    latest = its["people's (s)"]["median"] + limits["late"]
    return sum(_at_most(row["settled (s)"], latest) for row in rows) / len(rows)


def _at_most(value: float | None, limit: float) -> bool:
    """What never came about is None."""
    return value is not None and value <= limit


def w8(limits: dict, found: dict) -> Verdict:
    hop = found["hop (m/s²)"]  # at the last recorded frame, and at the next
    zero, estimated = (hop[state][0] / hop["observed"][0] for state in ("zero", "estimated"))
    after = hop["estimated"][1] / hop["observed"][1]
    numbers = {
        "hop of the zero state over the warm one's": zero,
        "hop of the estimated state over the warm one's": estimated,
        "the same a frame later": after,
    }
    if zero < limits["hop"]:
        return Verdict(UNTESTABLE, numbers, "there is no hop to remove")
    if max(estimated, after) <= limits["smooth"]:
        return Verdict(REPRODUCED, numbers)
    gone = (zero - estimated) / (zero - 1)
    return Verdict(PARTLY if gone >= limits["part"] else NOT, numbers | {GONE: gone})


def w10(limits: dict, found: dict) -> Verdict:
    model, data = found["weights (bytes)"]["half"], found["data (bytes)"]
    numbers = {f"weights over data as {form}": model / size for form, size in data.items()}
    if all(model < size for size in data.values()):
        return Verdict(REPRODUCED, numbers)
    return Verdict(PARTLY if model < data["BVH files"] else NOT, numbers)


def w11(limits: dict, found: dict) -> Verdict:
    its = found["classifier"]["test"]
    one = its["effective styles of one"]
    each = [start["effective styles"] for start in found["ways"]["as it ships"].values()]
    mean = sum(each) / len(each)
    numbers = {
        "classifier's accuracy on held-out clips": its["accuracy"],
        "effective styles of clips of one style": one,
        "effective styles from one state, mean": mean,
        "the same, least and most": f"{min(each):.3g} to {max(each):.3g}",
    }
    if its["accuracy"] < limits["accuracy"]:
        return Verdict(UNTESTABLE, numbers, "the classifier errs too often")
    various = lambda value: value >= max(limits["styles"], limits["times"] * one)
    return Verdict(REPRODUCED if various(mean) else PARTLY if various(max(each)) else NOT, numbers)


RULES = {
    "W1-variety": w1_variety, "W1-variety-memory": w1_variety, "W1-endless": w1_endless, "W1-likeness": w1_likeness,
    "W1-novelty": w1_novelty, "W2-noise": w2_noise, "W2-rate": w2_rate,
    "W2-optimiser": w2_optimiser, "W2-pretraining": w2_pretraining, "W3": w3, "W4": w4,
    "W4-generator": w4_generator, "W5": w5, "W6": w6, "W8": w8, "W10": w10, "W11": w11,
}  # fmt: skip
