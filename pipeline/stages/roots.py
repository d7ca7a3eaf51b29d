"""Where plans are read from, and the split that plans go to: that of their folder, one for all, or their manifest's."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

from pipeline.errors import PlanError
from pipeline.floorplans.checks import Checked
from pipeline.grids.splits import SPLITS, split_buildings
from pipeline.settings import require

KEY = "plans.roots"


class Root(NamedTuple):
    """A folder, file or archive to read, and the split that its plans go to; None: what they say themselves."""

    path: Path
    split: str | None = None


@dataclass(frozen=True, kw_only=True)
class RootsConfig:
    """What to read for each split: a folder, file or archive, or a list of them (conf/plans/, section roots)."""

    train: Any = None
    validation: Any = None
    """null: some buildings of train, see plans.validation_share."""
    test: Any = None

    def __post_init__(self) -> None:
        """Refuse what is no path, and plans that would be read twice."""
        for split in SPLITS:
            given = getattr(self, split)
            fine = given is None or _is_path(given) or (isinstance(given, list) and given and all(map(_is_path, given)))
            require(bool(fine), f"{KEY}.{split}", given, "a folder, file or archive, a list of them, or null")
        for one, other in combinations(self.listed(), 2):
            for inner, outer in ((one, other), (other, one)):
                apart = not inner.path.absolute().is_relative_to(outer.path.absolute())
                name = f"{KEY}.{inner.split}"
                require(apart, name, inner.path, f"a place apart from {outer.path} ({outer.split}), not one within it")

    def listed(self) -> list[Root]:
        """Return all there is to read, in the order of the splits."""
        return [Root(Path(path), split) for split in SPLITS for path in _list(getattr(self, split))]


def sent_to(split: str, found: Sequence[Checked], key: str) -> list[Checked]:
    """Return the plans with ``split``, and tell how many said another one themselves. key: what sends them."""
    overruled = Counter(plan.split for plan, _ in found if plan.split not in (None, split))
    if overruled:
        counts = ", ".join(f"{name} {count}" for name, count in sorted(overruled.items(), key=str))
        print(f"plans: {overruled.total()} plans go to {split}, as {key} says; their manifest or file said: {counts}")
    return [Checked(replace(plan, split=split), report) for plan, report in found]


def whole_buildings(found: Sequence[Checked]) -> list[Checked]:
    """Return the plans with the split of their building where they have none themselves.

    Raises:
        PlanError: two plans of one building are in different splits.
    """
    places: dict[str, Checked] = {}
    for each in found:
        if each.plan.split is None:
            continue
        before = places.setdefault(each.plan.building, each).plan
        if before.split != each.plan.split:
            raise PlanError(
                f"building {before.building} is in two splits: plan {before.plan_id} ({before.source}) in "
                f"{before.split}, plan {each.plan.plan_id} ({each.plan.source}) in {each.plan.split}. Put it into one; "
                "where these are two buildings of one name, say so in a manifest.csv (columns file, building)."
            )
    following = [each for each in found if each.plan.split is None and each.plan.building in places]
    if following:
        print(f"plans: {len(following)} plans without a split go where others of their building are")
    fates = {building: each.plan.split for building, each in places.items()}
    return [Checked(replace(plan, split=fates.get(plan.building)), report) for plan, report in found]


def set_aside(found: Sequence[Checked], share: float, seed: int) -> list[Checked]:
    """Return the training plans with ``share`` of their floors, whole buildings, in validation; tell how many."""
    floors: defaultdict[str, set[str]] = defaultdict(set)
    for plan, _ in found:
        if plan.split == "train":
            floors[plan.building].add(plan.floor)
    if len(floors) < 2:
        print(f"plans: {KEY}.train holds {len(floors)} buildings, none can be set aside: give {KEY}.validation")
        return list(found)
    weights: Mapping[str, int] = {building: len(names) for building, names in floors.items()}
    split = split_buildings(weights, {"train": 1.0 - share, "validation": share}, seed)
    moved = sorted(building for building, fate in split.items() if fate == "validation")
    print(f"plans: {len(moved)} of {len(floors)} buildings of {KEY}.train are set aside for validation")
    return [Checked(replace(plan, split=split.get(plan.building, plan.split)), report) for plan, report in found]


def _is_path(given: Any) -> bool:
    return isinstance(given, str) and bool(given)


def _list(given: Any) -> Iterator[str]:
    if given is not None:
        yield from [given] if isinstance(given, str) else given
