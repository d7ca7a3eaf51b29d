"""Start-goal pairs in blocks: what one unit of a harvest or of an evaluation works on."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.errors import TableError
from pipeline.grids.store import PackedWorld, Pair, read_packed_worlds, read_pairs


@dataclass(frozen=True)
class PairBlock:
    """Pairs, and the plans they lie in, still packed."""

    pairs: Sequence[Pair]
    worlds: dict[str, PackedWorld]


def pairs_in_blocks(source: Path, split: str, size: int, *, robot_radius_m: float, otherwise: str) -> list[PairBlock]:
    """Return the pairs of ``split``, in the order of their table, ``size`` at a time.

    robot_radius_m: of the robot that is to drive them. otherwise: what else somebody may do who has no pairs.

    Raises:
        TableError: there are none, they were made for another robot, or the tables in ``source`` cannot be read.
    """
    pairs = read_pairs(source, split)
    if not pairs:
        raise TableError(
            f"{source / 'pairs.parquet'}: no start-goal pairs in the split {split!r}, expected at least one. "
            f"Raise the share or count of its plans in conf/rasterize or conf/plans, or {otherwise}."
        )
    worlds = {world.plan_id: world for world in read_packed_worlds(source, split, robot_radius_m=robot_radius_m)}
    blocks = [pairs[first : first + size] for first in range(0, len(pairs), size)]
    return [PairBlock(block, {pair.plan_id: worlds[pair.plan_id] for pair in block}) for block in blocks]
