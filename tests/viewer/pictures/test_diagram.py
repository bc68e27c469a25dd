"""Networks as boxes and arrows: what is drawn where, how large its text is on a phone, bad input."""

import pytest
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from motionlab import viewer
from motionlab.errors import ViewerError

BOXES = {"seen": (0, 0), "layer": (0, 1), "said": (0, 2), "other": (1, 1)}
ARROWS = [("seen", "layer"), ("layer", "layer", "h"), ("layer", "said"), ("said", "seen", "fed back"),
          ("other", "layer", "noise")]  # fmt: skip


def drawn(kind, *arguments):
    axes = viewer.diagram(*arguments).axes[0]
    return axes, [patch for patch in axes.patches if isinstance(patch, kind)]


def test_each_box_has_its_name_within_it():
    axes, boxes = drawn(FancyBboxPatch, BOXES, ARROWS)
    canvas = axes.figure.canvas
    canvas.draw()
    names = [text for text in axes.texts if text.get_text() in BOXES]
    assert len(boxes) == len(names) == len(BOXES)
    for box, name in zip(boxes, names, strict=True):
        inner, outer = name.get_window_extent(), box.get_window_extent()
        assert (
            outer.x0 < inner.x0
            and inner.x1 < outer.x1
            and outer.y0 < inner.y0 < inner.y1 < outer.y1
        )


def test_arrows_begin_and_end_at_their_boxes_and_nothing_leaves_the_picture():
    axes, arrows = drawn(FancyArrowPatch, BOXES, ARROWS)
    _, boxes = drawn(FancyBboxPatch, BOXES, ARROWS)
    extents = dict(zip(BOXES, (box.get_path().get_extents(box.get_patch_transform()) for box in boxes), strict=True))  # fmt: skip
    for (begin, end, *_), arrow in zip(ARROWS, arrows, strict=True):
        way = arrow.get_path().vertices
        assert extents[begin].padded(1e-6).contains(*way[0])
        assert any(
            extents[end].padded(0.02).contains(*point) for point in way[1:]
        )  # the head's tip
        way = way[~(way == way[-1]).all(1)]  # which closes the head's outline
        assert ((axes.get_xlim()[0] < way[:, 0]) & (way[:, 0] < axes.get_xlim()[1])).all()
    axes.figure.canvas.draw()
    whole = axes.figure.bbox
    for text in axes.texts:
        extent = text.get_window_extent()
        assert extent.x0 >= whole.x0 and extent.x1 <= whole.x1


def test_text_of_three_columns_is_not_small_on_a_phone():
    figure = viewer.diagram({"a": (0, 0), "b": (1, 0), "c": (2, 0)}, [("a", "b", "what")])
    shrunk = min(1.0, 350 / (72 * figure.get_figwidth()))  # to 350 of a page's points
    assert min(text.get_fontsize() for text in figure.axes[0].texts) * shrunk >= 8


def test_bad_input():
    with pytest.raises(ViewerError, match="nothing to draw"):
        viewer.diagram({}, [])
    with pytest.raises(ViewerError, match="one place"):
        viewer.diagram({"a": (0, 0), "b": (0, 0)}, [])
    with pytest.raises(ViewerError, match="no box 'c'.*a, b"):
        viewer.diagram({"a": (0, 0), "b": (0, 1)}, [("a", "c")])
    with pytest.raises(ViewerError, match="no box 'c'"):
        viewer.diagram({"a": (0, 0)}, [], {"c": "RNN"})
    with pytest.raises(ViewerError, match="colour"):
        viewer.diagram({"a": (0, 0)}, [], {"a": "no such"})
