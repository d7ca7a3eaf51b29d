"""What a research system offers to the stages, and where a system is found.

The stages drive; a system is a folder that says what is harvested, fitted, compared and drawn. Its ``system.py`` holds
one record, `System`, whose heavier parts are named as ``package.module:attribute`` and imported when a stage needs
them, so that looking at a configuration stays quick and a planner in a worker imports no network library.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
import pyarrow as pa

from pipeline.errors import ConfigError
from pipeline.evaluation.competitors import Competitor, Outcome
from pipeline.grids.store import Pair
from pipeline.parts import Part, find_part, resolve, settings_of
from pipeline.simulation.ground import Ground
from pipeline.source_code import folder_of

PLACE = "pipeline.systems.{name}.system:SYSTEM"

Config = TypeVar("Config")


@dataclass(frozen=True, kw_only=True)
class Job:
    """What a stage works with.

    seed: of the data; every stream is drawn from it by name. artifacts: the folder of all outputs.
    resolution_m: side of a cell of the grids that are driven on, all of them where they differ; None where a stage
        drives nowhere.
    sections: the typed sections of the configuration that the stage may read, by name.
    """

    seed: int
    artifacts: Path
    sections: Mapping[str, Any]
    resolution_m: float | list[float] | None = None

    def folder(self, stage: str) -> Path:
        """Return the output folder of ``stage``."""
        return self.artifacts / stage

    def section(self, name: str, kind: type[Config]) -> Config:
        """Return section ``name``, which the system types as ``kind``."""
        found = self.sections[name]
        if not isinstance(found, kind):
            raise TypeError(f"section {name} is a {type(found).__name__}, expected {kind.__name__}")
        return found


class Harvested(NamedTuple):
    """What the harvest left behind.

    numbers: counts and shares, for harvest.json and the report; digest: of the tables' content; sentence: for people.
    """

    numbers: dict[str, Any]
    digest: str
    sentence: str


@dataclass(frozen=True, kw_only=True)
class Harvest:
    """What a system learns from: units of work that each leave one file or folder.

    folder: below artifacts/harvest. suffix: of a unit's name; empty where it is a folder.
    units: the work, from the grids and pairs of artifacts/rasterize; each unit is picklable.
    make: called as ``make(scratch, unit, job=job)`` in a worker process, writes one unit at the scratch path; it
        depends on nothing but its arguments.
    summarise: reads all units again.
    """

    folder: str
    suffix: str = ".parquet"
    units: Callable[[Path, Job], Sequence[Any]]
    make: Callable[..., None]
    summarise: Callable[[Path, Job], Harvested]


class Trained(NamedTuple):
    """What training left behind.

    summary: for train.json and the report; scores: numbers for the tracking store, ``split.name`` -> value.
    files: to be kept there. model: what it registers, None for none. data: folder and digest of what was learnt from.
    sentence: for people.
    """

    summary: dict[str, Any]
    scores: Mapping[str, float]
    files: Sequence[Path]
    model: Any
    data: tuple[Path, str]
    sentence: str


class Training(Protocol):
    """Fits a system's network on its harvest; called by the train stage."""

    def __call__(self, job: Job, *, logger: Any, progress: bool) -> Trained:
        """Write the network and what tells of it to ``artifacts/train``; a killed run goes on where it was."""
        ...


class Entrant(Protocol):
    """A competitor at the start: what a worker process made of its configuration, once.

    Where it has ``remarks``, sentences, they stand beside its numbers; ``reads``, a digest, is of what it read, such as
    weights, so that other ones make new trials; ``weights``, a digest, and ``made_with``, settings by their whole
    names, tell of its network.
    """

    def drive(self, ground: Ground, pair: Pair, rng: np.random.Generator) -> Outcome:
        """Return how it fared on one trial. ``rng`` feeds the noise of its sensors alone."""
        ...


@dataclass(frozen=True, kw_only=True)
class Contest:
    """Who is compared on which measure.

    parts: what a competitor's ``use`` may name without a place: name -> place of the factory.
    enter: makes the entrant of a competitor in a worker process. part: the factory it named; settings: typed.
    tables: side tables by name, what only this system knows of a trial: rows -> table; keyed by trial and competitor.
    measure: further numbers of the summary, from the side tables: name of a competitor -> numbers.
    check: refuses settings of a competitor that name something else again, before anything runs.
    goals: whether trials have a goal; otherwise a pair's is NO_GOAL, and tables and pictures have none.
    """

    parts: Mapping[str, str]
    enter: Callable[[Competitor, Part, Any, Job], Entrant]
    tables: Mapping[str, Callable[[Iterable[Any]], pa.Table]] = field(default_factory=dict)
    measure: Callable[[Mapping[str, pa.Table]], dict[str, dict[str, Any]]] = lambda tables: {}
    check: Callable[[Competitor, Any], None] = lambda competitor, settings: None
    goals: bool = True

    def part_of(self, competitor: Competitor) -> tuple[Part, Any]:
        """Return the part that ``competitor`` drives with, and its typed settings.

        Raises:
            ConfigError, PartError: there is no such part, its module fails, or it takes other settings.
        """
        part = find_part(f"{competitor.key}.use", competitor.use, self.parts)
        settings = settings_of(part, competitor.settings, f"{competitor.key}.settings")
        self.check(competitor, settings)
        return part, settings


@dataclass(frozen=True, kw_only=True)
class System:
    """One research system. Everything but name, title and settings may be left out; the stage then says so.

    name: of its folder and of its option in conf/system. title: heading of its report.
    settings: the types of the sections that are its own to define: planner, harvest, train, evaluate, report.
    harvest, training, contest, figures: places (``package.module:attribute``) of a `Harvest`, a `Training`, a
        `Contest` and a `pipeline.reports.figures.Figures`.
    """

    name: str
    title: str
    settings: Mapping[str, type[Any]]
    harvest: str | None = None
    training: str | None = None
    contest: str | None = None
    figures: str | None = None
    folder: Path = Path()
    """Where its code lies; known once it is found."""


def find_system(name: str) -> System:
    """Return the system ``name``: a folder of pipeline/systems, or ``package.module:attribute`` of anybody's.

    Raises:
        ConfigError: there is no such system, or what lies there is none.
        PartError: its module fails when it is imported.
    """
    place = name if ":" in name else PLACE.format(name=name)
    if ":" not in name and name not in known_systems():
        raise ConfigError(
            f"system = {name}: expected one of {', '.join(known_systems())} (conf/system/), or your own as "
            "my_package.my_module:SYSTEM"
        )
    found = resolve(place, "system")
    if not isinstance(found, System):
        raise ConfigError(f"system = {name}: {place} is a {type(found).__name__}, expected a System")
    return replace(found, folder=folder_of(place.partition(":")[0]))


def known_systems() -> list[str]:
    """Return the names of the systems that come with this package: folders with a file system.py."""
    return sorted(file.parent.name for file in Path(__file__).parent.glob("*/system.py"))
