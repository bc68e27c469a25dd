"""`motionlab look`: a page that plays a file, from disk and by itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..io.bvh_reading import Doubts, Reading
from ..motion import Motion
from .choices import shown_first
from .clips import Clips
from .options import as_options


@shown_first("path", "out", "height", "open")
@dataclass(kw_only=True)
class Look(Clips):
    """A page that plays a file of motion; it opens in a browser, from disk, without a network."""

    out: Path | None = None
    """File to write, or a folder for many; NAME.html, or NAME_pages, if left out."""
    height: int = 560
    """Of the picture, pixels."""
    open: bool = False
    """Open the page in the browser, too."""

    def run(self) -> None:
        if self.out is None:
            name = self.path.resolve()
            folder = self.path.is_dir()
            self.out = Path(f"{name.name}_pages" if folder else f"{name.stem}.html")
        self.work(".html", self._page, (".html",))

    def read(self, file: Path, how: Reading) -> tuple[Motion, Doubts]:
        motion, self._doubts = super().read(file, how)
        return motion, self._doubts

    def _page(self, motion: Motion, _: Path, target: Path) -> str:
        import webbrowser

        from ..training.checkpoints import write_whole
        from ..viewer import show
        from ..viewer.live.whole_page import whole_page

        about = (
            f"{motion.skeleton.joints} joints, {len(motion)} frames, {motion.seconds:.2f} s, "
            f"{motion.fps:g} fps"
        )
        figure = show(motion, height=self.height, page=True)
        notes = [as_options(said) for said in self._doubts.values()]
        page = whole_page(figure, motion.name, about, notes)
        write_whole(target, lambda stream: stream.write(page.encode()))
        if self.open:
            webbrowser.open(target.resolve().as_uri())
        return f"{about}; open it in a browser"
