"""Windows of equal length, cut from clips of any length."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from ..errors import TrainingError


class Windows:
    """All windows of some frames in a list of clips; clips shorter than that have none.

    Parameters
    ----------
    clips : list of (frames, dim).
    frames : length of a window.
    often : which frames (frames,) of each clip are to be seen more often than they are recorded;
        None: none is.
    share : of the windows that are drawn, those of which more than half are such frames.

    Raises
    ------
    TrainingError : no clip is long enough.
    """

    def __init__(
        self,
        clips: Sequence[Tensor],
        frames: int,
        often: Sequence[Tensor] | None = None,
        share: float = 0.0,
    ) -> None:
        lengths = [len(clip) for clip in clips]
        if max(lengths, default=0) < frames:
            raise TrainingError(
                f"All {len(lengths)} clips are shorter than a window of {frames} frames (the longest "
                f"has {max(lengths, default=0)}); train on longer clips, or with fewer frames."
            )
        self.rows = torch.cat(list(clips))  # (all rows, dim)
        ends = torch.tensor(lengths).cumsum(0).tolist()
        spans = [range(end - n, end - frames + 1) for end, n in zip(ends, lengths, strict=True)]
        starts = torch.tensor([start for span in spans for start in span])
        which = torch.zeros(len(starts), dtype=torch.bool)
        if often is not None:
            so_far = torch.cat([torch.zeros(1), torch.cat(list(often)).cumsum(0)])
            which = so_far[starts + frames] - so_far[starts] > frames / 2
        self._often, self._share = starts[which], 1.0 if which.all() else share
        self._other = starts[~which]
        # one after the other, the last one moved back so that it ends with the clip
        tiles = [start for span in spans if span for start in {*span[::frames], span[-1]}]
        self._tiles = torch.tensor(sorted(tiles))
        self._within = torch.arange(frames)

    def draw(self, count: int, generator: torch.Generator) -> Tensor:
        """Windows (count, frames, dim), each as likely as any other of its kind."""
        many = round(self._share * count) if len(self._often) else 0
        kinds = [(self._often, many), (self._other, count - many)]
        drawn = [
            starts[torch.randint(len(starts), (some,), generator=generator)]
            for starts, some in kinds
            if some
        ]
        return self._cut(torch.cat(drawn))

    def tiles(self, batch: int) -> list[Tensor]:
        """Windows (at most batch, frames, dim) that together cover every clip."""
        return [self._cut(starts) for starts in self._tiles.split(batch)]

    def _cut(self, starts: Tensor) -> Tensor:
        return self.rows[starts[:, None] + self._within]
