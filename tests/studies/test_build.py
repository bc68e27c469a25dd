"""A study made of motions: alike, blind, and fixed by its hash."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace

import pytest
from study_cases import sources

from motionlab.datasets import gaits
from motionlab.errors import StudyError
from motionlab.studies.build import Source, build
from motionlab.studies.page import study_page
from motionlab.studies.study import read_study


def source(seconds=1.2, fps=30.0, method="A", gait="walk"):
    return Source(gaits.make(seconds=seconds, fps=fps), method, gait, f"{method}.bvh")


def several(method="B"):
    return [source(method=method), source(method="A")]


def test_every_method_has_as_many_clips_in_each_gait(rated):
    study = rated.study
    assert set(Counter((c.method, c.gait) for c in study.clips).values()) == {2}
    judged = [item for item in study.items if item.asks is None]
    assert sorted(c for item in judged for c in item.clips) == [c.id for c in study.clips]
    assert len(study.items) == 12 + 2


def test_pairs_compare_every_two_methods_in_one_gait(paired):
    study = paired.study
    by = {clip.id: clip for clip in study.clips}
    two = [tuple(by[c] for c in item.clips) for item in study.items if item.asks is None]
    assert all(a.gait == b.gait and a.method != b.method for a, b in two)
    counts = Counter((frozenset((a.method, b.method)), a.gait) for a, b in two)
    assert len(counts) == 6 and set(counts.values()) == {2}
    item = next(item for item in study.items if item.asks is None)
    assert study.sides(1, item) == study.sides(0, item)[::-1] == study.sides(2, item)[::-1]


def test_the_page_does_not_tell_who_made_what(rated):
    page = study_page(rated)
    start = page.index('<script type="application/json">')
    content = page[start : page.index("</script>", start)]
    for word in ("mocap", "RNN", "GAN2", "walk", '"run"'):
        assert word not in content
    assert all(
        not track["label"] and not track["name"] for track in rated.content["tracks"].values()
    )
    assert len({track["color"] for track in rated.content["tracks"].values()}) == 1
    # nor where a clip stands in the list
    methods = [clip.method for clip in rated.study.clips]
    assert methods != sorted(methods) and "http" not in content


def test_a_page_that_reveals_knows_whose_clips_are_whose(rated):
    page = study_page(rated, reveal=True)
    assert '"method":"mocap"' in page and '"gait":"walk"' in page
    assert "key" not in rated.content


def test_the_same_settings_make_the_same_study_and_anything_else_another(rated):
    again = build(sources(), seed=3)
    assert again.study == rated.study and again.content == rated.content
    others = [build(sources(), seed=4), build(sources(), seed=3, replays=1),
              build(sources(seconds=1.3), seed=3)]  # fmt: skip
    assert len({rated.study.hash, *(other.study.hash for other in others)}) == 4


def test_a_key_comes_back_and_a_changed_one_is_refused(rated, tmp_path):
    file = tmp_path / "study.json"
    file.write_text(rated.study.to_json(), encoding="utf-8")
    assert read_study(file) == rated.study
    whole = json.loads(rated.study.to_json())
    whole["clips"][0]["method"] = "RNN" if whole["clips"][0]["method"] != "RNN" else "mocap"
    bad = {"changed after it was built": json.dumps(whole), "damaged": file.read_text()[:500],
           "no study": "{}", "version 9": json.dumps({**whole, "version": 9})}  # fmt: skip
    del whole["orders"]
    bad["is damaged"] = json.dumps(whole)
    for said, text in bad.items():
        file.write_text(text, encoding="utf-8")
        with pytest.raises(StudyError, match=said):
            read_study(file)
    with pytest.raises(StudyError, match=r"page that raters see.*x\.json"):
        read_study(tmp_path / "x.html")
    with pytest.raises(StudyError, match="can't be read"):
        read_study(tmp_path / "nowhere.json")


def test_other_lengths_and_rates_are_made_alike_and_told():
    made = build([source(1.2, 30), source(2.0, 60, "B")])
    assert made.study.seconds == 1.2 and made.study.fps == 30
    notes = " ".join(made.notes)
    assert "rates differ (30, 60 fps)" in notes and "lengths differ (1.20 to 2.00 s)" in notes
    assert {track["frames"] for track in made.content["tracks"].values()} == {36}
    assert build(several(), seconds=1.0).study.seconds == 1.0


def test_other_bodies_are_told():
    other = source(method="B")
    skeleton = other.motion.skeleton
    taller = replace(skeleton, offsets=1.1 * skeleton.offsets)
    made = build([source(), replace(other, motion=replace(other.motion, skeleton=taller))])
    assert any("2 different bodies, and not the same" in note for note in made.notes)


def test_bodies_that_each_method_has_tell_nothing():
    bodies = [source(method=method) for method in "AABB"]
    for k in (1, 3):
        motion = bodies[k].motion
        taller = replace(motion.skeleton, offsets=1.1 * motion.skeleton.offsets)
        bodies[k] = replace(bodies[k], motion=replace(motion, skeleton=taller), file=f"tall {k}")
    made = build(bodies)
    assert not any("bodies" in note for note in made.notes)


def test_one_motion_is_a_study_that_says_what_it_cant_tell():
    made = build([source()])
    assert "nothing to compare" in made.notes[0] and any("one motion" in n for n in made.notes)
    assert len(made.study.items) == 3 and len(made.study.orders) == 24


@pytest.mark.parametrize(
    ("given", "settings", "said"),
    [
        ([], {}, "no motions"),
        ([source()], {"design": "pairs"}, "one method, A; pairs need two"),
        ([source(), source(method="B", gait="run")], {}, "A has no motion of run"),
        (several(), {"seconds": 3}, r"seconds is 3, but \w\.bvh lasts 1.20"),
        ([source(0.5), source(method="B")], {}, "lasts 0.50 s; nobody can judge"),
        (several(), {"design": "both"}, "design is 'both'"),
        (several(), {"clips": 0}, "clips is 0"),
        (several(), {"replays": -1}, "replays is -1"),
        (several(), {"checks": -1}, "checks is -1"),
        (several(), {"seed": -1}, "seed is -1"),
    ],
)
def test_what_is_no_study_is_refused(given, settings, said):
    with pytest.raises(StudyError, match=said):
        build(given, **settings)


def test_too_many_to_judge_is_refused():
    many = [source(method=f"m{i:02d}") for i in range(30)]
    with pytest.raises(StudyError, match="437 clips to judge"):
        build(many, design="pairs")


def test_soles_stand_on_the_same_floor():
    high = source(method="B")
    lifted = high.motion.root_positions + 0.1
    made = build([source(), replace(high, motion=replace(high.motion, root_positions=lifted))])
    assert made.content["player"]["floor"] == pytest.approx(0, abs=0.01)
    roots = {made.content["tracks"][c.id]["root"] for c in made.study.clips}
    assert len(roots) == 1  # the same walk, lifted and aside: brought to the same place
