"""Results made up for the rule of W9, which must never be a verdict on people."""

from experiments.claims.comparison import METHODS, PAIRS


def judged(low=0.1, high=0.3, p=0.001):
    """Every judge puts every pair alike, by a difference between low and high."""
    critic = {
        name: {"accuracy": {"value": 0.7, "low": 0.6, "high": 0.8}, "p": p} for name in METHODS
    }
    pair = {"value": (low + high) / 2, "low": low, "high": high}
    order = {"critic": dict.fromkeys(PAIRS, pair), "jerk": dict.fromkeys(PAIRS, pair)}
    return {"stands in": {gait: {"critic": critic, "order": order} for gait in ("walk", "run")}}


CASES = [
    ("W9", "not testable here", judged()),
    ("W9", "not testable here", judged(-0.3, -0.1)),
    ("W9", "not testable here", judged(-0.1, 0.1)),
    ("W9", "open", {"stands in": {"walk": {"critic": {}, "order": {}}}}),
]
