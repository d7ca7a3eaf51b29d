"""Whose weights are driven with: the references of a configuration as local files."""

from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from omegaconf import DictConfig

from pipeline.errors import ConfigError
from pipeline.evaluation.settings import EvaluateSettings
from pipeline.files import digest_file, replacing, sum_path
from pipeline.stages.composing import CONF
from pipeline.stages.recording import store_of
from pipeline.tracking import fetch_network, is_stored
from pipeline.tracking.networks import EXPECTED, WEIGHTS

SETTING = "network"
"""The setting of a competitor that names weights of its own, as evaluate.network does for all."""

Settings = TypeVar("Settings", bound=EvaluateSettings)


def with_local_networks(config: Settings, raw: DictConfig, folder: Path) -> Settings:
    """Return ``config`` with each reference to weights as an existing file; what a store holds is copied to ``folder``.

    Raises:
        ConfigError: no such file, model or run.

    A file without a checksum beside it is copied to ``folder`` too, with one.
    """
    competitors = {
        name: replace(entry, settings=entry.settings | {SETTING: str(local_network(given, raw, folder, key))})
        if isinstance(given := entry.settings.get(SETTING), str)
        else entry
        for name, entry in config.competitors.items()
        for key in (f"evaluate.competitors.{name}.settings.{SETTING}",)
    }
    shared = None if config.network is None else str(local_network(config.network, raw, folder, "evaluate.network"))
    return replace(config, competitors=competitors, network=shared)


def local_network(reference: str, raw: DictConfig, folder: Path, key: str) -> Path:
    """Return the file of the weights that ``reference``, given at ``key``, names. Raises as `with_local_networks`."""
    if is_stored(reference):
        found = fetch_network(reference, store_of(raw), folder, key)
        print(f"{key} = {reference}: {found.name}")
        return found
    path = CONF.parent / Path(reference).expanduser()  # an absolute path stays itself
    if not path.is_file():
        raise ConfigError(f"{key} = {reference}: no such file. Expected the weights of a network: {EXPECTED}")
    return path if sum_path(path).is_file() else _summed_copy(path, folder, key)


def _summed_copy(path: Path, folder: Path, key: str) -> Path:
    """Return a copy with a checksum beside it, without which no weights are loaded: a file that was sent has none."""
    digest = digest_file(path)
    target = folder / f"{digest[:16]}{WEIGHTS}"
    if not target.is_file():
        with replacing(target, summed=True) as half:
            half.write_bytes(path.read_bytes())
    print(f"{key} = {path}: no checksum lies beside it, so it is taken as it is, SHA-256 {digest[:16]}...")
    return target
