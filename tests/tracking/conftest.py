"""One migrated tracking store for the whole session: making a new one takes seconds, copying it none."""

import shutil
from pathlib import Path

import pytest

from pipeline.tracking import Destination
from pipeline.tracking.store import open_experiment


@pytest.fixture(scope="session")
def migrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("store")
    open_experiment(Destination(uri=f"sqlite:///{folder / 'mlflow.db'}", experiment="Default"))
    return folder / "mlflow.db"


@pytest.fixture
def destination(migrated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Destination:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    shutil.copy(migrated, tmp_path / "mlflow.db")
    return Destination(uri=f"sqlite:///{tmp_path / 'mlflow.db'}", experiment="corridors")
