"""Examples with a simple rule, and settings small enough for a test."""

import dataclasses
from typing import Any

import numpy as np
import torch

from pipeline.learning.examples import Examples
from pipeline.learning.fit import FitSettings

SMALL = FitSettings(
    steps=60,
    batch_size=32,
    learning_rate=0.01,
    decay=0.9,
    decay_every=25,
    hidden=(16, 8),
    dropout=0.25,
    success_weight=1.0,
    exploration_weight=1.0,
    target_scaling="standardise",
    validate_every=10,
    seed=5,
)


def small(**changes: Any) -> FitSettings:
    return dataclasses.replace(SMALL, **changes)


def make_examples(count: int, seed: int, inputs: int = 12) -> Examples:
    """Leads to the goal where one input exceeds another; the costs are two other inputs."""
    values = np.random.default_rng(seed).uniform(0.0, 10.0, (count, inputs)).astype(np.float32)
    leads = values[:, 0] > values[:, 1]
    labels = [leads, np.where(leads, values[:, 2], 0.0), np.where(leads, 0.0, values[:, 3]), np.ones(count)]
    return Examples(
        inputs=torch.from_numpy(values), labels=torch.from_numpy(np.stack(labels, axis=1).astype(np.float32))
    )
