"""Settings of the machinery: how the work is spread, and where runs are logged."""

from dataclasses import dataclass

from pipeline.settings import require


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
