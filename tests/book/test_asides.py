"""What may be skipped folds into one line."""

import pytest
from docutils import nodes
from docutils.utils import new_document


@pytest.fixture
def asides(extension):
    return extension("asides")


def page(asides, *parts):
    """A page of paragraphs; < and > are the beginning and the end of an aside, # a section."""
    made = new_document("page")
    for part in parts:
        if part.startswith("<"):
            made += asides.begin(title=part[1:])
        elif part == ">":
            made += asides.end()
        elif part == "#":
            made += nodes.section()
        else:
            made += nodes.paragraph(part, part)
    return made


def test_all_between_goes_into_a_box_with_its_title_and_the_rest_stays(asides):
    made = page(asides, "a", "<tried", "b", "c", ">", "d", "<more", "e", ">")
    asides.fold(made, "chapter")
    assert [node.astext().split("\n\n") for node in made] == [
        ["a"], ["tried", "b", "c"], ["d"], ["more", "e"],
    ]  # fmt: skip
    assert "dropdown" in made[1]["classes"] and isinstance(made[1][0], nodes.title)


@pytest.mark.parametrize(
    "parts", [("<tried", "b"), ("<one", "<two", "b", ">", ">"), ("<tried", "#", ">"), ("a", ">")]
)
def test_an_aside_without_end_or_beginning_is_named(asides, parts):
    made = page(asides, *parts)
    with pytest.raises(Exception, match=r"^chapter: (the aside '(tried|one)'|an aside ends)"):
        asides.fold(made, "chapter")
