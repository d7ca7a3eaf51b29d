"""Training curves into MLflow while a network is fitted."""

from collections.abc import Callable
from typing import Any

from pipeline.tracking.outage import known_outage, note_outage
from pipeline.tracking.store import Destination, open_experiment


def training_logger(destination: Destination, *, run_name: str = "train", run_id: str | None = None) -> Any:
    """Return a Lightning logger that opens the run ``run_name`` (or continues ``run_id``), or None without a store.

    A store that fails later never costs the training: it is not asked again, and the stage says so at its end, when
    it keeps its run with the whole table of curves. Each logged value costs about 3 ms on SQLite: give the Trainer
    ``log_every_n_steps`` of 200 or more. Hand ``logger.run_id`` to `StageResult.run_id`, so that the stage's
    parameters and metrics go to the same run.
    """
    if known_outage(destination.spool) is not None:
        return None
    from lightning.pytorch.loggers import MLFlowLogger

    class ForgivingLogger(MLFlowLogger):  # type: ignore[misc, unused-ignore]
        """Go on without the store once it has failed."""

        def log_metrics(self, metrics: Any, step: int | None = None) -> None:
            self._try(lambda: super(ForgivingLogger, self).log_metrics(metrics, step))

        def log_hyperparams(self, params: Any, *rest: Any, **more: Any) -> None:
            self._try(lambda: super(ForgivingLogger, self).log_hyperparams(params, *rest, **more))

        def finalize(self, status: str = "success") -> None:
            self._try(lambda: super(ForgivingLogger, self).finalize(status))

        def _try(self, log: Callable[[], None]) -> None:
            if known_outage(destination.spool) is not None:
                return
            try:
                log()
            except Exception as error:
                note_outage(destination.spool, error)

    try:
        experiment_id = open_experiment(destination)
        logger = ForgivingLogger(
            experiment_name=destination.experiment,
            run_name=run_name,
            tracking_uri=destination.uri,
            artifact_location=destination.artifacts,
            run_id=run_id,
        )
        logger._experiment_id = experiment_id
        _ = logger.run_id  # opens the run now, while a failure can still be forgiven
    except Exception as error:
        note_outage(destination.spool, error)
        return None
    return logger
