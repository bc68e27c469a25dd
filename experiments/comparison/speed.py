"""How many frames a second, as a ratio to one method in the same run: seconds of processor, one thread.

All that it takes from recorded joints to made ones counts: warming up, generating, decoding. The reference is
measured anew beside each turn of each method, so that a busy machine slows both.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence

import torch

from .begun import Begun
from .columns import CHARACTERS
from .methods import Method

FRAMES, TURNS = 60, 3
REFERENCE = "RNN, as it ships"


def ratios(
    method: Method, reference: Method, begun: Begun, counts: Sequence[int] = CHARACTERS
) -> dict[str, float | None]:
    """A method's frames a second over the reference's, by number of characters.

    None where it is too dear.
    """
    found: dict[str, float | None] = {}
    for count in counts:
        if str(count) in method.without:
            found[str(count)] = None
            continue
        many = begun[torch.arange(count) % len(begun)]
        each = [seconds(reference, many) / seconds(method, many) for _ in range(TURNS)]
        found[str(count)] = statistics.median(each)
    return found


@torch.no_grad()
def seconds(method: Method, begun: Begun) -> float:
    begin = time.process_time()
    method.go_on(begun, FRAMES, seed=0)
    return time.process_time() - begin
