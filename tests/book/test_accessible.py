"""What the book mends in the HTML of Sphinx and its themes, for those who hear it."""

import pytest


@pytest.fixture(scope="module")
def accessible(extension):
    return extension("accessible")


def test_what_is_heard_is_what_is_seen(accessible):
    seen = (
        '<details><summary aria-label="Toggle hidden content">\nShow the code</summary></details>'
    )
    assert accessible.rewrite(seen) == "<details><summary>\nShow the code</summary></details>"


def test_references_are_no_list(accessible):
    assert accessible.rewrite('<div role="list" class="citation-list">x</div>') == (
        '<div class="citation-list">x</div>'
    )


def test_no_two_exercises_have_one_id(accessible):
    two = '<section id="exercise-content">a</section><section id="solution-content">b</section>'
    assert accessible.rewrite(two) == "<section>a</section><section>b</section>"
    assert accessible.rewrite('<section id="exercises">') == '<section id="exercises">'


def test_a_picture_is_not_called_by_its_file(accessible):
    path = f"../_images/{'0a' * 30}.png"
    named = f'<img alt="Two walks" src="{path}">'
    page = accessible.rewrite(f'<img alt="{path}" src="{path}">{named}')
    assert f'alt="{path}"' not in page and page.count(f'src="{path}"') == 2
    assert page.endswith(named)


def test_the_themes_buttons_are_named_as_they_are_seen(accessible):
    search = (
        '<button class="btn search-button-field search-button__button" title="Search"{}>'
        '<span class="search-button__default-text">Search</span></button>'
    )
    colour = (
        '<button aria-label="Color mode"><i class="theme-switch fa-solid fa-sun"{}></i></button>'
    )
    named = search.format(' aria-label="Search"') + colour.format(
        ' data-mode="light" title="Light"'
    )
    assert accessible.buttons(named) == search.format("") + colour.format(' data-mode="light"')


def test_what_folds_pages_in_the_sidebar_has_a_name(accessible):
    fold = "<details><summary>{}</summary></details>"
    page = accessible.buttons(fold.format('<span class="toctree-toggle"><i></i></span>'))
    assert page.startswith(
        '<details><summary aria-label="Pages of this subject"><span class="toctree-toggle">'
    )
    assert accessible.buttons(fold.format("Show the code")) == fold.format("Show the code")
