"""Weights from the tracking store: those of a registered model, or of the run that trained them, as a local file."""

import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

from pipeline.errors import ConfigError, one_line
from pipeline.files import digest_file, replacing
from pipeline.tracking.outage import be_impatient, within_patience
from pipeline.tracking.store import Destination

WEIGHTS = ".safetensors"
EXPECTED = "a file, models:/NAME@ALIAS, models:/NAME/VERSION, or the id of the run that trained it"

_MODEL = re.compile(r"models:/(?P<name>[^/@]+)(@(?P<alias>[^/@]+)|/(?P<version>\d+))")
_RUN = re.compile(r"(runs:/)?(?P<run>[0-9a-f]{32})")

Answer = TypeVar("Answer")


def is_stored(reference: str) -> bool:
    """Return whether ``reference`` names weights in a tracking store, not a file."""
    return reference.startswith(("models:/", "runs:/")) or _RUN.fullmatch(reference) is not None


def fetch_network(reference: str, destination: Destination, folder: Path, key: str) -> Path:
    """Return the weights that ``reference`` names, copied to ``folder`` under the name of their digest.

    reference: models:/NAME@ALIAS, models:/NAME/VERSION, runs:/ID or ID. A registered model stands for the run that
    logged it: the model itself is a graph for torch, the weights lie beside it. key: what asks, for messages.

    Raises:
        ConfigError: the store lacks it or does not answer, or the run logged no weights.
    """
    said = f"{key} = {reference}"
    run = _RUN.fullmatch(reference)
    if run is None and _MODEL.fullmatch(reference) is None:
        raise ConfigError(f"{said}: expected {EXPECTED}")
    client = _client(destination, said)
    run_id = run["run"] if run is not None else _run_of_model(client, reference, destination, said)
    where = f"{said}: {destination.shown}"
    found = _asked(lambda: client.list_artifacts(run_id), destination, f"{where} has no run {run_id}")
    weights = [entry.path for entry in found if entry.path.endswith(WEIGHTS)]
    if len(weights) != 1:
        raise ConfigError(
            f"{where}: run {run_id} holds {len(weights)} files *{WEIGHTS}, expected one: name the run of a train stage"
        )
    with tempfile.TemporaryDirectory(prefix="hinterland-") as scratch:
        # A download may take its time: a store that has just answered is there.
        fetched = Path(client.download_artifacts(run_id, weights[0], scratch))
        target = folder / f"{digest_file(fetched)[:16]}{WEIGHTS}"
        if not target.is_file():
            with replacing(target, summed=True) as half:
                half.write_bytes(fetched.read_bytes())
    return target


def _client(destination: Destination, said: str) -> Any:
    file = Path(destination.uri.removeprefix("sqlite:///"))
    if destination.uri.startswith("sqlite:///") and not file.is_file():  # mlflow would make an empty one
        raise ConfigError(
            f"{said}: there is no tracking store {destination.shown}. Set tracking.uri or MLFLOW_TRACKING_URI, or "
            "name the weights by their file"
        )
    be_impatient()
    from mlflow import MlflowClient

    return MlflowClient(destination.uri, registry_uri=destination.uri)


def _run_of_model(client: Any, reference: str, destination: Destination, said: str) -> str:
    asked = _MODEL.fullmatch(reference)
    assert asked is not None
    name, alias, version = asked["name"], asked["alias"], asked["version"]
    found = _asked(
        lambda: client.get_model_version_by_alias(name, alias) if alias else client.get_model_version(name, version),
        destination,
        f"{said}: {destination.shown} has no such model. Register one from the run of a train stage, or name the run",
    )
    if not found.run_id:
        raise ConfigError(f"{said}: this version was registered without a run, whose weights are needed; name a file")
    return str(found.run_id)


def _asked(ask: Callable[[], Answer], destination: Destination, lacking: str) -> Answer:
    """Return what the store answers; a refusal means that ``lacking`` is the case, anything else that it is away."""
    from mlflow.exceptions import MlflowException

    remote = bool(urlsplit(destination.uri).hostname)
    try:
        return within_patience(ask) if remote else ask()
    except MlflowException as error:
        raise ConfigError(f"{lacking} ({one_line(error)[:200]})") from error
    except Exception as error:
        raise ConfigError(f"{destination.shown} did not answer ({one_line(error)[:200]}): {lacking}?") from error
