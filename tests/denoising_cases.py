"""Results of the claims W7 and W8's cases, and what their rules say of them."""

NOISES = ("white, low", "white, mid", "white, high", "outliers, 1 %", "outliers, 5 %",
          "dropped frames", "gap")  # fmt: skip


def _cell(ratio, acceleration=1.0, skate=4.0, f1=0.95, gap=0.4, seen=9.0, high=None):
    of = lambda value: {"value": value}
    mean = lambda error, there: {
        "joint error (cm)": of(error), "error where it was hit (cm)": of(there),
        "acceleration over the truth's": of(acceleration), "contact F1": of(f1),
        "foot skate (cm/s)": of(skate),
    }  # fmt: skip
    methods = {
        "ours": mean(4 * ratio, 10 * gap), "kalman": mean(4, 10), "filled": mean(seen, 10),
        "as seen": mean(seen, 10),
    }  # fmt: skip
    methods["kalman"]["foot skate (cm/s)"] = of(10.0)
    ratio = {"value": ratio, "low": 0.9 * ratio, "high": high or 1.05 * ratio}
    return {"methods": {name: {"means": means} for name, means in methods.items()},
            "best filter": "kalman", "error over the best filter's": ratio}  # fmt: skip


def cleaned(walking=None, unseen=1.0, first=(2.0, 1.05), split="test", only=NOISES, **more):
    """All noises of a gait alike, but for walking with some noises, where `walking` holds."""
    fine = _cell(0.7, **more)
    kinds = {"running": dict.fromkeys(NOISES, fine), "unseen": dict.fromkeys(NOISES, _cell(unseen)),
             "walking": {n: walking if walking and n in only else fine for n in NOISES}}  # fmt: skip
    hop = {
        "zeros": {"frame 1": first[0], "middle": 1.0},
        "found": {"frame 1": first[1], "middle": 1.0},
    }
    return {"split": split, "kinds": kinds,
            "first frame": {"clips": 20, "acceleration over the truth's": hop}}  # fmt: skip


def hops(zero, estimated, after, clips=20):
    hop = {"zero": [zero, 1.0], "estimated": [estimated, after], "observed": [1.0, 1.0]}
    return {"clips": 100, "cases": {"clips": clips, "hop (m/s²)": hop}}


CASES = [
    ("W7", "reproduced", cleaned()),
    ("W7", "partly", cleaned(f1=0.89)),
    ("W7", "partly", cleaned(_cell(0.7, acceleration=1.2))),
    ("W7", "partly", cleaned(_cell(0.7, skate=11.0))),
    ("W7", "not reproduced", cleaned(_cell(0.7, seen=5.0))),
    ("W7", "not reproduced", cleaned(f1=0.5, skate=20.0, acceleration=0.5)),
    ("W7", "open", cleaned(split="val")),
    ("W7-filters", "reproduced", cleaned()),
    ("W7-filters", "partly", cleaned(_cell(0.85))),
    ("W7-filters", "partly", cleaned(gap=0.6)),
    ("W7-filters", "partly", cleaned(unseen=1.2)),
    ("W7-filters", "partly", cleaned(skate=6.0)),
    ("W7-filters", "partly", cleaned(_cell(1.05), only=("white, low",))),
    ("W7-filters", "not reproduced", cleaned(_cell(0.9, high=1.01), only=("white, mid",))),
    ("W7-filters", "open", cleaned(split="val")),
    ("W8-cases", "reproduced", hops(2.0, 1.1, 1.1)),
    ("W8-cases", "partly", hops(2.0, 1.1, 1.3)),
    ("W8-cases", "not reproduced", hops(2.0, 1.6, 1.0)),
    ("W8-cases", "not testable here", hops(1.2, 1.0, 1.0)),
    ("W8-cases", "not testable here", hops(2.0, 1.0, 1.0, clips=9)),
    ("W8-cases", "open", {"clips": 100}),
    ("W8-cleaning", "reproduced", cleaned()),
    ("W8-cleaning", "partly", cleaned(first=(2.0, 1.4))),
    ("W8-cleaning", "not reproduced", cleaned(first=(2.0, 1.6))),
    ("W8-cleaning", "not testable here", cleaned(first=(1.2, 1.0))),
]  # fmt: skip
