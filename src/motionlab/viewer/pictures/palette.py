"""One colour per method through the whole book.

The hues are those of Okabe and Ito (2008), chosen to be told apart by colour-blind readers too, a
little softened so that they sit on a white and on a black page alike. Mocap is always grey.
"""

from __future__ import annotations

from ...errors import ViewerError

COLORS = {
    "mocap": "#9aa3ad",
    "gaits": "#7f9bb3",
    "RNN": "#d98324",
    "GAN1": "#4aa8dc",
    "GAN2": "#1d72b4",
    "RNN+c": "#e3b93a",
    "GAN2+lock": "#5b5fc7",
    "acLSTM": "#1f9e7a",
    "LSTM-3LR": "#8f9e3b",
    "scheduled": "#7d8fd1",
    "ERD": "#a6761d",
    "seq2seq": "#8c6bb1",
    "STRNN": "#c9689c",
    "PFNN": "#c8503c",
}
# Order for motions that are not named after a method.
CYCLE = ("#4c86b8", "#d98324", "#1f9e7a", "#c9689c", "#e3b93a", "#5b5fc7", "#c8503c", "#9aa3ad")
PATH = "#e3b93a"


def color(name: str, index: int = 0) -> str:
    """The hex colour of a method; for any other name the `index`-th of the cycle.

    What follows a comma does not count: "acLSTM, seed 1" is acLSTM's.
    """
    return COLORS.get(name.partition(",")[0], CYCLE[index % len(CYCLE)])


def check_color(value: str, argument: str = "color") -> str:
    """Give back a hex colour; method names and matplotlib's colour names are understood too.

    `argument` is what errors call it.
    """
    from matplotlib.colors import to_hex

    try:
        return COLORS[value] if value in COLORS else to_hex(value)
    except (ValueError, TypeError) as error:
        raise ViewerError(
            f"{argument}: {value!r} is no colour. Use a method's name ({', '.join(COLORS)}), "
            "a name matplotlib knows or a hex code such as '#4c86b8'."
        ) from error
