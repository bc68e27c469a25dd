"""Results made up for the rules of the claims Z: each can say yes, and no."""

STYLES = ("martial", "indian", "hybrid", "walking")


# -- rollouts -------------------------------------------------------------------------------------


def followed(rows=(), dancers=(), starts=20, frames=20_000):
    """results/dances_rollouts.json, of rows: what is found of each seed, and of dancers."""
    rows = {
        name: {"seeds": {str(i): one for i, one in enumerate(its)}}
        for name, its in dict(rows).items()
    }
    return {"starts": starts, "frames": frames, "rows": rows, "dancers": dict(dancers)}


def endless(alive=(1.0,) * 4, cycling=(0.0,) * 4, styles=STYLES, **settings):
    return followed(dancers={
        f"aclstm-{style}": {"alive": a, "cycles": {"either, of those alive": c}}
        for style, a, c in zip(styles, alive, cycling, strict=False)}, **settings)  # fmt: skip


def plain(rnn, auto):
    of = lambda its: [{"median seconds until failure": t, "how": ["frozen", None]} for t in its]
    return followed({"lstm-3lr-indian": of(rnn), "aclstm-indian": of(auto)})


def moving(auto, rnn, martial=(1.0, 0.01)):
    of = lambda its: [{"change": {"last minute": value}} for value in its]
    return followed({
        "aclstm-indian": of(auto), "lstm-3lr-indian": of(rnn),
        "aclstm-martial": of(martial[:1]), "lstm-3lr-martial": of(martial[1:]),
    })  # fmt: skip


def rivals(failed, seconds):
    methods = ("aclstm", "seq2seq", "erd", "scheduled")
    return followed({
        f"{method}-indian": [{"first 1000 frames": {
            "failed": count, "mean seconds until failure": mean}}]
        for method, count, mean in zip(methods, failed, seconds, strict=False)})  # fmt: skip


def pauses(number, recovered, walking=0, cut=0):
    none = {"number": 0, "cut off": 0, "recovered within 5 s": 0}
    dance = {"number": number, "cut off": cut, "recovered within 5 s": recovered}
    each = dict.fromkeys(STYLES, none) | {"indian": dance, "walking": none | {"number": walking}}
    return followed(dancers={f"aclstm-{s}": {"stagnations": its} for s, its in each.items()})


# -- prediction -----------------------------------------------------------------------------------


def errors(**rows):
    """results/dances_prediction.json, of the errors of each row at eight times."""
    return {"rows": {
        name.replace("_", "-"): {"seeds": {"0": {"errors (m)": {"value": list(values)}}}}
        for name, values in rows.items()}}  # fmt: skip


def table(below=True, best=True, worst=True, most=4):
    """Table 1 with or without each of the four statements."""
    made = {}
    for style in ("indian", "martial", "walking"):
        wins = most if style == "indian" else 0
        made |= {
            f"aclstm_{style}": [0.9 if below else 1.3] + [1.0] * 7,
            f"lstm_3lr_{style}": [1.2] * 8,
            f"erd_{style}": [0.8] * (8 - wins) + [1.1] * wins,
            f"scheduled_{style}": [1.5] * 8,
            f"seq2seq_{style}": [0.1 if best else 1.4] + [1.45] * 6 + [9.0 if worst else 1.4],
        }
    return errors(**made)


def lengths(means, change):
    names = ("length_1", "length_2", "aclstm_indian", "length_10")
    rows = errors(**{name: [mean] * 8 for name, mean in zip(names, means, strict=True)})
    found = followed({
        name.replace("_", "-"): [{"change": {"whole": value}}]
        for name, value in zip(names, change, strict=True)})  # fmt: skip
    return rows, found


# -- both styles, real time -----------------------------------------------------------------------


def hybrid(right, salsa, both, starts=20):
    found = {"share of windows": {"indian": 1 - salsa, "salsa": salsa}, "visit both": both}
    return {"right": {"mean": right}, "until they fail": found, "visit both": 1.0,
            "rollouts": [{}] * starts, "seconds of a rollout": 60.0}  # fmt: skip


def speed(full, half, width=1024):
    return {"threads": 1, "width": width, "machine": "m",
            "generation": {"frames_per_second": {"full": full, "half": half}}}  # fmt: skip


CASES = [
    ("Z1-endless", "reproduced", endless((0.95, 1.0, 1.0, 1.0), (0.5, 0.0, 0.0, 0.0))),
    ("Z1-endless", "partly", endless(cycling=(0.0, 0.0, 0.0, 0.55))),
    ("Z1-endless", "partly", endless((0.9, 0.0, 0.0, 0.95), (0.0, None, None, 1.0))),
    ("Z1-endless", "not reproduced", endless((0.9, 0.9, 0.9, 0.9))),
    ("Z1-endless", "open", endless(styles=STYLES[:3])),
    ("Z1-endless", "open", endless(frames=2_000)),
    ("Z1-endless", "open", endless(starts=8)),
    ("Z1-plain", "reproduced", plain((1.0, 2.0, 4.9), (10.0, 60.0, 49.0))),
    ("Z1-plain", "partly", plain((1.0, 2.0, 5.0), (10.0, 60.0, 600.0))),
    ("Z1-plain", "partly", plain((1.0, 2.0, 4.9), (10.0, 60.0, 48.0))),
    ("Z1-plain", "partly", plain((0.0, 0.0, 0.0), (10.0, 10.0, 0.0))),
    ("Z1-plain", "not reproduced", plain((6.0, 6.0, 6.0), (6.0, 60.0, 60.0))),
    ("Z1-plain", "open", plain((1.0, 1.0), (60.0, 60.0, 60.0))),
    ("Z2", "reproduced", table()),
    ("Z2", "partly", table(below=False)),
    ("Z2", "partly", table(most=3, worst=False)),
    ("Z2", "not reproduced", table(best=False, worst=False, most=0)),
    ("Z2", "open", errors(aclstm_indian=[1.0] * 8)),
    ("Z3", "reproduced", moving((0.5, 1.0, 1.2), (0.1, 0.0, 0.05))),
    ("Z3", "partly", moving((0.4, 1.0, 1.2), (0.1, 0.0, 0.05))),
    ("Z3", "partly", moving((1.0, 1.0, 1.0), (0.1, 0.1, 0.1), martial=(0.61, 0.2))),
    ("Z3", "not reproduced", moving((1.0, 1.0, 1.0), (0.1, 0.1, 0.1), martial=(0.5, 0.2))),
    ("Z3", "not reproduced", moving((0.0, 1.0, 1.0), (0.0, 0.0, 0.0))),
    ("Z3", "open", moving((1.0, 1.0), (0.0, 0.0))),
    ("Z4", "reproduced", rivals((1, 19, 20, 19), (33.0, 2.0, 9.0, 20.0))),
    ("Z4", "partly", rivals((2, 19, 20, 19), (30.0, 2.0, 9.0, 20.0))),
    ("Z4", "partly", rivals((0, 19, 20, 18), (33.3, 2.0, 9.0, 20.0))),
    ("Z4", "not reproduced", rivals((9, 19, 20, 1), (20.0, 2.0, 9.0, 33.0))),
    ("Z4", "open", rivals((1, 19, 20), (33.0, 2.0, 9.0))),
    ("Z5", "reproduced", *lengths((4, 3, 2, 1), (1.0, 0.9, 0.8, 0.75))),
    ("Z5", "partly", *lengths((4, 3, 2, 1), (1.0, 0.9, 0.8, 0.85))),
    ("Z5", "partly", *lengths((3, 4, 2, 1), (1.0, 0.9, 0.8, 0.5))),
    ("Z5", "not reproduced", *lengths((4, 3, 1, 2), (1.0, 0.9, 0.8, 0.5))),
    ("Z6", "not testable here", hybrid(0.79, 0.5, 1.0)),
    ("Z6", "reproduced", hybrid(0.9, 0.89, 0.5)),
    ("Z6", "partly", hybrid(0.9, 0.5, 0.45)),
    ("Z6", "not reproduced", hybrid(0.9, 0.95, 1.0)),
    ("Z6", "open", hybrid(0.9, 0.5, 1.0, starts=4)),
    ("Z7", "reproduced", pauses(10, 9)),
    ("Z7", "reproduced", pauses(20, 9, cut=10)),
    ("Z7", "partly", pauses(10, 8)),
    ("Z7", "partly", pauses(10, 10, walking=1)),
    ("Z7", "not reproduced", pauses(10, 8, walking=1)),
    ("Z7", "not testable here", pauses(0, 0)),
    ("Z8", "reproduced", speed(30.0, 60.0), {"errors": 0}),
    ("Z8", "partly", speed(30.0, 59.0), {"errors": 0}),
    ("Z8", "partly", speed(90.0, 99.0), {"errors": 1}),
    ("Z8", "not reproduced", speed(30.0, 59.0), {"errors": 1}),
    ("Z8", "open", speed(90.0, 90.0, width=512), {"errors": 0}),
]  # fmt: skip
