"""`motionlab prepare`: motion made ready for training."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from .folder import Folder


@dataclass
class Prepare:
    """Make motion ready for training: one file of features, splits and normaliser."""

    source: Positional[Annotated[str, arg(metavar="NAME|FOLDER")]]
    """Data set, as `data list` names it, or a folder of .bvh, .amc and .glb files."""
    permissive: bool = False
    """Leave out clips whose licence forbids commercial use."""
    out: Path | None = None
    """File to write; runs/NAME.npz, or runs/NAME-permissive.npz, if left out."""
    folder: OmitArgPrefixes[Folder] = field(default_factory=Folder)

    def run(self) -> None:
        from ..training import prepare
        from ..training.prepared import file_of

        out = self.out or file_of(self.source, self.permissive)
        prepared = prepare(
            self.source, progress=True, permissive=self.permissive, **self.folder.reading()
        )
        prepared.save(out)
        print(f"{out}: {len(prepared.names)} clips, {len(prepared.features)} frames, "
              f"hash {prepared.hash[:12]}")  # fmt: skip
