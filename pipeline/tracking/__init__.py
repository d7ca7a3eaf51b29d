"""MLflow runs: one per stage, written after the outputs, read by no stage. The only package that imports mlflow."""

from pipeline.tracking.networks import fetch_network, is_stored
from pipeline.tracking.outage import RUN_VARIABLE, forget_outages, is_news, known_outage, note_outage
from pipeline.tracking.runs import Dataset, Model, Run, log_run
from pipeline.tracking.spool import keep, kept
from pipeline.tracking.store import Destination
from pipeline.tracking.training import training_logger

__all__ = [
    "RUN_VARIABLE",
    "Dataset",
    "Destination",
    "Model",
    "Run",
    "fetch_network",
    "forget_outages",
    "is_news",
    "is_stored",
    "keep",
    "kept",
    "known_outage",
    "log_run",
    "note_outage",
    "training_logger",
]
