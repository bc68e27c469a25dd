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
    methods: Sequence[Method], begun: Begun, counts: Sequence[int] = CHARACTERS, turns: int = TURNS
) -> dict[str, dict[str, float | None]]:
    """Of each method its frames a second over the reference's, by number of characters.

    None where a method is too dear. The reference is the method of that title.
    """
    reference = next(method for method in methods if method.title == REFERENCE)
    found: dict[str, dict] = {method.title: {} for method in methods}
    for count in counts:
        many = begun[torch.arange(count) % len(begun)]
        for method in methods:
            if str(count) in method.without:
                found[method.title][str(count)] = None
                continue
            each = [seconds(reference, many) / seconds(method, many) for _ in range(turns)]
            found[method.title][str(count)] = statistics.median(each)
    return found


@torch.no_grad()
def seconds(method: Method, begun: Begun) -> float:
    begin = time.process_time()
    method.go_on(begun, FRAMES, seed=0)
    return time.process_time() - begin
