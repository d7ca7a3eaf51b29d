"""Rows with simple rules, networks for them, and settings small enough for a test."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from lightning.pytorch import LightningModule
from torch import Tensor, nn
from torch.nn import functional

from pipeline.learning.fit import FitSettings
from pipeline.learning.rows import Rows
from pipeline.learning.seeding import first_weights

SMALL = FitSettings(steps=60, batch_size=32, validate_every=10, seed=5)


def small(**changes: Any) -> FitSettings:
    return dataclasses.replace(SMALL, **changes)


def make_examples(count: int, seed: int, inputs: int = 12) -> Rows:
    """Examples of subgoals. Leads to the goal where one input exceeds another; the costs are two other inputs."""
    values = np.random.default_rng(seed).uniform(0.0, 10.0, (count, inputs)).astype(np.float32)
    leads = values[:, 0] > values[:, 1]
    targets = np.stack([np.where(leads, values[:, 2], 0.0), np.where(leads, 0.0, values[:, 3])], axis=1)
    return Rows(
        {
            "inputs": torch.from_numpy(values),
            "leads": torch.from_numpy(leads.astype(np.float32)),
            "targets_m": torch.from_numpy(targets.astype(np.float32)),
            "weight": torch.ones(count),
        }
    )


def make_pictures(count: int, seed: int) -> Rows:
    """Pictures [3, 16, 16] of bytes, and a plan [32, 32] of packed bits; the side on which the picture is brighter."""
    rng = np.random.default_rng(seed)
    bright = rng.integers(0, 2, count)
    pictures = rng.integers(0, 160, (count, 3, 16, 16), dtype=np.uint8)
    for row, side in enumerate(bright):
        pictures[row, :, :, 8 * side : 8 * side + 8] += 90
    bits = np.packbits(rng.random((count, 32, 32)) < 0.5, axis=2)
    return Rows(
        {"picture": torch.from_numpy(pictures), "plan": torch.from_numpy(bits), "side": torch.from_numpy(bright)}
    )


class PictureNet(nn.Module):
    """Convolutions with batch norm over a picture of bytes, then dropout and a linear head."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Sequential(
            nn.Conv2d(3, 4, 3, stride=2), nn.BatchNorm2d(4), nn.ReLU(), nn.Conv2d(4, 4, 3, stride=2), nn.ReLU()
        )
        self.head = nn.Sequential(nn.Flatten(), nn.Dropout(0.25), nn.Linear(4 * 3 * 3, 2))

    def forward(self, picture: Tensor) -> Tensor:
        out: Tensor = self.head(self.stem(picture.float() / 255.0))
        return out


class PictureTraining(LightningModule):
    """A small convolutional network, trained as anybody would."""

    def __init__(self, net: nn.Module, learning_rate: float = 0.02) -> None:
        super().__init__()
        self.net, self.learning_rate = net, learning_rate

    def losses(self, batch: Mapping[str, Tensor]) -> dict[str, Tensor]:
        logits = self.net(batch["picture"])
        loss = functional.cross_entropy(logits, batch["side"])
        return {"loss": loss, "accuracy": (logits.argmax(dim=1) == batch["side"]).float().mean()}

    def training_step(self, batch: Mapping[str, Tensor], _: int) -> dict[str, Tensor]:
        return self.losses(batch)

    def configure_optimizers(self) -> Any:
        optimizer = torch.optim.SGD(self.parameters(), lr=self.learning_rate, momentum=0.9)
        schedule = torch.optim.lr_scheduler.StepLR(optimizer, 15, 0.8)
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step", "frequency": 2}}


def picture_training(seed: int = 5) -> PictureTraining:
    with first_weights(seed):
        return PictureTraining(PictureNet())
