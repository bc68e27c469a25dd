"""The rule of the claim W9, as written in claims.yaml: see verdicts.py."""

from __future__ import annotations

from .verdict import UNTESTABLE, Absent, Verdict

PAIRS = ("GAN2 before GAN1", "GAN2 before RNN", "GAN1 before RNN")  # as people put them
METHODS = ("GAN2", "GAN1", "RNN")


def w9(limits: dict, found: dict) -> Verdict:
    """People are asked for, and none was: whatever stands in, it is no verdict."""
    numbers: dict[str, float | str] = {}
    as_people = decided = against = 0
    for gait, its in found["stands in"].items():
        for method in METHODS:
            row = its["critic"].get(method)
            if row is None:
                raise Absent(f"{gait}: no critic of {method}")
            p, end = row["p"], row["accuracy"]
            numbers[f"{gait}, {method}: critic's accuracy"] = end["value"]
            numbers[f"{gait}, {method}: the same, 95 % interval"] = (
                f"{end['low']:.3g} to {end['high']:.3g}"
            )
            numbers[f"{gait}, {method}: p of that accuracy by chance"] = p
        for judge, pairs in its["order"].items():
            said = [order_of(pairs[pair]) for pair in PAIRS]
            as_people += said.count("as people")
            against += said.count("the other way")
            decided += sum(word != "undecided" for word in said)
            numbers[f"{gait}, {judge}: pairs as people have them, the other way, undecided"] = (
                ", ".join(str(said.count(word)) for word in ("as people", "the other way",
                                                            "undecided"))
            )  # fmt: skip
    told = decided and as_people / decided
    numbers["pairs as people have them, of those decided"] = f"{as_people} of {decided}"
    numbers["pairs the other way"] = against
    agree = "agree" if told >= limits["agree"] and decided else "do not agree"
    return Verdict(
        UNTESTABLE, numbers, f"nobody has rated anything; machine judges {agree} with them"
    )


def order_of(pair: dict) -> str:
    """Of a difference in distance from real, second minus first, with its interval: who is nearer?

    An end that is no number decides nothing.
    """
    if pair["low"] is None or pair["high"] is None:
        return "undecided"
    if pair["low"] > 0:
        return "as people"
    return "the other way" if pair["high"] < 0 else "undecided"


RULES = {"W9": w9}
