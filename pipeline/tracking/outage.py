"""A store that does not answer is asked once in a run of the pipeline, with a short patience."""

import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

from pipeline.files import write_text

RUN_VARIABLE: Final = "HINTERLAND_RUN"
"""Set by ``hinterland`` for the stages below it: what one of them learnt about the store holds for all."""

PATIENCE_S: Final = 6.0
"""How long the first answer of a server may take in all [s]."""

_PATIENCE: Final = {"MLFLOW_HTTP_REQUEST_MAX_RETRIES": "0", "MLFLOW_HTTP_REQUEST_TIMEOUT": "4"}
_LONGEST_REASON: Final = 200
# What is told in place of the whole chain of exceptions that requests makes of it.
_PLAIN: Final = {"timed out": "the server does not answer", "Connection refused": "connection refused"}
_seen: dict[Path, str] = {}
_untold: set[Path] = set()

Answer = TypeVar("Answer")


def be_impatient() -> None:
    """Let mlflow give up a request after four silent seconds, where the user says nothing else: it would take 248."""
    for variable, value in _PATIENCE.items():
        os.environ.setdefault(variable, value)


def within_patience(ask: Callable[[], Answer]) -> Answer:
    """Return what ``ask`` returns or raise what it raises; TimeoutError when it takes longer than PATIENCE_S."""
    answers: list[Answer] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            answers.append(ask())
        except BaseException as error:
            errors.append(error)

    # A daemon, since nothing else lets go of a connection that hangs in the name lookup or in a database driver.
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(PATIENCE_S)
    if errors:
        raise errors[0]
    if not answers:
        raise TimeoutError(f"no answer within {PATIENCE_S:g} s")
    return answers[0]


def note_outage(spool: Path, error: Exception) -> str:
    """Remember that the store failed, for this process and for the later stages of the same run; return why."""
    reason = _reason(error)
    _seen[spool] = reason
    _untold.add(spool)
    marker = _marker(spool)
    if marker is not None:
        try:
            write_text(marker, reason)
        except OSError:
            return reason  # then the next stage asks once more
    return reason


def known_outage(spool: Path) -> str | None:
    """Return why the store failed before in this run, or None if it is worth asking."""
    marker = _marker(spool)
    if spool not in _seen and marker is not None and marker.is_file():
        return marker.read_text(encoding="utf-8", errors="replace")
    return _seen.get(spool)


def is_news(spool: Path) -> bool:
    """Return once that the store failed in this process: one warning is enough."""
    news = spool in _untold
    _untold.discard(spool)
    return news


def forget_outages(spool: Path) -> None:
    """Remove the marks of earlier runs of the pipeline."""
    for marker in spool.glob(".outage-*"):
        marker.unlink(missing_ok=True)
    _seen.pop(spool, None)
    _untold.discard(spool)


def _marker(spool: Path) -> Path | None:
    run = os.environ.get(RUN_VARIABLE, "")
    return spool / f".outage-{run}" if run.isalnum() else None


def _reason(error: Exception) -> str:
    for sign, plain in _PLAIN.items():
        if sign in str(error):
            return plain
    first = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return first if len(first) <= _LONGEST_REASON else f"{first[: _LONGEST_REASON - 3]}..."
