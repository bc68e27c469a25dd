"""What a rule returns."""

from __future__ import annotations

from typing import NamedTuple

REPRODUCED, PARTLY, NOT = "reproduced", "partly", "not reproduced"
UNTESTABLE, OPEN = "not testable here", "open"
BADGES = {  # classes of their badges in the book
    REPRODUCED: "reproduced",
    PARTLY: "partly",
    NOT: "not",
    UNTESTABLE: "untestable",
    OPEN: "open",
}
VERDICTS = tuple(BADGES)
GONE = "part of the excess that is gone (1 is all of it)"  # a number of W8's verdicts


class Verdict(NamedTuple):
    """One of VERDICTS, the numbers behind it, and what must be said with it."""

    verdict: str
    numbers: dict[str, float | str]
    remark: str = ""


class Absent(Exception):
    """What a verdict needs has not been measured yet."""
