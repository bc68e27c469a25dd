"""Half of many clips, done by a second process.

Clips do not wait for each other. But Python does one thing at a time, and of a single clip there is
too little to share between torch's threads. So where many are brought to another body, and torch may
use more than one thread, every second one is left to another Python. Each clip is done as it would
have been done here: what comes out does not depend on who did it.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Self

from ..motion import Motion
from .registry import Clip

_DO = "from motionlab.datasets import beside, loader; beside.answer(loader.ready)"


class Second(AbstractContextManager):
    """Another Python that makes clips of a data set ready, as `loader.ready` does, until it is left."""

    def __init__(self, name: str, clips: Sequence[Clip]) -> None:
        self._asked, self._told = tempfile.TemporaryFile(), tempfile.TemporaryFile()
        pickle.dump((name, clips), self._asked)
        self._asked.seek(0)
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _DO],
                stdin=self._asked, stdout=self._told, stderr=subprocess.DEVNULL,
            )  # fmt: skip
        except OSError:  # where Python lives in another program, or in a browser
            self._process = None

    def motions(self) -> list[Motion] | None:
        """The clips, once they are ready; None if the other Python failed, whatever the reason."""
        if self._process is None or self._process.wait() != 0:
            return None
        self._told.seek(0)
        return pickle.load(self._told)

    def __exit__(self, *_) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._asked.close()
        self._told.close()

    def __enter__(self) -> Self:
        return self


def answer(ready: Callable[[str, Sequence[Clip]], list[Motion]]) -> None:
    """Do what a `Second` was asked for, in the process that it started."""
    told, sys.stdout = sys.stdout.buffer, sys.stderr
    pickle.dump(ready(*pickle.load(sys.stdin.buffer)), told)
    told.flush()
