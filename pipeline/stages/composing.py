"""Composition of conf/ with Hydra, and plain words for what Hydra refuses."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from pipeline.checking import near_miss, unknown_key
from pipeline.errors import ConfigError

CONF = Path(__file__).resolve().parents[2] / "conf"

QUIET = (
    "hydra.run.dir=.",
    "hydra.sweep.dir=.",
    "hydra.sweep.subdir=.",
    "hydra.output_subdir=null",
    "hydra/job_logging=stdout",
    "hydra/hydra_logging=none",
)
"""Overrides that keep Hydra from making folders: under DVC a dated folder would take the outputs."""


def search_path(overrides: Sequence[str]) -> list[str]:
    """Return the override that lets Hydra read the ``conf/`` of the folder of own parts that ``overrides`` name.

    Raises:
        ConfigError: there is no such folder.
    """
    named = [entry.partition("=")[2].strip("'\"") for entry in overrides if entry.startswith("parts=")]
    if not named or any(entry.startswith("hydra.searchpath=") for entry in overrides):
        return []
    folder = Path(named[-1])
    if named[-1] != "null" and not folder.is_dir():
        raise ConfigError(f"parts = {folder}: no such folder. Expected the folder of your own parts, or null")
    conf = folder.resolve() / "conf"
    return [f"hydra.searchpath=[{quoted(f'file://{conf}')}]"] if conf.is_dir() else []


def quoted(text: str) -> str:
    """Return ``text`` as a value in Hydra's grammar."""
    escaped = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"


def composed(overrides: Sequence[str] = ()) -> DictConfig:
    """Return conf/config.yaml composed with ``overrides``; ``parts=FOLDER`` adds the groups of FOLDER/conf.

    Raises:
        ConfigError: an override names an unknown key or option, or is not an override at all.

    """
    GlobalHydra.instance().clear()
    try:
        with initialize_config_dir(version_base="1.3", config_dir=str(CONF)):
            return compose("config", overrides=[*overrides, *search_path(overrides)])
    except (HydraException, OmegaConfBaseException) as error:
        raise explain(error, overrides) from error


def explain(error: Exception, overrides: Sequence[str]) -> ConfigError:
    """Return what Hydra or OmegaConf refused as one sentence with the nearest allowed spelling."""
    if isinstance(error, OverrideParseException):
        return ConfigError(f"{error.override!r} is not an override: expected key=value, such as train.steps=100")
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        return _missing_option(error.missing_cfg_file, [str(option) for option in error.options or ()])
    refused = _refused_key(error, overrides)
    if refused is not None:
        return ConfigError(unknown(refused))
    return ConfigError(" ".join(str(error).split()))


def unknown(key: str) -> str:
    """Return the message for a ``key`` that conf/ does not hold, with those it may have meant."""
    return unknown_key(key, _siblings(key), "conf/")


def _missing_option(file: str, options: Sequence[str]) -> ConfigError:
    group, _, option = file.strip("/").rpartition("/")
    if not group:
        return ConfigError(f"no configuration file {file}")
    return ConfigError(
        f"{group}={option}: there is no conf/{group}/{option}.yaml."
        f"{near_miss(option, options)} Allowed are {', '.join(sorted(options))}"
    )


def _refused_key(error: Exception, overrides: Sequence[str]) -> str | None:
    """Return the key that is not in the struct, which Hydra names in the message and OmegaConf in the cause."""
    cause = error if isinstance(error, OmegaConfBaseException) else error.__cause__
    known = set(_leaves(_defaults()))
    for override in overrides:
        key = override.partition("=")[0].lstrip("~")
        if "=" in override and not key.startswith(("+", "-", "hydra")) and str(error).find(key) >= 0:
            group = (CONF / key).is_dir()
            if not group and not any(name == key or name.startswith(f"{key}.") for name in known):
                return key
    return cause.full_key if isinstance(cause, OmegaConfBaseException) and cause.full_key else None


def _siblings(key: str) -> list[str]:
    """Return the keys a misspelt ``key`` may have meant: those of the innermost section that exists, or the root's."""
    known = _leaves(_defaults())
    section = key
    while "." in section:
        section = section.rpartition(".")[0]
        if inside := [name for name in known if name.startswith(f"{section}.")]:
            return inside
    groups = {folder.name for folder in CONF.iterdir() if folder.is_dir()}
    return sorted(groups | {name.partition(".")[0] for name in known})


def _defaults() -> Any:
    GlobalHydra.instance().clear()
    with initialize_config_dir(version_base="1.3", config_dir=str(CONF)):
        return OmegaConf.to_container(compose("config"))


def _leaves(tree: Any, prefix: str = "") -> list[str]:
    return list(_walk(tree, prefix))


def _walk(tree: Any, prefix: str) -> Iterator[str]:
    for name, value in tree.items():
        full = f"{prefix}{name}"
        if isinstance(value, dict) and value:
            yield from _walk(value, f"{full}.")
        else:
            yield full
