"""One colour per method through the whole book, and others for what is no method.

Methods are bright, the cycle for all else is muted, mocap is grey. Every colour has a contrast of 3:1
with a light and with a dark page; those that stand together differ for colour-blind readers, too
(deuteranopia and protanopia as Machado, Oliveira and Fernandes 2009 model them; a test measures it).
"""

from __future__ import annotations

import re

from ...errors import ViewerError

COLORS = {
    "mocap": "#636669",
    "gaits": "#4c6d8e",
    "RNN": "#dc740a",
    "GAN1": "#3a9fa6",
    "GAN2": "#1588ee",
    "RNN+c": "#8b6729",
    "GAN2+lock": "#7d50b2",
    "acLSTM": "#1e8f5a",
    "LSTM-3LR": "#6989ca",
    "scheduled": "#607226",
    "ERD": "#ac8517",
    "seq2seq": "#b47fa0",
    "STRNN": "#e34e91",
    "PFNN": "#d11828",
}
# By turns, for what is not named after a method; "C0" is the first of them, as in matplotlib. Slate and
# earth first: plum and pine, whose hues are near those of GAN2+lock and GAN1, come last.
CYCLE = ("#7a95a3", "#b08781", "#786249", "#8e8f5f", "#755e86", "#356f67")
PATH = "#e3b93a"  # on the ground and the board, with a rim


def color(name: str, index: int = 0) -> str:
    """The hex colour of a method; for any other name the `index`-th of the cycle.

    What follows a comma does not count: "acLSTM, seed 1" is acLSTM's.
    """
    return COLORS.get(name.partition(",")[0], CYCLE[index % len(CYCLE)])


def check_color(value: str, argument: str = "color") -> str:
    """Give back a hex colour; method names, "C0" and matplotlib's other names are understood too.

    `argument` is what errors call it.
    """
    from matplotlib.colors import to_hex

    if isinstance(value, str) and (turn := re.fullmatch(r"C(\d+)", value)):
        return CYCLE[int(turn[1]) % len(CYCLE)]
    try:
        return COLORS[value] if value in COLORS else to_hex(value)
    except (ValueError, TypeError) as error:
        raise ViewerError(
            f"{argument}: {value!r} is no colour. Use a method's name ({', '.join(COLORS)}), "
            "a name matplotlib knows or a hex code such as '#7a95a3'."
        ) from error
