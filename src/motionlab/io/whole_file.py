"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from ..errors import MotionFileError


def put_whole(path: Path, content: bytes, error: type[MotionFileError] = MotionFileError) -> None:
    """Write a file, in place of one of that name; raises an error of the kind given if it can't be."""
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f"{path.suffix}-") as folder:
            whole = Path(folder) / f"whole{path.suffix}"
            whole.write_bytes(content)
            os.replace(whole, path)
    except (OSError, ValueError) as fault:  # ValueError: a path with a zero byte
        reason = getattr(fault, "strerror", None) or fault
        raise error(f"{path}: can't be written ({reason}); check folder and rights.") from fault
