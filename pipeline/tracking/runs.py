"""One finished stage as one MLflow run."""

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.tracking.revision import revision_tags
from pipeline.tracking.store import Destination, checkout, open_experiment

_LONGEST_PARAM = 500
_PARAMS_AT_ONCE = 100  # what a server takes


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
    """Log ``run`` to ``destination`` and return its MLflow id. Raises whatever the store raises.

    No run is made active: mlflow would take up the run that MLFLOW_RUN_ID of an outer job names, and end an active one
    with further requests to a store that has just failed.
    """
    from mlflow import MlflowClient
    from mlflow.entities import Metric, Param, RunTag

    experiment_id = open_experiment(destination)
    client = MlflowClient(destination.uri)
    run_id = run.run_id or _new_run(client, experiment_id, run.name)
    # A continued run keeps the parameters it has: MLflow refuses to change one.
    known = client.get_run(run_id).data.params if run.run_id else {}
    tags = {**revision_tags(checkout()), **run.tags}
    now = time.time_ns() // 1_000_000
    finite = {name: float(value) for name, value in run.metrics.items() if math.isfinite(value)}
    params = [Param(name, _shortened(value)) for name, value in run.params.items() if name not in known]
    first, *more = batched(params, _PARAMS_AT_ONCE) or [[]]
    client.log_batch(
        run_id,
        metrics=[Metric(name, value, now, 0) for name, value in finite.items()],
        params=first,
        tags=[RunTag(name, str(value)) for name, value in tags.items()],
    )
    for batch in more:
        client.log_batch(run_id, params=batch)
    if run.config:
        client.log_dict(run_id, dict(run.config), "config.yaml")
    for file in run.files:
        client.log_artifact(run_id, str(file))
    if run.datasets:
        client.log_inputs(run_id, [_input(dataset, context=run.name) for dataset in run.datasets])
    if run.model is not None:
        _log_model(run.model, run_id)
    client.set_terminated(run_id)
    return run_id


def batched(items: Sequence[Any], size: int) -> list[list[Any]]:
    """Return ``items`` in lists of ``size``, the last one shorter."""
    return [list(items[first : first + size]) for first in range(0, len(items), size)]


def _new_run(client: Any, experiment_id: str, name: str) -> str:
    from mlflow.tracking.context import registry

    run = client.create_run(experiment_id, run_name=name, tags=registry.resolve_tags())
    return str(run.info.run_id)


def _input(dataset: Dataset, *, context: str) -> Any:
    from mlflow.entities import Dataset as Entity
    from mlflow.entities import DatasetInput, InputTag
    from mlflow.utils.mlflow_tags import MLFLOW_DATASET_CONTEXT

    source = json.dumps({"uri": str(dataset.path.resolve())})
    entity = Entity(name=dataset.name, digest=dataset.digest[:32], source_type="local", source=source)
    return DatasetInput(dataset=entity, tags=[InputTag(MLFLOW_DATASET_CONTEXT, context)])


def _log_model(model: Model, run_id: str) -> None:
    """Log the network as an exported graph with its signature: loading it runs no code of ours and no pickle."""
    import mlflow.pytorch
    from mlflow.models import Model as Logged
    from mlflow.models import infer_signature

    Logged.log(
        None,
        mlflow.pytorch,
        run_id=run_id,
        name=model.name,
        pytorch_model=model.network,
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
