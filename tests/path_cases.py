"""Results made up for the rule of W5: it can say yes, and no."""


def following(ours=(0.7, 1.0), rival=2.0, high=0.9, sound=0.97, finished=1.0, circle=0.7, seeds=3):
    """Errors (cm) of ours on the sine, walking and running; `circle` that on the circle, walking."""
    gaits = {}
    for gait, error in zip(("walk", "run"), ours, strict=True):
        errors = {"circle 2 m, left": circle if gait == "walk" else error, "sine 1 m, left": error,
                  "spline 1": 5.0}  # fmt: skip
        rows = {name: [{"rms (cm)": value}] * seeds for name, value in errors.items()}
        theirs = {name: [{"rms (cm)": rival}] for name in errors}
        told = {"rms over PFNN's": {"value": high - 0.1, "low": high - 0.2, "high": high},
                "median": {"rms (cm)": {"value": error}},
                "without broken frames": sound, "finished": finished}  # fmt: skip
        gaits[gait] = {
            "curves": {"ours, refined and locked": rows, "PFNN, the authors'": theirs},
            "methods": {
                "ours, refined and locked": told,
                "PFNN, the authors'": {"median": {"rms (cm)": {"value": rival}}},
            },
        }
    return {"gaits": gaits}


CASES = [
    ("W5", "reproduced", following()),
    ("W5", "partly", following(sound=0.9)),
    ("W5", "partly", following(finished=0.9)),
    ("W5", "partly", following(ours=(0.7, 3.0))),
    ("W5", "partly", following(circle=3.0)),
    ("W5", "not reproduced", following(circle=3.0, high=1.1)),
    ("W5", "not reproduced", following(high=1.1)),
    ("W5", "not reproduced", following(ours=(3.0, 3.0), circle=3.0, high=1.1)),
    ("W5", "open", following(seeds=2)),
]
