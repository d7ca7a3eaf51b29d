"""MLflow runs: one per stage, written after the outputs, read by no stage. The only package that imports mlflow."""

from pipeline.tracking.runs import Dataset, Model, Run, log_run
from pipeline.tracking.store import Destination
from pipeline.tracking.training import training_logger

__all__ = ["Dataset", "Destination", "Model", "Run", "log_run", "training_logger"]
