"""From the command line and the last request to the next one, and params.yaml, which holds it for DVC."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from typing import Any

import yaml
from omegaconf import DictConfig, OmegaConf

from pipeline.checking import near_miss
from pipeline.errors import ConfigError
from pipeline.files import write_text
from pipeline.stages.compose import NO_DATA, NO_PARTS, PARAMS, Request, checked_request, load_request
from pipeline.stages.composing import unknown

_OWN = {"experiment": "experiment", "plans.root": "data", "parts": "parts"}
"""Keys of the command line that have a key of their own in params.yaml, by their names there."""


def last_request() -> Request:
    """Return what params.yaml asks for, or the demo where there is none."""
    return load_request(PARAMS) if PARAMS.exists() else Request()


def requested(overrides: Sequence[str], last: Request = Request()) -> Request:  # noqa: B008 - frozen
    """Return what command line ``overrides`` ask for, starting from the ``last`` request.

    ``experiment=NAME`` starts anew. Otherwise what is not named stays as it was: a key given again replaces the
    earlier override, and ``~key`` takes it back.
    """
    given = [(_key_of(entry), entry) for entry in overrides]
    if "experiment" in (key for key, entry in given if not entry.startswith("~")):
        last = Request()
    own = {name: getattr(last, name) for name in _OWN.values()}
    kept = [(_key_of(entry), entry) for entry in last.overrides]
    for key, entry in given:
        name = _OWN.get(key)
        if entry.startswith("~"):
            kept = [(other, text) for other, text in kept if other != key and not other.startswith(f"{key}.")]
        elif name is None:
            kept = [(other, text) for other, text in kept if other != key] + [(key, entry)]
        if name is not None:
            default = getattr(Request(), name)
            own[name] = default if entry.startswith("~") else entry.partition("=")[2].strip("'\"")
    return checked_request(Request(**own, overrides=[text for _, text in kept]))


def _key_of(entry: str) -> str:
    key, equals, _ = entry.partition("=")
    if entry.startswith("--"):
        raise ConfigError(f"{entry} is no option of hinterland: those of dvc repro follow --, as in `-- --dry`")
    if not equals and not entry.startswith("~"):
        raise ConfigError(f"{entry!r} is not an override: expected key=value.{near_miss(entry, ['--help', '--'])}")
    return key.lstrip("+~")


def described(request: Request, last: Request) -> str:
    """Return in one line what runs, and which of it nobody named now."""
    said, before = _said(request), _said(last)
    gone = [entry for entry in before if entry.partition("=")[0] not in {text.partition("=")[0] for text in said}]
    dropped = f"; no longer {' '.join(gone)}" if gone else ""
    return f"runs {' '.join(said)}{dropped}"


def _said(request: Request) -> list[str]:
    data = [] if request.data == NO_DATA else [f"plans.root={request.data}"]
    parts = [] if request.parts == NO_PARTS else [f"parts={request.parts}"]
    return [f"experiment={request.experiment}", *request.overrides, *data, *parts]


def fallbacks(overrides: Sequence[str], raw: DictConfig, request: Request) -> list[str]:
    """Return a line for each ``~key`` of ``overrides`` with the value that holds again.

    Raises:
        ConfigError: there is no such key.
    """
    lines = []
    for key in (entry[1:].partition("=")[0] for entry in overrides if entry.startswith("~")):
        if key == "experiment":
            lines.append(f"~experiment: falls back to {request.experiment}")
            continue
        try:
            value: Any = OmegaConf.select(raw, key, throw_on_missing=False, default=...)
        except ValueError:
            value = ...
        if value is ...:
            raise ConfigError(unknown(key))
        shown = OmegaConf.to_container(value) if OmegaConf.is_config(value) else value
        lines.append(f"~{key}: falls back to {shown!r}, as experiment={request.experiment} has it")
    return lines


def write_request(request: Request) -> None:
    """Write ``request`` to params.yaml, keeping the comment at its head; an equal file stays untouched."""
    before = PARAMS.read_text(encoding="utf-8") if PARAMS.exists() else ""
    content = {entry.name: getattr(request, entry.name) for entry in fields(request)} | {
        "overrides": list(request.overrides)
    }
    if yaml.safe_load(before or "{}") == content:
        return
    head = "".join(f"{line}\n" for line in before.splitlines() if line.startswith("#"))
    write_text(PARAMS, head + yaml.safe_dump(content, sort_keys=False))


class Trial:
    """Whether a request that is tried out was worth keeping; `trying` asks at its end."""

    keep = False


@contextmanager
def trying(request: Request) -> Iterator[Trial]:
    """Write ``request`` to params.yaml, where DVC looks for it, and put back what was there unless it is to be kept."""
    before = (PARAMS.read_bytes(), PARAMS.stat()) if PARAMS.exists() else None
    trial = Trial()
    write_request(request)
    try:
        yield trial
    finally:
        if not trial.keep and before is None:
            PARAMS.unlink(missing_ok=True)
        elif not trial.keep and before is not None and PARAMS.read_bytes() != before[0]:
            write_text(PARAMS, before[0].decode())
            os.utime(PARAMS, ns=(before[1].st_atime_ns, before[1].st_mtime_ns))
