"""`motionlab export`: a trained network for programs that have neither motionlab nor torch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from ..errors import MotionLabError
from .sample import check_writable


@dataclass(kw_only=True)
class Export:
    """One step of a trained network as ONNX, for engines: state in, a drawn frame and the state out."""

    model: Positional[Annotated[str, arg(metavar="NAME|WEIGHTS")]]
    """Shipped weights, such as lstm-gmm-permissive, or a file of your own."""
    onnx: bool = False
    """As ONNX, which is the only format so far."""
    out: Path | None = None
    """File to write; NAME.onnx if left out."""
    float32: bool = False
    """Weights in float32, twice the bytes, for runtimes that know no half precision."""
    force: bool = False
    """Replace a file that is there already."""

    def run(self) -> None:
        from ..weights import load
        from ..weights.export import check_has_step, export_onnx

        if not self.onnx:
            raise MotionLabError(f"export {self.model}: as what? There is one format: --onnx.")
        out = Path(f"{Path(self.model).stem}.onnx") if self.out is None else self.out
        if out.suffix.lower() != ".onnx":
            raise MotionLabError(f"--out {out}: the name must end in .onnx.")
        check_writable(out)
        if out.exists() and not self.force:
            raise MotionLabError(
                f"{out}: is there already; --force overwrites it, another --out leaves it."
            )
        model = load(self.model)
        check_has_step(model)
        export_onnx(model, out, half=not self.float32)
        starts = f", {len(model.start_names)} starts" if hasattr(model, "generate") else ""
        print(
            f"{out}: {out.stat().st_size / 1e6:.1f} MB; a step of {type(model).__name__}, "
            f"{model.fps:g} frames a second{starts}"
        )
