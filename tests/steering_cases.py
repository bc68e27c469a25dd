"""Results made up for the rule of W6: it can say yes, and no."""

SCRIPTS = {
    **{f"{d}° {side}": "turn" for d in (45, 90, 179) for side in ("left", "right")},
    "faster": "pace", "slower": "pace", "walk, run, walk": "pace", "start": "pace", "stop": "stop",
    "slalom": "turn", "run, 90° left": "turn",
}  # fmt: skip


def steering(settled=1.5, left=0.05, error=5.0, pace=0.05, skate=6.0, alive=1.0, fps=60.0, seeds=20,
             late=None, broken=0):  # fmt: skip
    """`late` : a script that settles in one of two runs only."""
    scripts = {}
    for name, kind in SCRIPTS.items():
        row = {"settled (s)": settled, "left (m/s)": left, "broken frames": broken}
        slow = row | {"settled (s)": None, "left (m/s)": 0.4}
        middle = {"direction error (°)": error, "speed error": pace, "foot skate (cm/s)": skate}
        ours = {"rows": [row, slow if name == late else row], "summary": middle}
        scripts[name] = {"kind": kind, "ways": {"futures": ours}, "people's (s)": {"median": 1.0}}
    return {
        "seeds": seeds, "scripts": scripts, "free": {"walk": {"foot skate (cm/s)": 5.0}},
        "survival": {"alive": alive, "minutes": 5.0, "astray": 0},
        "speed": {"futures, K 16": {"frames a second": fps}},
    }  # fmt: skip


CASES = [
    ("W6", "reproduced", steering()),
    ("W6", "reproduced", steering(late="slalom")),
    ("W6", "partly", steering(left=0.2)),
    ("W6", "partly", steering(late="45° left")),
    ("W6", "partly", steering(error=9.0)),
    ("W6", "partly", steering(skate=7.0)),
    ("W6", "partly", steering(alive=0.9)),
    ("W6", "partly", steering(broken=3)),
    ("W6", "partly", steering(pace=None)),
    ("W6", "not reproduced", steering(late="179° right")),
    ("W6", "not reproduced", steering(settled=2.5)),
    ("W6", "not reproduced", steering(fps=20.0)),
    ("W6", "open", steering(seeds=5)),
]
