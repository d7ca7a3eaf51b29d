"""Train, validation and test: whole buildings, never floors, variants or plans of one building on two sides."""

import hashlib
from collections.abc import Mapping

from pipeline.errors import ConfigError

SPLITS = ("train", "validation", "test")


def split_buildings(floors: Mapping[str, int], shares: Mapping[str, float], seed: int) -> dict[str, str]:
    """Return the split of every building.

    floors: distinct floors of each building, its weight. shares: relative size of each split, in floors.
    Buildings come in the order of a seeded hash of their names; each goes to the split that is then least full for its
    share (as seats are given out by Sainte-Lague), the last ones to splits still empty. A building's place depends on
    names, weights and seed alone.

    Raises:
        ConfigError: the shares are not usable, or there are fewer buildings than splits to fill.
    """
    wanted = {split: share for split, share in shares.items() if share > 0}
    if set(shares) - set(SPLITS) or not wanted or any(not 0 <= share < float("inf") for share in shares.values()):
        raise ConfigError(f"rasterize.shares = {dict(shares)}: expected shares of at least 0 for {', '.join(SPLITS)}.")
    if len(floors) < len(wanted):
        raise ConfigError(
            f"rasterize.shares ask for {len(wanted)} splits ({', '.join(wanted)}), but there are only {len(floors)} "
            f"buildings ({', '.join(sorted(floors))}) and none is ever divided. Read more or set a share to 0."
        )
    filled = dict.fromkeys(wanted, 0)
    place = {}
    order = sorted(floors, key=lambda name: _hash(name, seed))
    for remaining, building in zip(range(len(order), 0, -1), order, strict=True):
        empty = [split for split in wanted if filled[split] == 0]
        open_to = empty if len(empty) == remaining else list(wanted)
        weight = floors[building]
        split = min(open_to, key=lambda name: (filled[name] + weight / 2) / wanted[name])
        filled[split] += weight
        place[building] = split
    return place


def _hash(building: str, seed: int) -> str:
    return hashlib.sha256(f"{seed}\x1f{building}".encode()).hexdigest()
