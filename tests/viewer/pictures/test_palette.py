"""Colours that can be told apart, by colour-blind readers too, and seen on both of the book's pages."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb

from motionlab.errors import ViewerError
from motionlab.viewer import palette
from motionlab.viewer.pictures.plot_style import STYLE, line_looks

ROOT = Path(__file__).parents[3]
# Machado, Oliveira and Fernandes, A physiologically-based model for simulation of color vision
# deficiency (2009), table 1 at severity 1.0: on linear RGB.
SEEN = {
    "all colours": np.eye(3),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
}
# linear sRGB to XYZ (IEC 61966-2-1)
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
# What stands together in one picture: the chain beside what is recorded or, without data, computed;
# who dances; the table of all.
CHAIN = ("RNN", "RNN+c", "GAN1", "GAN2", "GAN2+lock")
TOGETHER = [
    ("mocap", *CHAIN),
    ("gaits", *CHAIN),
    ("mocap", "acLSTM", "LSTM-3LR", "scheduled", "ERD", "seq2seq"),
    ("mocap", "RNN", "GAN1", "GAN2", "GAN2+lock", "acLSTM", "STRNN", "PFNN"),
]


def linear(color):
    rgb = np.array(to_rgb(color))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(color, seen="all colours"):
    """CIE Lab of a colour as someone sees it."""
    t = XYZ @ np.clip(SEEN[seen] @ linear(color), 0, 1) / XYZ.sum(1)
    x, y, z = np.where(t > 216 / 24389, np.cbrt(t), (24389 / 27 * t + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def apart(one, two, seen="all colours"):
    """CIE 1976 colour difference; 2.3 is what a trained eye just tells."""
    return np.linalg.norm(lab(one, seen) - lab(two, seen))


def contrast(one, two):
    """WCAG 2's ratio."""
    light, dark = sorted(
        (float(XYZ[1] @ linear(color)) + 0.05 for color in (one, two)), reverse=True
    )
    return light / dark


def test_the_ruler_measures():
    assert contrast("white", "black") == pytest.approx(21)
    assert lab("white") == pytest.approx([100, 0, 0], abs=0.02)
    assert lab("red") == pytest.approx([53.24, 80.09, 67.20], abs=0.05)  # sRGB's red
    # red and green of one lightness: what deuteranopia is known for
    assert apart("#b06a5c", "#728554", "deuteranopia") < apart("#b06a5c", "#728554") / 3


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_colour_is_seen_on_the_page(theme):
    css = (ROOT / "book" / "static" / "book.css").read_text(encoding="utf-8")
    page = re.search(rf'data-theme="{theme}"\] {{\s*--pst-color-background: (#\w+);', css)[1]
    faint = {c for c in (*palette.COLORS.values(), *palette.CYCLE) if contrast(c, page) < 3}
    assert not faint


@pytest.mark.parametrize("seen", SEEN)
@pytest.mark.parametrize("methods", TOGETHER, ids=lambda methods: f"{methods[0]} to {methods[-1]}")
def test_methods_that_stand_together_are_told_apart(methods, seen):
    least = 25 if seen == "all colours" else 15
    pairs = combinations(methods, 2)
    alike = {p for p in pairs if apart(*(palette.COLORS[m] for m in p), seen) < least}
    assert not alike


@pytest.mark.parametrize("seen", SEEN)
def test_what_is_no_method_has_colours_of_its_own(seen):
    least = 18 if seen == "all colours" else 12
    assert not [p for p in combinations(palette.CYCLE, 2) if apart(*p, seen) < least]


@pytest.mark.parametrize("seen", SEEN)
def test_a_changed_motion_is_told_from_the_recorded_one(seen):
    """Chapter 2 lays them over each other."""
    assert apart(palette.COLORS["mocap"], palette.CYCLE[1], seen) > 15


def test_no_two_things_have_one_colour():
    colors = [*palette.COLORS.values(), *palette.CYCLE]
    assert not [pair for pair in combinations(colors, 2) if apart(*pair) < 12]


def test_other_names_take_the_cycle_by_turns():
    assert palette.color("acLSTM, seed 1", 3) == palette.COLORS["acLSTM"]
    assert palette.color("retargeted", 2) == palette.CYCLE[2]
    assert palette.color("many", len(palette.CYCLE) + 1) == palette.CYCLE[1]


def test_colours_of_the_cycle_have_matplotlibs_names():
    style = re.search(r"prop_cycle: .*\[(.*)\]", STYLE.read_text(encoding="utf-8"))[1]
    assert [f"#{color}" for color in re.findall(r"\w{6}", style)] == list(palette.CYCLE)
    assert palette.check_color("C1") == palette.CYCLE[1]
    assert palette.check_color(f"C{len(palette.CYCLE)}") == palette.CYCLE[0]
    assert palette.check_color("RNN") == palette.COLORS["RNN"]
    assert palette.check_color("white") == to_hex("white")
    with pytest.raises(ViewerError, match="no colour"):
        palette.check_color("C")


def test_lines_of_one_colour_have_other_dashes():
    looks = line_looks(["RNN", "RNN", *"abcdefgh"])
    assert looks[0]["color"] == looks[1]["color"]
    assert len({(look["color"], look["ls"]) for look in looks}) == len(looks)


def test_the_page_marks_what_is_asked_in_no_methods_colour():
    arrows = (ROOT / "web" / "src" / "steering" / "arrows.js").read_text(encoding="utf-8")
    assert re.search(r'ASKED = "(#\w+)"', arrows)[1] in palette.CYCLE
