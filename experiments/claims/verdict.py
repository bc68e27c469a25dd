"""What a rule returns."""

from __future__ import annotations

from typing import NamedTuple

REPRODUCED, PARTLY, NOT = "reproduced", "partly", "not"
UNTESTABLE, OPEN = "not testable here", "open"
GONE = "part of the excess that is gone (1 is all of it)"  # a number of W8's verdicts
VERDICTS = (REPRODUCED, PARTLY, NOT, UNTESTABLE, OPEN)


class Verdict(NamedTuple):
    """One of VERDICTS, the numbers behind it, and what must be said with it."""

    verdict: str
    numbers: dict[str, float | str]
    remark: str = ""


class Absent(Exception):
    """What a verdict needs has not been measured yet."""
