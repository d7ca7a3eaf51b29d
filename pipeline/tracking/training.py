"""Training curves into MLflow while a network is fitted."""

import sys
from typing import Any

from pipeline.tracking.store import Destination, open_experiment


def training_logger(destination: Destination, *, run_name: str = "train", run_id: str | None = None) -> Any:
    """Return a Lightning logger that opens the run ``run_name`` (or continues ``run_id``), or None without a store.

    A store that fails later costs one warning, never the training. Each logged value costs about 3 ms on SQLite:
    give the Trainer ``log_every_n_steps`` of 200 or more. Hand ``logger.run_id`` to `StageResult.run_id`, so that
    the stage's parameters and metrics go to the same run.
    """
    from lightning.pytorch.loggers import MLFlowLogger

    class ForgivingLogger(MLFlowLogger):  # type: ignore[misc, unused-ignore]
        """Warn once when the store fails, and go on without it."""

        lost = False

        def log_metrics(self, metrics: Any, step: int | None = None) -> None:
            if self.lost:
                return
            try:
                super().log_metrics(metrics, step)
            except Exception as error:
                self.lost = True
                _warn(destination, error)

        def finalize(self, status: str = "success") -> None:
            if not self.lost:
                super().finalize(status)

    try:
        open_experiment(destination)
        logger = ForgivingLogger(
            experiment_name=destination.experiment,
            run_name=run_name,
            tracking_uri=destination.uri,
            artifact_location=destination.artifacts,
            run_id=run_id,
        )
        _ = logger.run_id  # opens the run now, while a failure can still be forgiven
    except Exception as error:
        _warn(destination, error)
        return None
    return logger


def _warn(destination: Destination, error: Exception) -> None:
    first = (str(error).strip().splitlines() or [type(error).__name__])[0]
    print(f"warning: training curves are not logged to {destination.uri}: {first}", file=sys.stderr)
