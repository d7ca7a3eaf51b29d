"""Where runs are kept: an SQLite file at the root of the checkout unless something else is asked for."""

import logging
import os
from dataclasses import dataclass
from pathlib import Path

_VARIABLE = "MLFLOW_TRACKING_URI"


@dataclass(frozen=True, kw_only=True)
class Destination:
    """A tracking store and the experiment within it."""

    uri: str
    experiment: str

    @classmethod
    def chosen(cls, *, uri: str | None, experiment: str) -> "Destination":
        """Return the store named by MLFLOW_TRACKING_URI, else ``uri``, else mlflow.db at the root of the checkout."""
        default = f"sqlite:///{checkout() / 'mlflow.db'}"
        return cls(uri=os.environ.get(_VARIABLE) or uri or default, experiment=experiment)

    @property
    def artifacts(self) -> str | None:
        """Where files go: beside an SQLite file, by absolute path; a server decides for itself (None)."""
        prefix = "sqlite:///"
        if not self.uri.startswith(prefix):
            return None
        return (Path(self.uri.removeprefix(prefix)).resolve().parent / "mlruns").as_uri()


def checkout() -> Path:
    """Return the root of the checkout, also from the copy in which DVC runs a queued experiment.

    Such a copy lies in <checkout>/.dvc/tmp and is deleted afterwards, so a store inside it would be lost.
    """
    here = Path(__file__).resolve().parents[2]
    parts = here.parts
    for place in range(len(parts) - 1):
        if parts[place : place + 2] == (".dvc", "tmp"):
            return Path(*parts[:place])
    return here


def open_experiment(destination: Destination) -> str:
    """Point mlflow at ``destination``, create its experiment when new and return the experiment's id."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    for talkative in ("mlflow", "alembic"):
        logging.getLogger(talkative).setLevel(logging.ERROR)
    import mlflow

    asked_for = os.environ.get(_VARIABLE)
    mlflow.set_tracking_uri(destination.uri)
    # mlflow puts the URI into the environment too, where it would pass for the user's wish at the next call.
    os.environ.pop(_VARIABLE, None)
    if asked_for is not None:
        os.environ[_VARIABLE] = asked_for
    found = mlflow.get_experiment_by_name(destination.experiment)
    if found is None:
        mlflow.create_experiment(destination.experiment, artifact_location=destination.artifacts)
    return str(mlflow.set_experiment(destination.experiment).experiment_id)
