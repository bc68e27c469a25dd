"""Networks that foretell one frame at a time, those of chapter 4 and a CRBM, on STRNN's rows."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import nn

from motionlab.models import AcLstm, Crbm, Erd, Seq2Seq
from motionlab.models.erd import noise_schedule
from motionlab.training import Prepared, Preset
from motionlab.training.strnn import in_body_frame
from motionlab.training.windows import Windows

METHODS = ("lstm-3lr", "erd", "seq2seq", "crbm")
ORDER = 3  # frames that the CRBM looks back


@dataclass(frozen=True)
class RivalPreset(Preset):
    """Settings of a training of one of `METHODS`, each as its paper has it."""

    method: str = "lstm-3lr"

    def windows(self, data: Prepared, split: str) -> Windows:
        """Windows of the body's frame of a split."""
        return Windows(in_body_frame(data).clips(split), self.frames)

    def extras(self, shape: torch.Size, update: int, generator: torch.Generator) -> dict:
        """Noise, more and more of it, on every second frame or so of an ERD; a CRBM's chance."""
        if self.method == "crbm":
            return {"lots": torch.randint(2**31, shape[:1], generator=generator)}
        if self.method != "erd":
            return {}
        hit = torch.rand(shape[:2], generator=generator) < 0.5
        spread = noise_schedule(update / self.updates)
        return {"noise": spread * torch.randn(shape, generator=generator) * hit[..., None]}

    def model(self, data: Prepared) -> nn.Module:
        """An untrained network for some data; widths that give about as many parameters."""
        data = in_body_frame(data)
        if self.method == "erd":
            return Erd(data.encoding, data.normalizer, 5 * self.width // 4)
        if self.method == "seq2seq":
            return Seq2Seq(
                data.encoding, data.normalizer, 5 * self.width // 2, seen=self.frames // 2
            )
        if self.method == "crbm":
            return Crbm(data.encoding, data.normalizer, 4 * self.width, ORDER)
        return AcLstm(data.encoding, data.normalizer, self.width)
