"""The settings of learned subgoal planning: one record for each section of the configuration that is its own."""

from dataclasses import dataclass, field
from typing import Final

from pipeline.evaluation.settings import EvaluateSettings
from pipeline.planning.ordering import MOST_SUBGOALS
from pipeline.settings import require

INPUT_FRAMES: Final = ("subgoal", "robot", "map")


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """How a drive chooses among subgoals (conf/planner/)."""

    max_subgoals: int = 12
    """Subgoals kept for the ordering, the two of least optimistic cost first, then the most likely ones. An
    order takes 0.1 ms for 12 and 0.1 s for 20, the most."""
    failure_penalty_m: float = 0.0
    """Cost added when every subgoal has failed. 0 follows equation 4 of the paper literally."""
    rescale_probabilities: bool = False
    """Where the P_S of all subgoals sum to less than 1, scale them to sum to 1."""
    optimism: float = 0.0
    """Added to the log-odds of every P_S."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        limits = f"from 1 to {MOST_SUBGOALS}"
        require(1 <= self.max_subgoals <= MOST_SUBGOALS, "planner.max_subgoals", self.max_subgoals, limits)
        require(abs(self.optimism) <= 20, "planner.optimism", self.optimism, "from -20 to 20")
        require(self.failure_penalty_m >= 0, "planner.failure_penalty_m", self.failure_penalty_m, "at least 0 m")


@dataclass(frozen=True, kw_only=True)
class HarvestConfig:
    """How training plans are explored (conf/harvest/)."""

    splits: list[str] = field(default_factory=lambda: ["train", "validation"])
    """Splits to explore; test plans stay unseen."""
    pairs_per_shard: int = 16
    """Start-goal pairs in one shard: what a killed run loses at most, per worker."""
    weight_floor_m: float = 1.0
    """Least misclassification cost of a subgoal [m]."""
    map_views: bool = False
    """Store with each datum how the robot's whole map shows its subgoal, for train.input_frame=map."""
    max_steps: int | None = None
    """Scans after which an exploration is cut off; null means a bound that no planner meets."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        allowed = ("train", "validation")
        require(
            bool(self.splits) and all(split in allowed for split in self.splits),
            "harvest.splits",
            self.splits,
            "one or both of train, validation",
        )
        require(1 <= self.pairs_per_shard <= 100_000, "harvest.pairs_per_shard", self.pairs_per_shard, "at least 1")
        require(self.weight_floor_m > 0, "harvest.weight_floor_m", self.weight_floor_m, "above 0 m")
        require(self.max_steps is None or self.max_steps > 0, "harvest.max_steps", self.max_steps, "null or above 0")


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """How the network is made, trained and calibrated (conf/train/); defaults are the paper's."""

    steps: int = 100_000
    batch_size: int = 256
    learning_rate: float = 0.004
    decay: float = 0.9
    decay_every: int = 5000
    hidden: list[int] = field(default_factory=lambda: [256, 128, 48, 16])
    dropout: float = 0.5
    cost_weighted: bool = True
    class_balanced: bool = True
    success_loss_weight: float = 1.0
    exploration_loss_weight: float = 1.0
    target_scaling: str = "standardise"
    input_frame: str = "subgoal"
    calibrate: bool = True
    validate_every: int = 1000
    accelerator: str = "cpu"
    seed: int | None = None
    """Of the first weights and the order of the batches; null means the root key ``seed``, which draws the data."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        for name in ("steps", "decay_every", "validate_every"):
            require(getattr(self, name) >= 1, f"train.{name}", getattr(self, name), "at least 1 step")
        require(self.batch_size >= 2, "train.batch_size", self.batch_size, "at least 2 (batch norm)")
        require(0 < self.learning_rate < 1, "train.learning_rate", self.learning_rate, "between 0 and 1")
        require(0 < self.decay <= 1, "train.decay", self.decay, "above 0, at most 1")
        require(
            len(self.hidden) > 0 and min(self.hidden) >= 1,
            "train.hidden",
            self.hidden,
            "one or more widths, each above 0",
        )
        require(0 <= self.dropout < 1, "train.dropout", self.dropout, "from 0 to below 1")
        for name in ("success_loss_weight", "exploration_loss_weight"):
            require(getattr(self, name) >= 0, f"train.{name}", getattr(self, name), "at least 0")
        require(self.seed is None or self.seed >= 0, "train.seed", self.seed, "null or at least 0")
        _require_one_of("target_scaling", self.target_scaling, ("standardise", "log"))
        _require_one_of("input_frame", self.input_frame, INPUT_FRAMES)
        _require_one_of("accelerator", self.accelerator, ("cpu", "gpu", "auto"))


@dataclass(frozen=True, kw_only=True)
class EvaluateConfig(EvaluateSettings):
    """Which trials are run and by whom (conf/evaluate/)."""

    weight_floor_m: float = 1.0
    """As harvest.weight_floor_m [m]."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        super().__post_init__()
        require(self.weight_floor_m > 0, "evaluate.weight_floor_m", self.weight_floor_m, "above 0 m")


def _require_one_of(name: str, value: str, allowed: tuple[str, ...]) -> None:
    require(value in allowed, f"train.{name}", value, " or ".join(allowed))
