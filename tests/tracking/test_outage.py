"""Servers that refuse, are silent or fail: one warning, soon; no second try in the same run; nothing lost."""

import json
import os
import socket
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import numpy as np
import pytest
from omegaconf import DictConfig, OmegaConf

from pipeline.files import damage
from pipeline.stages.recording import StageResult, record_run, tracker
from pipeline.tracking import Destination, Model, forget_outages, keep, kept, training_logger
from pipeline.tracking.runs import Run

PATIENCE_S = 10.0


@pytest.fixture(autouse=True)
def run_of_the_pipeline(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A run of its own for each test, and none of the user's own settings."""
    for name in list(os.environ):
        if name.startswith("MLFLOW_HTTP") or name == "MLFLOW_TRACKING_URI":
            monkeypatch.delenv(name)
    monkeypatch.setenv("HINTERLAND_RUN", f"test{time.time_ns()}")
    yield
    for name in ("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "MLFLOW_HTTP_REQUEST_TIMEOUT"):
        os.environ.pop(name, None)


@pytest.fixture
def silent() -> Iterator[str]:
    """A server that accepts connections and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        taken: list[socket.socket] = []
        threading.Thread(target=_take_all, args=(server, taken), daemon=True).start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}"
        for connection in taken:
            connection.close()


def _take_all(server: socket.socket, taken: list[socket.socket]) -> None:
    while True:
        try:
            taken.append(server.accept()[0])
        except OSError:
            return


@pytest.fixture
def refusing() -> str:
    """A port where nobody listens."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    return f"http://127.0.0.1:{port}"


class Failing(BaseHTTPRequestHandler):
    """Answers every request with 500."""

    asked: list[str] = []  # noqa: RUF012 - emptied by the fixture

    def do_GET(self) -> None:
        self.asked.append(self.path)
        self.send_error(500)

    do_POST = do_GET  # noqa: N815 - the name that the server looks for

    def log_message(self, *_: object) -> None:
        return


@pytest.fixture
def failing() -> Iterator[str]:
    server = HTTPServer(("127.0.0.1", 0), Failing)
    Failing.asked.clear()
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


def configured(uri: str, folder: Path) -> DictConfig:
    return OmegaConf.create(
        {
            "artifacts": str(folder / "artifacts"),
            "experiment_name": "corridors",
            "seed": 3,
            "harvest": {"max_steps": 9},
            "tracking": {"uri": uri},
        }
    )


def assert_one_warning(raw: DictConfig, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Record two stages; the first warns in time, the second asks nobody, and both are kept whole."""
    table = folder / "harvest.json"
    table.write_text('{"datums": 3}', encoding="utf-8")
    started = time.monotonic()
    result = StageResult(metrics={"datums": 3.0, "undefined": float("nan")}, files=[table], tags={"mood": "calm"})
    record_run("harvest", raw, result)
    assert time.monotonic() - started < PATIENCE_S
    (warning,) = capsys.readouterr().err.strip().splitlines()
    uri = raw.tracking.uri
    assert warning.startswith(f"warning: harvest is finished, but was not logged to {uri}: ")
    table.write_text("overwritten by a later run", encoding="utf-8")

    destination = tracker(raw)
    assert destination is not None
    forget_process(destination)
    started = time.monotonic()
    assert training_logger(destination) is None
    record_run("train", raw, StageResult(metrics={"brier": 0.25}))
    assert time.monotonic() - started < 1.0
    told = capsys.readouterr()
    assert told.err == ""
    assert f"train: not logged to {uri}, which failed before. It is kept in " in told.out

    first, second = kept(destination.spool)
    assert str(first) in warning
    record = json.loads((first / "run.json").read_text(encoding="utf-8"))
    assert (record["version"], record["experiment"]) == (1, "corridors")
    run = record["run"]
    assert (run["name"], run["run_id"], run["metrics"]) == ("harvest", None, {"datums": 3.0})
    assert run["params"] == {"seed": 3, "harvest.max_steps": 9}
    assert run["config"]["harvest"] == {"max_steps": 9}
    assert run["tags"]["mood"] == "calm"
    assert run["tags"]["git.revision"]
    assert (first / run["files"][0]).read_text(encoding="utf-8") == '{"datums": 3}'
    assert json.loads((second / "run.json").read_text(encoding="utf-8"))["run"]["metrics"] == {"brier": 0.25}
    assert damage(first / "run.json") is None


def forget_process(destination: Destination) -> None:
    """Forget what this process knows, as the next stage of the run starts: only the mark on disk is left."""
    (marker,) = destination.spool.glob(".outage-*")
    reason = marker.read_text(encoding="utf-8")
    forget_outages(destination.spool)
    marker.write_text(reason, encoding="utf-8")


def test_a_silent_server(silent: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert_one_warning(configured(silent, tmp_path), tmp_path, capsys)


def test_a_port_where_nobody_listens(refusing: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert_one_warning(configured(refusing, tmp_path), tmp_path, capsys)


def test_a_server_that_fails(failing: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert_one_warning(configured(failing, tmp_path), tmp_path, capsys)
    assert len(Failing.asked) == 1


def test_a_broken_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mlflow.db").write_bytes(b"this is no database, however long it is" * 100)
    assert_one_warning(configured(f"sqlite:///{tmp_path / 'mlflow.db'}", tmp_path), tmp_path, capsys)


def test_training_finds_the_outage_and_the_stage_warns_once(
    silent: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    raw = configured(silent, tmp_path)
    destination = tracker(raw)
    assert destination is not None
    import lightning.pytorch.loggers  # noqa: F401 - takes seconds, which are the training's own

    started = time.monotonic()
    assert training_logger(destination) is None
    record_run("train", raw, StageResult(metrics={"brier": 0.25}))
    assert time.monotonic() - started < PATIENCE_S
    assert capsys.readouterr().err.count("warning: train is finished, but was not logged") == 1


def test_a_store_that_fails_in_the_middle_of_training_is_asked_no_more(
    destination: Destination, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logger = training_logger(destination)
    assert logger is not None
    asked: list[int] = []

    def fail(*_: object, **__: object) -> None:
        asked.append(1)
        raise ConnectionError("gone")

    for name in ("log_batch", "log_metric", "log_param", "set_terminated", "update_run"):
        monkeypatch.setattr(f"mlflow.tracking.MlflowClient.{name}", fail)
    logger.log_metrics({"loss": 2.0}, step=0)
    logger.log_metrics({"loss": 1.0}, step=200)
    logger.log_hyperparams({"steps": 3})
    logger.finalize("success")
    assert len(asked) == 1
    forget_outages(destination.spool)


def test_another_run_of_the_pipeline_asks_again(
    refusing: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = configured(refusing, tmp_path)
    record_run("harvest", raw, StageResult())
    destination = tracker(raw)
    assert destination is not None
    forget_process(destination)
    monkeypatch.setenv("HINTERLAND_RUN", "another")
    record_run("harvest", raw, StageResult())
    assert capsys.readouterr().err.count("warning: ") == 2


def test_a_spool_that_cannot_be_written_is_said(
    refusing: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "artifacts").write_text("a file where the folder should be", encoding="utf-8")
    record_run("harvest", configured(refusing, tmp_path), StageResult())
    assert "Nor could it be kept in" in capsys.readouterr().err


def test_a_password_is_not_shown() -> None:
    asked = Destination(uri="https://ann:secret@runs.example.org/x", experiment="corridors")
    assert asked.shown == "https://runs.example.org/x"
    assert Destination(uri="sqlite:////a@b/mlflow.db", experiment="c").shown == "sqlite:////a@b/mlflow.db"


def test_a_model_is_kept_with_its_example(tmp_path: Path) -> None:
    arrays = np.array([[0.5, -1.5]], np.float32), np.array([[0.25]], np.float32)
    run = Run(name="train", model=Model(network=None, inputs=arrays[0], outputs=arrays[1]))
    folder = keep(Destination(uri="http://127.0.0.1:9", experiment="c", spool=tmp_path), run, "why")
    model = json.loads((folder / "run.json").read_text(encoding="utf-8"))["run"]["model"]
    assert model == {"name": "network", "inputs": [[0.5, -1.5]], "outputs": [[0.25]]}
