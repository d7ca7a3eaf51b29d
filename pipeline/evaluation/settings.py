"""The settings of an evaluation that every system shares; a system may add its own by deriving from them."""

from dataclasses import dataclass, field

from pipeline.evaluation.competitors import CompetitorConfig, make_roster
from pipeline.evaluation.ransac import THRESHOLD_M
from pipeline.grids.splits import SPLITS
from pipeline.settings import require


@dataclass(frozen=True, kw_only=True)
class EvaluateSettings:
    """Which trials are run and by whom (conf/evaluate/)."""

    split: str = "test"
    competitors: dict[str, CompetitorConfig] = field(default_factory=dict)
    """Who is compared, by name; exactly one in the role baseline."""
    network: str | None = None
    """Weights that competitors use unless they name their own: a file, or null for those of this run's training."""
    pairs_per_unit: int = 8
    """Start-goal pairs in one unit of work: what a killed run loses at most, per worker."""
    recorded_trials: int = 24
    """Trials whose paths, maps and frontiers are kept for pictures."""
    ransac_threshold_m: float = THRESHOLD_M
    """Residual threshold of the RANSAC line with an intercept [m]: the authors' 200 cells of 0.1 m."""
    max_steps: int | None = None
    """Observations after which a trial is cut off; null means a bound that no planner of ours meets."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(self.split in SPLITS, "evaluate.split", self.split, f"one of {', '.join(SPLITS)}")
        make_roster(self.competitors)
        require(self.pairs_per_unit >= 1, "evaluate.pairs_per_unit", self.pairs_per_unit, "at least 1")
        require(self.recorded_trials >= 0, "evaluate.recorded_trials", self.recorded_trials, "at least 0")
        require(self.ransac_threshold_m > 0, "evaluate.ransac_threshold_m", self.ransac_threshold_m, "above 0 m")
        require(self.max_steps is None or self.max_steps > 0, "evaluate.max_steps", self.max_steps, "null or above 0")
