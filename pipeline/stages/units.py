"""Work in units that a killed run does not lose: each unit appears whole or not at all, and is done only once."""

import json
import os
import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from pipeline.files import damage, sum_path, take_name, write_json
from pipeline.stages.progress import track

_FINGERPRINT = "fingerprint.json"
_SCRATCH = ".partial"

Unit = tuple[Path, Any]
"""Where the unit's result goes (a file or a folder), and what the work function needs to make it."""


def run_units(
    units: Sequence[Unit],
    make: Callable[[Path, Any], None],
    folder: Path,
    fingerprint: dict[str, Any],
    *,
    workers: int,
    label: str,
    progress: bool = True,
) -> int:
    """Make every unit of ``folder`` that is not there yet; return how many were there already.

    make: called as ``make(scratch, task)`` in a worker process; writes a file or a folder at ``scratch``, which then
        takes the unit's name.
    fingerprint: all that the results depend on. Where it differs from that of the units found, they are deleted:
        work of another configuration, other inputs or other code is never mixed in. A unit that does not fit its
        checksum is named and made again.
    """
    _adopt(folder, fingerprint, label)
    _drop_damaged([target for target, _ in units], label)
    missing = [(target, task) for target, task in units if not target.exists()]
    jobs = Parallel(n_jobs=min(workers, max(1, len(missing))), return_as="generator_unordered", batch_size=1)
    done = jobs(delayed(_make_whole)(make, target, task) for target, task in missing)
    for _ in track(done, len(missing), label, shown=progress):
        pass
    return len(units) - len(missing)


def _make_whole(make: Callable[[Path, Any], None], target: Path, task: Any) -> None:
    scratch = target.with_name(f"{target.name}.{os.getpid()}{_SCRATCH}")
    try:
        make(scratch, task)
        if scratch.is_dir():
            os.replace(scratch, target)  # the files within have their checksums beside them
        else:
            take_name(scratch, target)
    finally:
        _remove(scratch)
        _remove(sum_path(scratch))


def _adopt(folder: Path, fingerprint: dict[str, Any], label: str) -> None:
    """Leave in ``folder`` only whole units of this ``fingerprint``."""
    written = folder / _FINGERPRINT
    reason = damage(written)
    if reason is None:
        found = json.loads(written.read_text(encoding="utf-8"))
        if found == fingerprint:
            for leftover in folder.glob(f"*{_SCRATCH}*"):
                _remove(leftover)
            return
        changed = sorted(key for key in found.keys() | fingerprint.keys() if found.get(key) != fingerprint.get(key))
        reason = f"{folder} holds work of other settings, inputs or code ({', '.join(changed)})"
    if folder.exists():
        if any(folder.iterdir()):
            print(f"{label}: {reason}; all units are made anew", file=sys.stderr)
        shutil.rmtree(folder)
    write_json(written, fingerprint)


def _drop_damaged(targets: Sequence[Path], label: str) -> None:
    """Name and remove the units that do not fit their checksums, so that they are made again."""
    for target in targets:
        if target.exists() and (wrong := damage(target)):
            print(f"{label}: {wrong}; this unit is made again", file=sys.stderr)
            _remove(target)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
