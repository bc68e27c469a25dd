"""The pattern of auto-conditioning as a figure."""

import re

import pytest

from motionlab.errors import ViewerError
from motionlab.models import auto_condition
from motionlab.viewer import feeding


def cells(page: str) -> list[bool]:
    """Whether each frame is a recorded one."""
    return [not own for own in re.findall(r"<i(?: class=\"(own)\")?></i>", page)]


@pytest.mark.parametrize(("real", "fed"), [(5, 5), (1, 4), (7, 0), (3, 30)])
def test_without_scripts_it_shows_the_pattern_it_was_asked_for(real, fed):
    page = feeding(real, fed, caption="a < b")._repr_html_()
    pattern = auto_condition(60, real, fed).tolist()
    assert cells(page) == pattern == [t % (real + fed) < real for t in range(60)]
    assert "<figcaption>a &lt; b</figcaption>" in page
    for name, value in (("real", real), ("fed", fed)):
        most = int(re.search(rf'name="{name}" min="\d" max="(\d+)" value="{value}"', page)[1])
        assert most >= value


def test_two_figures_of_a_page_have_their_own_names():
    first, second = (re.search(r'id="(feeding-\w+)"', feeding().html)[1] for _ in range(2))
    assert first != second


def test_a_pattern_that_makes_no_sense():
    for real, fed in ((0, 5), (5, -1), (2.5, 5)):
        with pytest.raises(ViewerError, match="u must"):
            feeding(real, fed)
