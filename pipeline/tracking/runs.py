"""One finished stage as one MLflow run."""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.tracking.revision import revision_tags
from pipeline.tracking.store import Destination, checkout, open_experiment

_LONGEST_PARAM = 500


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """Data a stage read: a name, where it lies, and the digest of its content."""

    name: str
    path: Path
    digest: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """A trained ``torch.nn.Module`` with one batch of inputs and the outputs it gave for them.

    ``inputs`` and ``outputs`` are float32 arrays whose first axis is the batch; the signature is read off them.
    """

    network: Any
    inputs: np.ndarray
    outputs: np.ndarray
    name: str = "network"


@dataclass(frozen=True, kw_only=True)
class Run:
    """What is logged of a stage. ``params`` are flat; ``run_id`` continues a run the stage opened for its curves."""

    name: str
    params: Mapping[str, Any] = field(default_factory=dict)
    config: Mapping[str, Any] = field(default_factory=dict)
    metrics: Mapping[str, float] = field(default_factory=dict)
    files: Sequence[Path] = ()
    tags: Mapping[str, str] = field(default_factory=dict)
    datasets: Sequence[Dataset] = ()
    model: Model | None = None
    run_id: str | None = None


def log_run(destination: Destination, run: Run) -> str:
    """Log ``run`` to ``destination`` and return its MLflow id. Raises whatever the store raises."""
    import mlflow

    experiment_id = open_experiment(destination)
    with mlflow.start_run(run_id=run.run_id, experiment_id=experiment_id, run_name=run.name) as active:
        mlflow.set_tags({**revision_tags(checkout()), **run.tags})
        # A continued run keeps the parameters it has: MLflow refuses to change one.
        known = active.data.params
        mlflow.log_params({name: _shortened(value) for name, value in run.params.items() if name not in known})
        mlflow.log_metrics({name: float(value) for name, value in run.metrics.items() if math.isfinite(value)})
        if run.config:
            mlflow.log_dict(dict(run.config), "config.yaml")
        for file in run.files:
            mlflow.log_artifact(str(file))
        for dataset in run.datasets:
            _log_dataset(dataset, context=run.name)
        if run.model is not None:
            _log_model(run.model)
        return str(active.info.run_id)


def _log_dataset(dataset: Dataset, *, context: str) -> None:
    import mlflow
    from mlflow.data.dataset_source_registry import resolve_dataset_source
    from mlflow.data.meta_dataset import MetaDataset

    with warnings.catch_warnings():
        # mlflow registers its local source twice and then warns that it has a choice.
        warnings.simplefilter("ignore")
        source = resolve_dataset_source(str(dataset.path.resolve()))
    described = MetaDataset(source=source, name=dataset.name, digest=dataset.digest[:32])  # type: ignore[abstract]
    mlflow.log_input(described, context=context)


def _log_model(model: Model) -> None:
    """Log the network as an exported graph with its signature: loading it runs no code of ours and no pickle."""
    import mlflow.pytorch
    from mlflow.models import infer_signature

    mlflow.pytorch.log_model(
        model.network,
        name=model.name,
        signature=infer_signature(model.inputs, model.outputs),
        input_example=model.inputs,
        # Left out, mlflow finds the requirements by starting a process for five seconds.
        pip_requirements=[f"torch=={_version('torch')}", f"numpy=={_version('numpy')}"],
    )


def _version(distribution: str) -> str:
    from importlib.metadata import version

    return version(distribution).partition("+")[0]


def _shortened(value: Any) -> str:
    text = str(value)
    return text if len(text) <= _LONGEST_PARAM else f"{text[: _LONGEST_PARAM - 3]}..."
