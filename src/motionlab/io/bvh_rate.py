"""Frames per second of a BVH file: the seconds between two frames, or what stands there instead."""

from __future__ import annotations

import re
from decimal import Decimal

from .bvh_header import Layout
from .bvh_text import hint, is_number

# Seconds between two frames. Beyond the outer ones nothing moves like that; between outer and inner
# ones it might: time lapse, or a camera for high speed.
_POSSIBLE = (1e-6, 5.0)
_USUAL = (0.001, 1.0)
_UNITS = r"(.*?) ?(s|sec|secs|second|seconds|(?P<ms>ms|msec|msecs|milliseconds)|(?P<fps>fps|hz))?"
# At which people record and exporters write.
RATES = (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 90, 100, 120, 144, 180, 200, 240, 250, 300)
# Whole rates that a time of few decimals is taken for, and the decimals that a header may have.
_WHOLE = range(20, 481)
_DECIMALS = range(4, 8)
_NTSC = [rate * 1000 / 1001 for rate in (24, 30, 48, 60, 120, 240)]  # 29.97 is the best known
_DIGITS = 0.03  # a rate is recognised within this share of it: 33 ms are 30.3 frames per second


def rate_of(layout: Layout) -> tuple[float, str | None]:
    """Frames per second, and what to say if that is unusual or not clear.

    Most headers round their frame time, or cut it off. Of one with four to seven decimals the rate
    from 20 to 480 that it can mean is taken, a whole one before 29.97 and its like; where two can be
    meant, neither is, and both are told. Of others a rate within 0.01 % of a whole number is that
    number.
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
    if rate:
        return whole(value), doubt
    meant = _rates_of(word, milli)
    if len(meant) == 1:
        return meant[0], doubt
    if len(meant) > 1 and 1 / seconds not in meant:
        as_read = round(1 / seconds, 6)
        doubt = (
            f"line {number}: a frame time of {word} s is that of {meant[0]:g} to {meant[-1]:g} frames "
            f"per second, rounded; it is read as {as_read:g}: if another was meant, read the file "
            f"with fps={_usual(meant):g}."
        )
        return as_read, doubt
    return whole(1 / seconds), doubt


def _rates_of(word: str, milli: str | None) -> list[float]:
    """The rates whose time between two frames, rounded or cut off to the word's decimals, is the word;
    those of television where no whole one is."""
    time, step = Decimal(word), Decimal(1)
    if milli:
        time, step = time / 1000, step / 1000
    step = step.scaleb(Decimal(word).as_tuple().exponent)
    if -step.adjusted() not in _DECIMALS:
        return []
    low, high = (
        float(time - step / 2),
        float(time + step),
    )  # rounded up from the one, cut to the other
    for rates in (_WHOLE, _NTSC):
        if found := [round(float(rate), 6) for rate in rates if low <= 1 / rate < high]:
            return found
    return []


def _usual(rates: list[float]) -> float:
    """That which people record at, or else the one in the middle."""
    return next((rate for rate in rates if rate in RATES), rates[len(rates) // 2])


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
