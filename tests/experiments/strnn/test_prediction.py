"""Forecasts of rivals: an oracle has no error, and each network goes on in its own way."""

import torch

from experiments.strnn import ablations, prediction
from motionlab.training.strnn import in_body_frame


def test_an_oracle_foretells_without_error_and_whoever_is_off_by_one_deviation_by_its_norm(walks):
    data = in_body_frame(walks)
    clips = data.clips("val")
    rows = torch.cat(clips)

    def oracle(seen, n):
        at = [int((rows == window[-1]).all(-1).nonzero()[0]) for window in seen]
        return torch.stack([rows[i + 1 : i + 1 + n] for i in at])

    found = prediction.errors(oracle, clips, data)
    assert [*found] == [f"{ms} ms" for ms in range(80, 561, 80)] and max(found.values()) == 0
    off = lambda seen, n: oracle(seen, n) + data.normalizer.std
    found, channels = prediction.errors(off, clips, data), len(data.normalizer.kept)
    assert all(abs(its - channels**0.5) < 1e-3 for its in found.values())


def test_every_method_goes_on_from_the_same_frames(walks, monkeypatch):
    data = in_body_frame(walks)
    seen = torch.stack([clip[:20] for clip in data.clips("val")])
    for name in (*ablations.METHODS, "Temporal_20_20_MSE"):
        (run, *_) = ablations.in_order([name], "smoke")
        with torch.no_grad():
            said = prediction.forecast_of(run.preset.model(walks))(seen, 20)
        assert said.shape == seen.shape and said.isfinite().all(), name
    few = {"latent": 2, "length": 20, "frames": 60, "updates": 5}
    monkeypatch.setattr(prediction, "GPDM", few)
    gpdm = prediction.gpdm_of(data)
    assert len(gpdm.rows) == 60 and gpdm.extrapolate(seen, 20).shape == seen.shape
    said = prediction.ngram_of(data).extrapolate(seen, 20)
    assert (
        torch.cdist(said.flatten(0, 1), torch.cat(data.clips("train"))).min(1).values.max() < 1e-2
    )
