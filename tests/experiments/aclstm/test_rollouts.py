"""What becomes of dances whose fate is known: statues, tapes, bodies that come apart."""

import json
import math

import numpy as np
import pytest
import torch
from torch import nn

from experiments.aclstm import rollouts
from experiments.claims import verdicts
from motionlab.models.floor import ZeroVelocity

pytest.importorskip("lightning_fabric")
pytestmark = pytest.mark.usefixtures("dances")  # gaits for dances, in an empty folder
FRAMES = 180  # six seconds: as long as gaits are


class Tape(nn.Module):
    """Goes on with what it is given, whatever it has seen."""

    def __init__(self, encoding, features):
        super().__init__()
        self.encoding, self.fps, self.features = encoding, encoding.fps, features

    def observe(self, features):
        return features[:, -1]

    def generate(self, n, start, **options):
        return self.features[: len(start), :n].clone()


@pytest.fixture
def real(dances):
    return rollouts.real_of("indian", 30.0)


@pytest.fixture
def walk(dances):
    """Five times a walk of the training clips, (5, frames, dim)."""
    clip = dances.of("indian").clips("train")[1]
    return clip.expand(5, -1, -1)


@pytest.fixture
def tell(dances, real):
    """What is told of rollouts with given features (rollouts, frames, dim)."""

    def told(features):
        seeds = dances.seeds("indian", len(features)).seen
        tape = Tape(dances.of("indian").encoding, features)
        return rollouts.told(tape, real, seeds, features.shape[1])

    return told


def test_who_repeats_the_last_frame_freezes_at_once(dances, real):
    seeds = dances.seeds("indian", 3)
    found = rollouts.told(ZeroVelocity(dances.of("indian").encoding), real, seeds.seen, FRAMES)
    assert found["failed (s)"] == [0.0] * 3 and found["how"] == ["frozen"] * 3
    assert found["alive"] == found["median seconds until failure"] == 0
    assert found["change"]["last minute"] == found["change"]["whole"] == 0
    assert not any(found["change"]["over real"])
    assert found["stagnations"]["number"] == 3 and found["stagnations"]["recovered within 5 s"] == 0
    assert found["novelty"]["first minute"] is None
    assert found["cycles"]["either, of those alive"] is None


def test_who_replays_a_clip_lives_and_is_called_a_replay(tell, walk):
    found = tell(walk)
    assert found["alive"] == 1 and found["how"] == [None] * 5
    assert found["median seconds until failure"] == pytest.approx(walk.shape[1] / 30)
    assert 0.4 < found["change"]["whole"] < 1.5
    assert found["change"]["last minute"] == pytest.approx(found["change"]["whole"])
    assert found["stagnations"]["number"] == 0
    assert found["cycles"]["same end as another"] == 5
    assert found["cycles"]["either, of those alive"] == 1
    new = found["novelty"]["first minute"]
    assert new["median distance"] < 1e-3 < new["of held-out clips"] and new["replays"] == 1


def test_rollouts_that_differ_are_in_no_ones_motion(dances, tell):
    clips = dances.of("indian").clips("train")
    both = torch.stack([clips[0][:150], clips[5][:150]])  # a walk, a run
    found = tell(both)
    assert found["cycles"]["same end as another"] == 0


def test_a_nan_is_a_divergence_at_its_frame(tell, walk):
    lost = walk.clone()
    lost[0, 90:, 7] = torch.nan
    found = tell(lost)
    assert found["failed (s)"][0] == pytest.approx(3.0) and found["how"][0] == "diverged"
    assert found["failed (s)"][1:] == [math.inf] * 4
    assert found["alive"] == 0.8 and found["failed"] == {"frozen": 0, "diverged": 1, "off floor": 0}
    assert np.isfinite(found["change"]["last minute"])
    assert found["stagnations"]["number"] == 0
    whole = tell(walk)["change"]["whole"]
    assert found["change"]["whole"] == pytest.approx(whole, rel=0.1)
    nothing = tell(torch.full_like(walk, torch.nan))
    assert nothing["alive"] == nothing["change"]["whole"] == 0
    assert nothing["change"]["over real"] == [None] * len(nothing["change"]["over real"])


def test_a_stretched_bone_is_a_divergence_and_what_would_be_without_is_told(tell, walk):
    stretched = walk.clone()
    stretched[:, 60:, 30:33] += torch.linspace(0, 1, walk.shape[1] - 60)[:, None]
    found = tell(stretched)
    assert all(2 < seconds < 5 for seconds in found["failed (s)"])
    assert found["how"] == ["diverged"] * 5
    brief = walk.clone()
    brief[:, 60:80, 30:33] = stretched[:, -1:, 30:33]
    assert tell(brief)["alive"] == 1  # bones may stretch for less than a second
    other = found[rollouts.ELASTIC]
    assert other["alive"] == 1 and other["failed"]["diverged"] == 0
    assert found["change"]["over real"][-1] is None and other["change"]["over real"][-1] > 0
    brief = found["first 1000 frames"]
    assert brief["latest (s)"] == max(found["failed (s)"])
    poses = np.array(brief["poses before the latest (m)"])
    assert poses.shape[0] == rollouts.POSES and np.abs(poses[-1] - poses[0]).max() > 0.1


def test_a_stop_that_ends_is_a_stagnation_and_not_a_freeze(tell, walk):
    stop = walk[:, 60:61].clone()
    stop[..., [0, 2]] = 0
    pause = stop.expand(-1, 45, -1)
    found = tell(torch.cat([walk[:, :60], pause, walk[:, 60:]], dim=1))
    assert found["alive"] == 1
    assert found["stagnations"]["number"] == found["stagnations"]["recovered within 5 s"] == 5
    assert found["stagnations"]["seconds, 10 50 90 100 %"] == pytest.approx([1.5] * 4, abs=0.15)


def test_stagnations_by_hand():
    pauses = [([(1.0, 2.0), (9.0, 10.0)], 10.0), ([(1.0, 7.0), (8.0, 20.0)], 20.0), ([], 20.0)]
    found = rollouts.stagnant(pauses)
    assert (found["number"], found["rollouts with any"]) == (4, 2)
    assert (found["cut off"], found["recovered within 5 s"]) == (1, 1)


def test_seconds_of_recovery_are_those_of_the_rule():
    (z7,) = [claim for claim in verdicts.claims() if claim["id"] == "Z7"]
    assert rollouts.SOON == z7["limits"]["soon"]


def test_change_over_time_by_hand():
    frames = 2_001
    steady, falling = np.full(frames - 1, 0.5), np.linspace(1, 0, frames - 1)
    found = rollouts.change_over_time([steady, falling], frames, fps=10.0)
    curve, at = found["over real"], rollouts.middles(frames)
    assert len(curve) == len(at) == len(rollouts.edges(frames)) - 1
    for value, frame in zip(curve, at, strict=True):
        assert value == pytest.approx(0.5 * (0.5 + 1 - frame / frames), abs=0.02)
    assert found["whole"] == pytest.approx(0.5)
    assert found["last minute"] == pytest.approx(0.5 * (0.5 + 0.15), abs=0.01)
    lost = rollouts.change_over_time([steady, falling[:100]], frames, fps=10.0)
    assert lost["over real"][-1] == 0.5  # it counts until it is lost
    assert lost["last minute"] == pytest.approx(0.5 * (0.5 + falling[:100].mean()))


def test_rows_that_are_trained_are_followed_once(untrained, tmp_path, monkeypatch):
    untrained("aclstm-indian", "fps-60")
    arguments = ["--preset", "smoke", "--starts", "2", "--frames", "90", "--output", "found.json"]
    rollouts.main([*arguments, "--only", "aclstm-indian", "fps-60"])
    read = lambda: json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    found = read()
    assert list(found["rows"]) == ["aclstm-indian", "fps-60"] and not found["dancers"]
    seeds = found["rows"]["aclstm-indian"]["seeds"]
    assert list(seeds) == ["0", "1", "2"] and list(seeds["0"]["after updates"]) == ["10", "40"]
    assert found["rows"]["fps-60"]["seeds"]["0"]["seconds each"] == 1.5
    assert len(found["curves are at frames"]) == len(seeds["0"]["change"]["over real"])
    monkeypatch.setattr(rollouts, "told", lambda *arguments: pytest.fail("followed again"))
    rollouts.main([*arguments, "--only", "aclstm-indian", "fps-60"])
    assert read()["rows"] == found["rows"]


def test_shipped_dancers_are_followed(untrained, tmp_path, monkeypatch):
    untrained("aclstm-indian")
    path = next(tmp_path.rglob("at-40.safetensors"))
    monkeypatch.setattr(rollouts.weights, "names", lambda: ["aclstm-indian", "lstm-gmm"])
    monkeypatch.setattr(rollouts.weights, "find", lambda name: path)
    few = ["--starts", "2", "--frames", "60", "--output", "found.json"]
    rollouts.main(["--only", "shipped", *few])
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert list(found["dancers"]) == ["aclstm-indian"] and not found["rows"]
    dancer = found["dancers"]["aclstm-indian"]
    assert dancer["rollouts"] == dancer["with noise"]["0.1"]["rollouts"] == 2
    assert dancer["sha256"] == dancer["with noise"]["0.1"]["sha256"]


def test_limits_can_be_written_down_and_read_again(dances):
    judge = rollouts.real_of("indian", 30.0).judge
    again = rollouts.rollouts.Judge.from_config(
        json.loads(json.dumps(judge.config())), judge.limits.skeleton
    )
    wild = dances.of("indian").encoding.positions(dances.of("indian").clips("train")[0])
    wild = torch.cat([wild, wild + torch.tensor([0.0, 9.0, 0.0])])
    assert again.failures(wild) == judge.failures(wild)
    assert math.isfinite(again.failures(wild)["diverged"])


def test_less_must_not_overwrite_the_result(capsys):
    for less in (["--preset", "smoke"], ["--frames", "200"], ["--starts", "3"]):
        with pytest.raises(SystemExit):
            rollouts.main(less)
        assert "--output" in capsys.readouterr().err
