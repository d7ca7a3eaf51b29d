"""What chance decides in a training: a function of the seed and, while it runs, of the step alone."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from pipeline.randomness import stream


@contextmanager
def first_weights(seed: int) -> Iterator[None]:
    """Make the weights of networks made inside depend on ``seed`` alone, and leave torch's generator as it was."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(stream(seed, "weights").integers(2**62)))
        yield


def first_step_seed(seed: int) -> int:
    """Return what the seed of a step exceeds the step's number by."""
    return int(stream(seed, "dropout").integers(2**62))


def seed_step(seed: int, device: torch.device) -> None:
    """Make what is drawn next on ``device``, such as dropout, a function of ``seed``."""
    # torch.manual_seed would queue a stack trace for each kind of device at every step, and keep them all.
    torch.default_generator.manual_seed(seed)
    if device.type == "cuda":
        torch.cuda.manual_seed(seed)
