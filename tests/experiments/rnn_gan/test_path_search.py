"""What is kept of a row, when it is measured anew, and what its summary says."""

import pytest

from experiments.rnn_gan import path_search


def row(rms, **more):
    return {"rms (cm)": rms, "finished": True, "without broken frames": True} | more


def test_a_summary_is_over_curves_and_shares_are_over_motions():
    first = {"a": row(1.0), "b": row(2.0), "c": row(6.0)}
    second = {"a": row(3.0), "b": row(2.0, finished=False), "c": row(8.0)}
    told = path_search.summary([first, second])
    assert told["median"]["rms (cm)"].value == 2.0  # of 2, 2 and 7
    assert told["finished"] == pytest.approx(5 / 6) and told["without broken frames"] == 1.0


def test_a_row_is_measured_once_and_anew_when_its_settings_change(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(path_search, "made_with", lambda model: "weights-and-search")
    monkeypatch.setattr(
        path_search, "measured", lambda name, seed, *_: asked.append(seed) or {"a": row(1.0 + seed)}
    )
    once = path_search.kept(tmp_path, "swarm", 3, None, None)
    assert path_search.kept(tmp_path, "swarm", 3, None, None) == once and asked == [3]
    assert path_search.kept(tmp_path, "L-BFGS", 3, None, None) == once and asked == [3, 3]
    monkeypatch.setitem(path_search.ROWS, "swarm", {"steps": 1})
    path_search.kept(tmp_path, "swarm", 3, None, None)
    assert asked == [3, 3, 3]
