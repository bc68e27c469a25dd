"""The game: it can be stopped, its tricks can be left out, and it says what is wrong."""

from __future__ import annotations

import copy
import json
from dataclasses import replace

import pytest
import torch
from safetensors.torch import save_file

from motionlab.errors import DivergedError, TrainingError
from motionlab.training import adversarial, build
from motionlab.training.adversarial import new_game, play, sample_motions, train_game
from motionlab.training.checkpoints import load_weights, read_checkpoint
from motionlab.training.games import GamePreset
from motionlab.training.windows import Windows

SMALL = GamePreset(
    steps=4, validate_every=2, batch=4, frames=8, warmup=2, turns=2, history=6, width=8,
    discriminator_width=8, samples=3, seconds=1.0, refresh=2,
)  # fmt: skip


@pytest.fixture(scope="module")
def generator(gaits, smoke):
    """One that has learned nothing yet, and is used gently."""
    model = build(gaits, smoke()).eval().requires_grad_(False)
    model.sampling = {"temperature": 0.1}
    return model


@pytest.fixture
def game(generator, gaits):
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield lambda folder, preset=SMALL, **other: train_game(
        other.get("generator", generator), other.get("data", gaits), preset, folder,
        name="refiner", device="cpu",
    )  # fmt: skip
    torch.set_num_threads(threads)


def same(folder, other, step):
    one, another = (load_weights(f / f"at-{step}.safetensors")[0] for f in (folder, other))
    return all(map(torch.equal, one.state_dict().values(), another.state_dict().values()))


def test_it_plays_and_keeps_what_became_of_it(game, tmp_path):
    curve = game(tmp_path)
    assert [point["step"] for point in curve] == [2, 4]
    for key in ("telling", "fooling", "root (cm)", "turns", "seconds"):
        assert all(point[key] > 0 for point in curve), key
    refiner, about = load_weights(tmp_path / "at-4.safetensors")
    assert about["step"] == 4 and about["name"] == "refiner"
    assert refiner.leave.weight.abs().max() > 0


def test_stopped_at_any_step_it_ends_the_same(game, tmp_path, monkeypatch):
    game(tmp_path / "undisturbed")

    played = adversarial.play

    def stopping_at(stop):
        def play_on(*arguments):
            if arguments[-1] == stop:
                raise KeyboardInterrupt
            return played(*arguments)

        return play_on

    for stop in (1, 3):
        monkeypatch.setattr(adversarial, "play", stopping_at(stop))
        with pytest.raises(KeyboardInterrupt):
            game(tmp_path / "stopped")
    monkeypatch.setattr(adversarial, "play", played)
    game(tmp_path / "stopped")
    assert same(tmp_path / "stopped", tmp_path / "undisturbed", 4)
    game(tmp_path / "another", replace(SMALL, seed=1))
    assert not same(tmp_path / "another", tmp_path / "undisturbed", 4)


def test_a_game_can_be_prolonged_but_not_changed(game, tmp_path):
    game(tmp_path)
    assert game(tmp_path, replace(SMALL, steps=6))[-1]["step"] == 6
    with pytest.raises(TrainingError, match=r"other root_weight; repeat its settings"):
        game(tmp_path, replace(SMALL, root_weight=1.0))


def test_a_game_is_with_one_generator(game, generator, tmp_path):
    first, second = copy.copy(generator), copy.copy(generator)
    first.hash, second.hash = "a" * 64, "b" * 64
    game(tmp_path, generator=first)
    assert game(tmp_path, replace(SMALL, steps=5), generator=first)[-1]["step"] == 5
    with pytest.raises(TrainingError, match="other generator"):
        game(tmp_path, generator=second)


class Counted:
    """Stands in for the two losses: how often each player learned, and with what loss told."""

    def __init__(self, monkeypatch, telling=0.5):
        self.tells = self.fools = 0
        monkeypatch.setattr(adversarial, "_tell", self._tell(telling))
        monkeypatch.setattr(adversarial, "_fool", self._fool)

    def _tell(self, loss):
        def tell(*_):
            self.tells += 1
            return loss

        return tell

    def _fool(self, *_):
        self.fools += 1
        return 0.7, 1.0


@pytest.mark.parametrize(
    ("step", "other", "telling", "expected"),
    [
        (0, {}, 0.5, (75, 75)),
        (0, {"warmup": 0}, 0.5, (1, 5)),
        (1, {}, 0.5, (1, 5)),
        (1, {"turns": 1}, 0.5, (1, 1)),
        (1, {}, 0.009, (1, 10)),
        (1, {}, 1.1, (1, 2)),
        (1, {"turns": 1}, 1.1, (1, 1)),
        (1, {"balance": False}, 0.009, (1, 5)),
        (1, {"strong": 0.5, "weak": 0.6}, 0.49, (1, 10)),
        (1, {"strong": 0.5, "weak": 0.6}, 0.61, (1, 2)),
    ],
)
def test_turns_are_those_of_the_paper(monkeypatch, gaits, step, other, telling, expected):
    counted = Counted(monkeypatch, telling)
    preset = replace(GamePreset(steps=2, validate_every=1, history=0, width=4), **other)
    list(play(new_game(gaits, preset), None, None, preset, step))
    assert (counted.tells, counted.fools) == expected


def test_half_a_batch_of_the_history_is_exchanged_in_each_turn(gaits, generator):
    preset = replace(SMALL, warmup=0, history=8)
    game = new_game(gaits, preset)
    optimizer = torch.optim.RMSprop(game.parameters(), lr=1e-4)
    source = adversarial._Source(generator, gaits, preset, torch.device("cpu"))
    list(play(game, optimizer, source, preset, 0))
    before = game.history.clone()
    assert before.abs().sum() > 0
    list(play(game, optimizer, source, preset, 1))
    changed = (game.history != before).flatten(1).any(1).sum()
    assert changed == preset.batch // 2


@pytest.mark.parametrize(
    "other",
    [{"warmup": 0}, {"turns": 1}, {"history": 0}, {"balance": False}, {"root_weight": 0.0},
     {"instance_noise": 0.1}, {"spectral": True}, {"clip": 1.0}, {"slow": 0.1},
     {"steepness_weight": 0.5}, {"piece": 4}, {"reach": 0.05}, {"change_weight": 1.0},
     {"average": 0.9}],
)  # fmt: skip
def test_every_trick_can_be_left_out_and_every_remedy_taken(game, tmp_path, other):
    assert len(game(tmp_path, replace(SMALL, **other))) == 2


def test_the_refiner_that_is_kept_can_be_an_average(gaits, generator, game, tmp_path):
    averaged = replace(SMALL, average=0.5, validate_every=1)
    game(tmp_path / "a", averaged)
    game(tmp_path / "b", replace(averaged, average=0.0))
    kept, plain = (
        [load_weights(tmp_path / f / f"at-{n}.safetensors")[0].leave.weight for n in range(1, 5)]
        for f in ("a", "b")
    )
    mean = torch.zeros_like(plain[0])
    for step, now in enumerate(plain):
        share = min(0.5, (step + 1) / (step + 10))
        mean = share * mean + (1 - share) * now
        assert torch.allclose(kept[step], mean, atol=1e-7)


def test_a_generator_without_contacts_needs_no_data_without(game, gaits, smoke, tmp_path):
    plain = build(gaits.without_contacts(), smoke()).eval().requires_grad_(False)
    plain.sampling = {"temperature": 0.1}
    game(tmp_path / "a", generator=plain)
    game(tmp_path / "b", generator=plain, data=gaits.without_contacts())
    refiner, about = load_weights(tmp_path / "a" / "at-4.safetensors")
    assert refiner.encoding.config() == plain.encoding.config() and about["data"] == gaits.hash
    assert same(tmp_path / "a", tmp_path / "b", 4)


def test_a_heavier_root_weight_keeps_roots_nearer(game, tmp_path):
    long = replace(SMALL, steps=20, validate_every=20)
    light, heavy = (
        game(tmp_path / str(weight), replace(long, root_weight=weight))[-1]["root (cm)"]
        for weight in (0.0, 1e4)
    )
    assert heavy < light


def test_exploded_motions_are_drawn_again(gaits, generator, monkeypatch):
    begun, calls = Windows(gaits.clips("train"), 60), []
    generate = generator.generate

    def now_and_then(*arguments, **more):
        calls.append(1)
        made = generate(*arguments, **more)
        made[0] = torch.nan
        return made

    monkeypatch.setattr(generator, "generate", now_and_then)
    found = sample_motions(generator, begun, SMALL, 0)
    assert len(found) == 3 and len(calls) == 2
    assert all(motion.isfinite().all() for motion in found)
    monkeypatch.setattr(generator, "generate", lambda *a, **m: generate(*a, **m) * torch.nan)
    with pytest.raises(TrainingError, match="explode"):
        sample_motions(generator, begun, SMALL, 0)


@torch.no_grad()
def test_motions_to_refine_can_be_drawn_with_a_memory(gaits, generator):
    begun = Windows(gaits.clips("train"), 60)
    draw = lambda **more: torch.stack(
        sample_motions(generator, begun, replace(SMALL, seconds=2.0, **more), 0)
    )
    usual, slow, warm = draw(), draw(memory=0.9), draw(memory=0.9, temperature=0.5)
    chance = torch.Generator().manual_seed(0)
    start = generator.observe(begun.draw(3, chance))
    for found, sampling in [
        (usual, {"temperature": 0.1}),
        (slow, {"temperature": 0.1, "memory": 0.9}),
        (warm, {"temperature": 0.5, "memory": 0.9}),
    ]:
        g = torch.Generator()
        g.set_state(chance.get_state())
        assert torch.equal(found, generator.generate(60, start, generator=g, **sampling))
    assert not torch.allclose(usual, slow) and not torch.allclose(slow, warm)


def test_a_game_of_before_there_was_a_memory_goes_on(game, tmp_path):
    game(tmp_path)
    tensors, facts = read_checkpoint(tmp_path / "checkpoint.safetensors")
    for name in ("memory", "temperature"):
        del facts["preset"][name]
    save_file(tensors, tmp_path / "checkpoint.safetensors", {"motionlab": json.dumps(facts)})
    with pytest.raises(TrainingError, match="other memory"):
        game(tmp_path, replace(SMALL, memory=0.9))
    assert game(tmp_path, replace(SMALL, steps=6))[-1]["step"] == 6


def test_what_cannot_be_played_is_said(game, tmp_path, gaits):
    for wrong, message in [
        ({"batch": 3}, "even"), ({"history": 2}, "a batch and more"), ({"turns": 0}, "turns"),
        ({"refiner_rate": 0.0}, "refiner_rate"), ({"piece": 3}, "a divisor of frames"),
        ({"root_weight": float("nan")}, "root_weight"), ({"memory": 1.0}, "memory"),
        ({"memory": float("nan")}, "memory"), ({"temperature": -0.1}, "temperature"),
    ]:  # fmt: skip
        with pytest.raises(TrainingError, match=message):
            replace(SMALL, **wrong)
    with pytest.raises(TrainingError, match="another kind"):
        game(tmp_path, data=gaits.without_contacts())
    with pytest.raises(DivergedError, match=r"Step \d: the .* loss is"):
        game(tmp_path, replace(SMALL, refiner_rate=1e38, discriminator_rate=1e38, steps=50))
    (tmp_path / "file").write_text("")
    with pytest.raises(TrainingError, match="written"):
        game(tmp_path / "file")
