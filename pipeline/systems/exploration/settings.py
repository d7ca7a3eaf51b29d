"""The settings of exploration: one record for each section of the configuration that is its own."""

from dataclasses import dataclass, field

from pipeline.evaluation.settings import EvaluateSettings
from pipeline.settings import require


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """What all explorers of this system share (conf/planner/)."""

    commit: bool = True
    """Drive on to the frontier chosen until it is none any more; otherwise choose anew whenever the map changes."""
    spacing_m: float = 1.0
    """Views are weighed from cells of a frontier at least this far apart [m], the middle among them."""
    gain_beams: int = 512
    """Rays of a full circle by which a view is weighed."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(0 < self.spacing_m < 100, "planner.spacing_m", self.spacing_m, "between 0 and 100 m")
        beams = self.gain_beams
        require(8 <= beams <= 8192 and beams % 8 == 0, "planner.gain_beams", beams, "a multiple of 8, from 8 to 8192")


@dataclass(frozen=True, kw_only=True)
class HarvestConfig:
    """Which plans are explored for datums of how the map grows (conf/harvest/)."""

    splits: list[str] = field(default_factory=lambda: ["train", "validation"])
    """Splits to explore; test plans stay unseen."""
    pairs_per_shard: int = 8
    """Trials in one shard: what a killed run loses at most, per worker."""
    max_steps: int | None = None
    """Looks after which an exploration is cut off; null means a bound that no planner meets."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        allowed = ("train", "validation")
        fitting = bool(self.splits) and all(split in allowed for split in self.splits)
        require(fitting, "harvest.splits", self.splits, "one or both of train, validation")
        require(1 <= self.pairs_per_shard <= 100_000, "harvest.pairs_per_shard", self.pairs_per_shard, "at least 1")
        require(self.max_steps is None or self.max_steps > 0, "harvest.max_steps", self.max_steps, "null or above 0")


@dataclass(frozen=True, kw_only=True)
class EvaluateConfig(EvaluateSettings):
    """Which trials are run and by whom (conf/evaluate/)."""

    coverage: float = 0.95
    """A trial costs what was travelled until this share of the area in reach had been seen."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        super().__post_init__()
        require(0 < self.coverage <= 1, "evaluate.coverage", self.coverage, "above 0, at most 1")
