"""Attempts at a better STRNN: bones are measured, own frames are read, learning does what it is for."""

import json

import torch

from experiments.strnn import attempts
from experiments.strnn.attempts import Attempt
from motionlab.training import PRESETS, build
from motionlab.training.strnn import in_body_frame


def network(walks):
    torch.manual_seed(0)
    return build(walks, PRESETS["strnn-temporal-hy"]["smoke"])


def test_a_price_on_bones_brings_them_nearer_to_their_lengths(walks):
    model, data = network(walks), in_body_frame(walks)
    free = network(walks)
    attempts.taught(free, Attempt("", bones=0.0), data, 40)
    model.requires_grad_(False)  # as `motionlab.load` gives it
    attempts.taught(model, Attempt("", bones=10.0), data, 40)
    true = model.normalizer(torch.stack([clip[:20] for clip in data.clips("val")]))
    off = [
        float(data.encoding.bones_off(its.normalizer.inverse(its._whole(true)[:, :20])).abs().mean())
        for its in (model.requires_grad_(False), free.requires_grad_(False))
    ]  # fmt: skip
    assert off[0] < 0.8 * off[1]


def test_own_frames_are_read_in_every_second_window(walks, monkeypatch):
    model, data = network(walks), in_body_frame(walks)
    windows = torch.stack([clip[:60] for clip in data.clips("val")])
    seen = []
    whole = model._whole
    monkeypatch.setattr(model, "_whole", lambda read: seen.append(read) or whole(read))
    attempts.cost(model, Attempt("", noise=0.0, own=True), windows, torch.Generator())
    first, read = seen
    true = model.normalizer(windows)
    assert torch.equal(first, true[::2, :20])
    assert torch.equal(read[::2], whole(first)[:, 20:]) and torch.equal(
        read[1::2], true[1::2, 20:40]
    )
    seen.clear()
    attempts.cost(model, Attempt("", noise=0.0), windows, torch.Generator())
    assert torch.equal(seen[0], true[:, 20:40])


def test_what_became_of_it_is_told(walks):
    found = attempts.judged(network(walks), in_body_frame(walks), 3, 100)
    assert 0 <= found["alive"] <= 1 and found["said again"] > 0 and found["foretold"] > 0
    json.dumps(found)
