"""Where runs are kept: an SQLite file at the root of the checkout unless something else is asked for."""

import logging
import os
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from pipeline.tracking.outage import be_impatient, within_patience

_VARIABLE = "MLFLOW_TRACKING_URI"
_UNLOGGED = "unlogged"


@dataclass(frozen=True, kw_only=True)
class Destination:
    """A tracking store, the experiment within it, and the folder for runs that the store did not take."""

    uri: str
    experiment: str
    spool: Path = Path("artifacts") / _UNLOGGED

    @classmethod
    def chosen(cls, *, uri: str | None, experiment: str, artifacts: Path = Path("artifacts")) -> "Destination":
        """Return the store named by MLFLOW_TRACKING_URI, else ``uri``, else mlflow.db at the root of the checkout."""
        default = f"sqlite:///{checkout() / 'mlflow.db'}"
        # A copy in which DVC runs a queued experiment is deleted afterwards, and what it kept would be lost.
        spool = (checkout() if checkout() != _here() else Path()) / artifacts / _UNLOGGED
        return cls(uri=os.environ.get(_VARIABLE) or uri or default, experiment=experiment, spool=spool)

    @property
    def artifacts(self) -> str | None:
        """Where files go: beside an SQLite file, by absolute path; a server decides for itself (None)."""
        prefix = "sqlite:///"
        if not self.uri.startswith(prefix):
            return None
        return (Path(self.uri.removeprefix(prefix)).resolve().parent / "mlruns").as_uri()

    @property
    def shown(self) -> str:
        """The URI without a password, for messages."""
        host = urlsplit(self.uri).netloc
        return self.uri.replace(host, host.rpartition("@")[2], 1) if "@" in host else self.uri


def checkout() -> Path:
    """Return the root of the checkout, also from the copy in which DVC runs a queued experiment.

    Such a copy lies in <checkout>/.dvc/tmp and is deleted afterwards, so a store inside it would be lost.
    """
    here = _here()
    parts = here.parts
    for place in range(len(parts) - 1):
        if parts[place : place + 2] == (".dvc", "tmp"):
            return Path(*parts[:place])
    return here


def _here() -> Path:
    return Path(__file__).resolve().parents[2]


def open_experiment(destination: Destination) -> str:
    """Point mlflow at ``destination``, create its experiment when new and return the experiment's id.

    Raises what the store raises, and TimeoutError when a server does not answer.
    """
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    be_impatient()
    for talkative in ("mlflow", "alembic", "urllib3"):
        logging.getLogger(talkative).setLevel(logging.ERROR)
    import mlflow

    asked_for = os.environ.get(_VARIABLE)
    mlflow.set_tracking_uri(destination.uri)
    # mlflow puts the URI into the environment too, where it would pass for the user's wish at the next call.
    os.environ.pop(_VARIABLE, None)
    if asked_for is not None:
        os.environ[_VARIABLE] = asked_for
    remote = bool(urlsplit(destination.uri).hostname)
    # A new SQLite file takes seconds to set up, more on a busy machine, and is never silent.
    return within_patience(lambda: _experiment_id(destination)) if remote else _experiment_id(destination)


def _experiment_id(destination: Destination) -> str:
    import mlflow

    found = mlflow.get_experiment_by_name(destination.experiment)
    if found is None:
        mlflow.create_experiment(destination.experiment, artifact_location=destination.artifacts)
    return str(mlflow.set_experiment(destination.experiment).experiment_id)
