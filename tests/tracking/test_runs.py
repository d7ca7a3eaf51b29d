"""A finished stage becomes one run in a real SQLite store."""

import os
from pathlib import Path

import mlflow
import numpy as np
import pytest
import torch
from mlflow import MlflowClient
from omegaconf import OmegaConf

from pipeline.stages.door import tracker
from pipeline.tracking import Dataset, Destination, Model, Run, log_run, training_logger


def found_run(destination: Destination, run_id: str) -> mlflow.entities.Run:
    return MlflowClient(destination.uri).get_run(run_id)


def test_a_run_holds_what_the_stage_said(destination: Destination, tmp_path: Path) -> None:
    table, figure = tmp_path / "trials.parquet", tmp_path / "scatter.svg"
    table.write_bytes(b"rows")
    figure.write_text("<svg/>", encoding="utf-8")
    run_id = log_run(
        destination,
        Run(
            name="evaluate",
            params={"evaluate.split": "test", "long": "x" * 10_000},
            config={"seed": 3},
            metrics={"cost_ratio": 0.8, "undefined": float("nan")},
            files=[figure],
            tags={"mood": "calm"},
            datasets=[Dataset(name="trials", path=table, digest="0123456789abcdef")],
        ),
    )
    run = found_run(destination, run_id)
    assert run.info.run_name == "evaluate"
    assert run.info.status == "FINISHED"
    assert run.data.params["evaluate.split"] == "test"
    assert len(run.data.params["long"]) == 500
    assert run.data.metrics == {"cost_ratio": 0.8}
    assert run.data.tags["mood"] == "calm"
    assert run.data.tags["git.revision"]
    (used,) = run.inputs.dataset_inputs
    assert (used.dataset.name, used.dataset.digest) == ("trials", "0123456789abcdef")
    names = {entry.path for entry in MlflowClient(destination.uri).list_artifacts(run_id)}
    assert names == {"config.yaml", "scatter.svg"}
    assert run.info.artifact_uri.startswith((tmp_path / "mlruns").as_uri())


def test_a_run_is_continued_and_keeps_its_parameters(destination: Destination) -> None:
    run_id = log_run(destination, Run(name="train", params={"steps": 5}))
    assert log_run(destination, Run(name="train", params={"steps": 6, "width": 2}, run_id=run_id)) == run_id
    assert found_run(destination, run_id).data.params == {"steps": "5", "width": "2"}


def test_the_run_of_an_outer_job_is_left_alone(destination: Destination, monkeypatch: pytest.MonkeyPatch) -> None:
    outer = log_run(destination, Run(name="outer job"))
    monkeypatch.setenv("MLFLOW_RUN_ID", outer)
    first, second = (log_run(destination, Run(name="harvest", metrics={"datums": 3.0})) for _ in range(2))
    logger = training_logger(destination)
    logger.log_metrics({"loss": 2.0}, step=0)
    assert len({outer, first, second, logger.run_id}) == 4
    run = found_run(destination, outer)
    assert (run.info.run_name, run.data.metrics) == ("outer job", {})
    assert os.environ["MLFLOW_RUN_ID"] == outer


def test_more_parameters_than_a_server_takes_at_once_are_logged(destination: Destination) -> None:
    params = {f"harvest.key{number}": number for number in range(230)}
    assert len(found_run(destination, log_run(destination, Run(name="harvest", params=params))).data.params) == 230


def test_dvc_is_named_in_the_tags(destination: Destination, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DVC_STAGE", "harvest")
    monkeypatch.setenv("DVC_EXP_NAME", "wider-gray")
    tags = found_run(destination, log_run(destination, Run(name="harvest"))).data.tags
    assert (tags["dvc.stage"], tags["dvc.exp_name"]) == ("harvest", "wider-gray")


@pytest.mark.slow
def test_the_model_is_logged_with_its_signature(destination: Destination) -> None:
    network = torch.nn.Sequential(torch.nn.Linear(6, 3), torch.nn.Sigmoid()).eval()
    inputs = np.zeros((4, 6), np.float32)
    outputs = network(torch.from_numpy(inputs)).detach().numpy()
    run_id = log_run(destination, Run(name="train", model=Model(network=network, inputs=inputs, outputs=outputs)))
    (logged,) = MlflowClient(destination.uri).search_logged_models([found_run(destination, run_id).info.experiment_id])
    loaded = mlflow.pyfunc.load_model(logged.model_uri)
    signature = loaded.metadata.signature
    assert signature.inputs.inputs[0].shape == (-1, 6)
    assert np.allclose(loaded.predict(np.zeros((7, 6), np.float32)), outputs[0])
    with pytest.raises(mlflow.exceptions.MlflowException):
        loaded.predict(np.zeros((7, 5), np.float32))


def test_training_curves_and_the_stage_share_a_run(destination: Destination) -> None:
    logger = training_logger(destination)
    logger.log_metrics({"loss": 2.0}, step=0)
    logger.log_metrics({"loss": 1.0}, step=200)
    logger.finalize("success")
    log_run(destination, Run(name="train", metrics={"brier": 0.1}, run_id=logger.run_id))
    run = found_run(destination, logger.run_id)
    assert run.info.run_name == "train"
    assert run.data.metrics == {"loss": 1.0, "brier": 0.1}
    history = MlflowClient(destination.uri).get_metric_history(logger.run_id, "loss")
    assert [(point.step, point.value) for point in history] == [(0, 2.0), (200, 1.0)]


def test_the_environment_names_the_store(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = OmegaConf.create({"experiment_name": "corridors", "tracking": {"uri": "sqlite:////elsewhere/runs.db"}})
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    assert tracker(raw) == Destination(uri="sqlite:////elsewhere/runs.db", experiment="corridors")
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:5000")
    chosen = tracker(raw)
    assert chosen is not None
    assert (chosen.uri, chosen.artifacts) == ("http://127.0.0.1:5000", None)


def test_tracking_can_be_off() -> None:
    assert tracker(OmegaConf.create({"experiment_name": "x", "tracking": {"enabled": False}})) is None
