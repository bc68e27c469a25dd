"""What is told of steered scripts."""

from __future__ import annotations

import math

import torch
from tiny_lstm import tiny_clips

from experiments.common.record import rounded
from experiments.rnn_gan.steering import SCRIPTS, summary
from experiments.rnn_gan.steering_measures import ends
from motionlab.encodings import JointAngles


def test_who_never_settles_counts_as_infinitely_late_and_is_null():
    rows = [{"settled (s)": late, "broken frames": 0} for late in (1.0, math.inf, math.nan)]
    told = summary(rows)
    assert told["settled (s)"] == math.inf and rounded(told)["settled (s)"] is None
    told = summary([*rows, *rows[:1] * 2])
    assert told["settled (s)"] == 1.0 and told["runs"] == 5


def test_commands_come_in_order_and_before_the_end():
    for script in SCRIPTS.values():
        times = [at for at, *_ in script.commands]
        assert times == sorted(times) and times[-1] < script.seconds


def test_who_glides_freezes_falls_or_runs_away_is_found_and_who_walks_is_not():
    (clip,) = tiny_clips("walk_1.2")
    encoding = JointAngles(clip.skeleton, clip.fps)
    walk = encoding.encode(clip)
    walk = walk.repeat(1 + 180 // len(walk), 1)[:180]
    stiff = torch.cat([walk[:, :3], walk[:1, 3:].expand(180, -1)], 1)  # goes, and moves no limb
    still = stiff.clone()
    still[:, :3] = 0
    fast = walk.clone()
    fast[:, 1] += 3.0 / clip.fps
    features = torch.stack([walk, stiff, still, fast, walk])
    bad = torch.zeros(5, 180, dtype=torch.bool)
    bad[4, 20:40] = True  # broken for longer than half a second
    bad[0, 20:30] = True
    found, glides = ends(encoding, features, bad, torch.full((5, 180), 1.2))
    who = {name: rows.nonzero()[:, 0].tolist() for name, rows in found.items()}
    assert who == {"fallen": [4], "frozen": [2], "astray": [3], "glided": [1, 3]}
    assert glides[1].all() and not glides[[0, 2, 4]].any()
