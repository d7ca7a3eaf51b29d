"""Randomness is an argument: one independent stream per purpose, named, never shared."""

import hashlib

import numpy as np


def stream(seed: int, *names: str | int) -> np.random.Generator:
    """Return the generator that belongs to ``names`` under ``seed``.

    The same names give the same stream whatever else was drawn before, so results do not depend on the
    number of workers, the order of work or a restart.
    """
    digest = hashlib.sha256("\x1f".join(str(name) for name in names).encode()).digest()
    return np.random.default_rng([seed, *np.frombuffer(digest, dtype=np.uint32).tolist()])
