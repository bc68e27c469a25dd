"""Frames per second of a BVH file: the seconds between two frames, or what stands there instead."""

from __future__ import annotations

import re

from .bvh_header import Layout
from .bvh_text import hint, is_number

# Seconds between two frames. Beyond the outer ones nothing moves like that; between outer and inner
# ones it might: time lapse, or a camera for high speed.
_POSSIBLE = (1e-6, 5.0)
_USUAL = (0.001, 1.0)
_UNITS = r"(.*?) ?(s|sec|secs|second|seconds|(?P<ms>ms|msec|msecs|milliseconds)|(?P<fps>fps|hz))?"
# At which people record and exporters write.
RATES = (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 90, 100, 120, 144, 180, 200, 240, 250, 300)
_DIGITS = 0.03  # a rate is recognised within this share of it: 33 ms are 30.3 frames per second


def rate_of(layout: Layout) -> tuple[float, str | None]:
    """Frames per second, and what to say if that is unusual.

    Most headers round their frame time to six or seven digits: a rate within 0.01 % of a whole
    number is that number.
    """
    number, text = layout.time
    word, _, milli, rate = re.fullmatch(_UNITS, text, re.IGNORECASE).groups()
    if not is_number(word):
        layout.fail(number, f"{word[:20]!r} is not a number", hint(word))
    value = float(word)
    seconds = value / 1000 if milli else (1 / value if rate and value else value)
    what, then = _meant(seconds)
    if not _POSSIBLE[0] <= seconds <= _POSSIBLE[1]:
        layout.fail(
            number,
            f"the frame time is {seconds:g} s{what}",
            f"put the seconds between two frames there, or read the file with {then}",
        )
    doubt = None
    if not _USUAL[0] <= seconds <= _USUAL[1]:
        doubt = (
            f"line {number}: a frame time of {seconds:g} s is {1 / seconds:.4g} frames per "
            f"second{what}; if that is not so, read the file with {then}."
        )
    return whole(1 / seconds), doubt


def whole(rate: float) -> float:
    """A rate without what was rounded in its file."""
    whole = round(rate)
    return float(whole) if abs(rate - whole) < 1e-4 * rate else round(rate, 6)


def _meant(value: float) -> tuple[str, str]:
    """What a number that is no time in seconds looks like, and the argument that says so."""
    found = {"a rate": value} if _near(value) else {}
    for scale, unit in ((1e3, "milliseconds"), (1e6, "microseconds")):
        if value > 0 and (rate := _near(scale / value)):
            found[unit] = rate
    if not found:
        return "", "fps="
    then = " or ".join(f"fps={rate:g}" for rate in found.values())
    return f", which looks like {' or '.join(found)}", then


def _near(rate: float) -> float | None:
    """The usual rate that is meant by one."""
    nearest = min(RATES, key=lambda usual: abs(usual - rate))
    return nearest if abs(nearest - rate) < _DIGITS * nearest else None
