"""Settings that several stages share: the sensor, the robot, the planner, execution and tracking."""

from dataclasses import dataclass

from pipeline.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class SensorConfig:
    """A planar lidar that looks all around (conf/sensor/)."""

    beams: int = 1024
    """Rays cast for each scan."""
    input_beams: int = 256
    """Ranges handed to the network, 64 to 1024: a multiple of 8 that divides ``beams``. Weights are for one number."""
    max_range_m: float
    noise_m: float = 0.0
    """Standard deviation of one range [m]."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(
            64 <= self.input_beams <= 1024 and self.input_beams % 8 == 0,
            "sensor.input_beams",
            self.input_beams,
            "64 to 1024, a multiple of 8 (headings are multiples of 45 degrees)",
        )
        require(
            self.beams >= self.input_beams and self.beams % self.input_beams == 0,
            "sensor.beams",
            self.beams,
            f"a multiple of sensor.input_beams = {self.input_beams}",
        )
        require(0 < self.max_range_m < 1000, "sensor.max_range_m", self.max_range_m, "between 0 and 1000 m")
        require(0 <= self.noise_m < self.max_range_m, "sensor.noise_m", self.noise_m, "at least 0, below max_range_m")


@dataclass(frozen=True, kw_only=True)
class RobotConfig:
    """A disc that moves a fixed length between two observations (conf/robot/)."""

    radius_m: float
    step_m: float
    merge_m: float = 0.0
    """Frontiers less than this apart, by way of reached space, make one subgoal [m]."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(0 <= self.radius_m < 10, "robot.radius_m", self.radius_m, "from 0 up to 10 m")
        require(0 < self.step_m < 100, "robot.step_m", self.step_m, "between 0 and 100 m")
        require(0 <= self.merge_m < 100, "robot.merge_m", self.merge_m, "from 0 up to 100 m")


MOST_SUBGOALS = 62  # as in pipeline.planning.ordering, which is not imported: all stages would depend on planning


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """How a drive chooses among subgoals (conf/planner/)."""

    max_subgoals: int = 12
    """Subgoals kept for the ordering, the two of least optimistic cost first, then the most likely ones. Up to 20 the
    ordering is exact (0.1 ms for 12, 0.1 s for 20); above, it may be a few percent off the best."""
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
class ExecutionConfig:
    """How the work is spread (conf/execution/). None of it changes a result."""

    workers: int | None = None
    """Worker processes; null means one for each core."""
    backend: str = "loky"
    progress: bool = True

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(
            self.workers is None or 1 <= self.workers <= 4096, "execution.workers", self.workers, "null or 1 to 4096"
        )
        require(self.backend in ("loky", "sequential"), "execution.backend", self.backend, "loky or sequential")


@dataclass(frozen=True, kw_only=True)
class TrackingConfig:
    """Where runs are logged (conf/tracking/). The environment variable MLFLOW_TRACKING_URI wins over ``uri``."""

    enabled: bool = True
    uri: str | None = None
    """An MLflow tracking URI; null means the file mlflow.db at the root of the checkout."""
    experiment: str | None = None
    """MLflow's experiment; null means the root key experiment_name."""


def require(holds: bool, key: str, value: object, expected: str) -> None:
    """Raise a ConfigError that names ``key``, its value and what was expected, unless ``holds``."""
    if not holds:
        group = key.partition(".")[0]
        raise ConfigError(f"{key} = {value}: expected {expected}. Change it in conf/{group}/ or by {key}=...")
