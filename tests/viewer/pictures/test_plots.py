from dataclasses import replace

import matplotlib
import numpy as np
import pytest
import torch

matplotlib.use("agg")

from motionlab import Motion  # noqa: E402
from motionlab.datasets import gaits  # noqa: E402
from motionlab.errors import ViewerError  # noqa: E402
from motionlab.viewer import plots  # noqa: E402


@pytest.fixture(scope="module")
def walk():
    return gaits.make(seconds=3, speed=1.3, seed=1)


def test_the_map_names_every_joint_on_its_own_side(walk):
    (axes,) = plots.joint_map(walk, 10).axes
    columns = {note.get_text(): note.xyann[0] for note in axes.texts}
    assert set(columns) == set(walk.skeleton.names)
    assert columns["LeftFoot"] > 0 > columns["RightFoot"]


def test_bars_keep_values_and_order():
    (axes,) = plots.bars([3, 1, 2], ["a", "b", "c"], "error (cm)").axes
    assert [bar.get_width() for bar in axes.patches] == [3, 1, 2]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b", "c"]


def test_curves_hold_their_data():
    (axes,) = plots.curves({"one": ([1, 10], [2, 20])}, x="fps", y="cm", log=True).axes
    assert axes.lines[0].get_xydata().tolist() == [[1, 2], [10, 20]]
    assert axes.get_xlabel() == "fps" and axes.get_xscale() == "log"


def test_logarithmic_axes_name_their_values_in_plain_digits():
    (axes,) = plots.curves({"one": ([1.03333, 1500], [1, 2])}, x="s", y="m", log=True).axes
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["1.03", "1500"]


def test_a_line_of_many_values_has_no_marks():
    lines = {name: (range(count), range(count)) for name, count in (("few", 9), ("many", 99))}
    few, many = plots.curves(lines, x="frame", y="m/s").axes[0].lines
    assert few.get_marker() == "o" and many.get_marker() == "None"


def test_curves_may_have_one_logarithmic_axis():
    (axes,) = plots.curves({"one": ([1, 10], [0, 20])}, x="frame", y="m/s", log="x").axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")


def test_survival_falls_by_one_rollout_at_every_failure():
    (axes,) = plots.survival({"one": [20.0, np.inf, 5.0, 300.0]}, horizon=100.0).axes
    assert axes.lines[0].get_xydata().tolist() == [
        [0.005, 1], [5, 0.75], [20, 0.5], [100, 0.5]
    ]  # fmt: skip
    (axes,) = plots.survival({"a": [1.0], "b": [2.0], "a, again": [3.0]}, horizon=100.0).axes
    a, b, again = axes.lines
    assert a.get_color() == again.get_color() != b.get_color()
    assert a.get_linestyle() == b.get_linestyle() != again.get_linestyle()
    with pytest.raises(ViewerError, match="0 or more"):
        plots.survival({"one": [np.nan]}, horizon=100.0)


def test_pauses_are_drawn_where_they_are():
    (axes,) = plots.pauses({"one": [(1.0, 2.5), (9.0, 10.0)], "none": []}, horizon=10.0).axes
    bars = [path.get_extents() for path in axes.collections[0].get_paths()]
    assert [(bar.x0, bar.x1) for bar in bars] == [(1.0, 2.5), (9.0, 10.0)]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["one", "none"]
    for wrong in ([(3.0, 2.0)], [(9.0, 11.0)], [(np.nan, 1.0)]):
        with pytest.raises(ViewerError, match="within the 10 seconds"):
            plots.pauses({"one": wrong}, horizon=10.0)


def test_recurrence_shows_a_gait_returning_once_a_stride():
    twice = gaits.make(seconds=2, speed=1.3, noise=0, fps=30).positions()[:40]
    twice = torch.cat([twice, twice])
    axes, _ = plots.recurrence(twice, gaits.make(seconds=1).skeleton, 30).axes
    apart = axes.images[0].get_array()
    assert apart.shape == (80, 80) and np.allclose(apart, apart.T, atol=1e-4)
    assert np.allclose(apart[np.arange(40), np.arange(40) + 40], 0, atol=1e-3)  # 40 frames later
    assert apart.max() > 5  # cm


def test_root_paths_start_at_zero_and_end_where_the_root_goes(walk):
    axes, *_ = plots.root_paths([walk], ["walk"]).axes
    way = np.array(axes.collections[0].get_segments())
    root = (walk.root_positions - walk.root_positions[0]).numpy()[:, [0, 2]]
    assert np.allclose(way[0, 0], 0) and np.allclose(way[-1, -1], root[-1], atol=1e-6)


def test_feet_draws_a_bar_for_every_exact_contact(walk):
    def drawn(motion):
        return sum(len(bars.get_paths()) for bars in plots.feet(motion).axes[2].collections)

    height, speed, _ = plots.feet(walk).axes
    toes = walk.contacts[:, [1, 3]].int()
    runs = int(toes[0].sum() + (toes.diff(dim=0) == 1).sum())
    assert drawn(walk) - drawn(replace(walk, contacts=None)) == runs > 2
    assert len(height.lines) == 2 and len(speed.lines) == 3


def test_a_path_is_named_where_it_is_farthest_from_the_start(walk):
    there = walk.root_positions
    back = Motion(
        walk.skeleton, torch.cat([there, there.flip(0)]), walk.rotations.repeat(2, 1, 1, 1), 30
    )
    axes, *_ = plots.root_paths([back], "there and back").axes
    (note,) = axes.texts
    far = (there - there[0])[:, [0, 2]].norm(dim=-1).max()
    assert note.get_text() == "there and back"
    assert np.linalg.norm(note.xy) == pytest.approx(float(far), rel=1e-5) and far > 2


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda m: plots.joint_map(m, frame=9999), "frame 9999 is not in this motion of 90"),
        (lambda m: plots.joint_map([m]), "needs a Motion"),
        (lambda m: plots.bars([1, 2], ["a"], "x"), "1 names for values"),
        (lambda m: plots.root_paths([m, m], labels=["a"]), "1 labels for 2 motions"),
        (lambda m: plots.root_paths(m), r"root_paths\(\[motion\]\)"),
        (lambda m: plots.root_paths([]), "list of motions"),
        (lambda m: plots.root_paths([m[:1]]), "2 frames or more"),
        (lambda m: plots.feet(m[:1]), "2 frames or more"),
        (lambda m: plots.bars([0, 1], ["a", "b"], "x", log=True), "no value that is 0"),
        (lambda m: plots.bars([], [], "x"), "bars: there is nothing to draw"),
        (lambda m: plots.curves({}, "x", "y"), "curves: there is nothing"),
        (lambda m: plots.scatter({}, "x", "y"), "scatter: there is nothing"),
        (lambda m: plots.scatter({"a": ([1], [2, 3], [1])}, "x", "y"), "1 xs, 2 ys and 1 sizes"),
        (lambda m: plots.over_time({}, 30, "y"), "over_time: there is nothing"),
        (lambda m: plots.over_time({"a": [1, 2]}, 0, "y"), "over_time: fps is 0"),
        (lambda m: plots.feature_maps({}, 30, {}), "feature_maps: there is nothing"),
        (lambda m: plots.feature_maps({"a": np.ones((9, 3))}, 30, {}), "slices in groups"),
        (lambda m: plots.feature_maps({"a": np.ones(9)}, 30, {"a": {}}), "frames, dim"),
        (lambda m: plots.fan({}), "fan: there is nothing"),
        (lambda m: plots.fan({"a": np.ones((9, 2))}), r"has shape \(9, 2\)"),
    ],
)
def test_what_cannot_be_drawn_is_said(walk, call, message):
    with pytest.raises(ViewerError, match=message):
        call(walk)


def test_a_mark_for_every_value_and_equal_keys_in_the_legend():
    (axes,) = plots.scatter({"a": ([1, 2], [3, 4], [1, 9]), "b": ([5], [6], [3])}, "x", "y").axes
    first, second = axes.collections
    assert first.get_offsets().tolist() == [[1, 3], [2, 4]]
    assert first.get_sizes()[1] > second.get_sizes()[0] > first.get_sizes()[0]
    keys = [handle.get_sizes()[0] for handle in axes.figure.legends[0].legend_handles]
    assert keys[0] == keys[1]


def test_marks_of_size_nothing_are_dots_that_one_sees():
    (axes,) = plots.scatter({"a": ([1, 2], [3, 4], [0, 0])}, "x", "y").axes
    assert (axes.collections[0].get_sizes() > 36).all()  # 6 points across
    assert axes.collections[0].get_edgecolor()[0, 3] == 1  # the colour itself, not half of it


def test_clouds_are_told_apart_without_colours():
    names = ("accad", "bandai", "cmu", "virvig")
    (axes,) = plots.scatter({name: ([1], [2], [3]) for name in names}, "x", "y").axes
    shapes = {tuple(map(tuple, its.get_paths()[0].vertices)) for its in axes.collections}
    assert len(shapes) == len(names)


def test_ticks_of_a_logarithmic_axis_are_short():
    (axes,) = plots.curves({"a": ([31 / 30, 2], [1, 2])}, "s", "m", log=True).axes
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["1.03", "2"]


def test_values_over_time_are_in_seconds():
    (axes,) = plots.over_time({"left": [1, 2, 3], "right": [3, np.nan, 1]}, fps=10, y="cm").axes
    assert np.allclose(axes.lines[0].get_xdata(), [0, 0.1, 0.2])
    assert np.isnan(axes.lines[1].get_ydata()[1])


def test_values_over_time_can_have_a_logarithmic_axis():
    (axes,) = plots.over_time({"a": [0, 1, 100]}, fps=10, y="cm/s", log=True).axes
    assert axes.get_yscale() == "log" and axes.yaxis.get_major_formatter()(10) == "10"


def test_feature_maps_name_their_parts():
    maps = {"one": np.zeros((5, 4)), "two": np.ones((5, 6))}
    groups = {name: {"root": slice(0, 2), "pose": slice(2, 4)} for name in maps}
    one, two, _ = plots.feature_maps(maps, 10, groups).axes
    assert one.images[0].get_array().shape == (4, 5)
    assert [label.get_text() for label in two.get_yticklabels()] == ["root", "pose"]
    assert one.images[0].get_extent()[1] == 0.5


def test_a_fan_draws_every_path_and_the_true_one():
    paths = np.random.default_rng(0).normal(size=(7, 20, 2))
    left, right = plots.fan({"steps": paths, "turns": paths}, truth=paths[0]).axes
    assert len(left.lines) == len(right.lines) == 8
    assert np.allclose(left.lines[3].get_xydata(), paths[3])
    assert left.get_xlim() == right.get_xlim()


def test_a_fan_of_one_path_draws_it_over_the_true_one():
    path = np.zeros((1, 20, 2))
    drawn, truth = plots.fan({"solved": path}, truth=path[0]).axes[0].lines
    assert drawn.get_zorder() > truth.get_zorder() and drawn.get_alpha() is None


def test_shares_fill_the_whole_and_contacts_lie_below():
    left = np.array([0.2, 0.7, 1.0])
    (axes,) = plots.shares(
        {"left": left, "right": 1 - left}, fps=10, y="weight", below={"toes": [True, True, False]}
    ).axes
    lower, upper, bars = axes.collections
    assert np.allclose(upper.get_paths()[0].vertices[:, 1].max(), 1)
    assert np.allclose(lower.get_paths()[0].vertices[:, 0].max(), 0.2)  # seconds
    extent = bars.get_paths()[0].get_extents()
    assert np.allclose((extent.x0, extent.x1), (0, 0.2)) and extent.y1 < 0
    assert [label.get_text() for label in axes.get_yticklabels()] == ["0", "0.5", "1", "toes"]
