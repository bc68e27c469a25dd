"""`motionlab clean`: feet that stand still where they rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ..motion import Motion
from .convert import Written


@dataclass(kw_only=True)
class Clean(Written):
    """Label which foot is down when, and hold feet still on the floor while they are."""

    def change(self, motion: Motion, file: Path) -> tuple[Motion, list[str]]:
        from ..contacts import foot_points, label
        from ..feet.lock import lock_feet
        from ..metrics import foot_skate

        motion = replace(motion, contacts=label(motion, "speed-height"))
        cleaned = lock_feet(motion, floor=None)
        moved = 100 * (cleaned.positions() - motion.positions()).norm(dim=-1).amax(0)
        feet = foot_points(motion.skeleton)
        toes = motion.contacts[:, [1, 3]]
        if not toes.any():
            return motion, ["no toe rests, so that nothing was changed"]
        was, is_ = (
            foot_skate(each.positions(), toes, each.skeleton, each.fps)
            for each in (motion, cleaned)
        )
        slid = "" if was.isnan() else f", sliding {was:.1f} cm/s and now {is_:.1f}"
        return cleaned, [
            f"toes down {toes.float().mean():.0%} of the time{slid}; feet moved by up to "
            f"{moved[feet].max():.1f} cm, any joint by {moved.max():.1f}"
        ]
