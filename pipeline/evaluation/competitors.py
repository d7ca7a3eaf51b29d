"""Who is compared: any number of competitors, each in the role of baseline, candidate or bound."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

from pipeline.errors import ConfigError


class Role(StrEnum):
    """What a competitor is there for. A bound knows what no robot knows; it is reported and never ranked."""

    baseline = "baseline"
    candidate = "candidate"
    bound = "bound"


@dataclass(frozen=True, kw_only=True)
class CompetitorConfig:
    """One entry of evaluate.competitors: its role, the part that drives, and that part's settings."""

    use: str
    """A name that the system offers, or ``my_package.my_module:factory``."""
    role: Role = Role.candidate
    title: str | None = None
    """What tables and figures call it; null takes the entry's name."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Typed by the part itself."""


class Competitor(NamedTuple):
    """A competitor of one evaluation.

    name: the key of its entry; place: its place among the entries, which is the order of tables and figures.
    """

    name: str
    role: Role
    title: str
    use: str
    settings: Mapping[str, Any]
    place: int

    @property
    def key(self) -> str:
        """Where the configuration names it."""
        return f"evaluate.competitors.{self.name}"


class Outcome(NamedTuple):
    """How a competitor fared on one trial.

    cost_m: what is compared, usually the distance travelled [m]. ending: a key of `pipeline.evaluation.trials.ENDINGS`.
    steps: observations; decisions: times it chose anew; seconds: the robot's own time [s].
    side: rows for the system's side tables, by table. replay: what a picture of the trial needs, None for none.
    """

    cost_m: float
    ending: str
    steps: int = 0
    decisions: int = 0
    seconds: float = 0.0
    side: Mapping[str, list[Any]] = {}
    replay: Any = None


def make_roster(entries: Mapping[str, CompetitorConfig]) -> list[Competitor]:
    """Return the competitors of ``entries`` in the order of tables: baseline, candidates, bounds, each as written.

    Raises:
        ConfigError: there is not exactly one baseline, or a name cannot be one of a column and a file.
    """
    ranks = list(Role)
    ordered = sorted(entries.items(), key=lambda entry: ranks.index(entry[1].role))
    baselines = [name for name, entry in ordered if entry.role is Role.baseline]
    if len(baselines) != 1:
        found = f"{len(baselines)} ({', '.join(baselines)})" if baselines else "none"
        raise ConfigError(
            f"evaluate.competitors has {found} in the role baseline: expected exactly one, with which all others are "
            "compared"
        )
    for name, _ in ordered:
        if not name.isidentifier():
            raise ConfigError(
                f"evaluate.competitors.{name}: expected a name of letters, digits and underscores, since it names "
                "columns and files"
            )
    return [
        Competitor(name, entry.role, entry.title or name.replace("_", " "), entry.use, entry.settings, place)
        for place, (name, entry) in enumerate(ordered)
    ]


def baseline_of(roster: Iterable[Competitor]) -> Competitor:
    """Return the one with which the others are compared."""
    return next(entry for entry in roster if entry.role is Role.baseline)
