"""Runs that no store took: each a folder with ``run.json`` and copies of its files, whole, to be logged later.

run.json: ``version``, ``experiment``, ``reason``, ``ended_ms`` (Unix time) and ``run``, the fields of
:class:`pipeline.tracking.runs.Run`; its ``files`` are paths within the folder, and of a model its example is kept.
"""

import json
import math
import os
import shutil
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from pipeline.files import write_text
from pipeline.tracking.revision import revision_tags
from pipeline.tracking.runs import Model, Run
from pipeline.tracking.store import Destination, checkout

SPOOL_VERSION: Final = 1
RECORD: Final = "run.json"


def keep(destination: Destination, run: Run, reason: str) -> Path:
    """Write ``run`` to a folder of its own in the spool of ``destination``; it appears whole. Raises OSError."""
    started = time.time_ns()
    target = destination.spool / f"{time.strftime('%Y%m%dT%H%M%S', time.gmtime())}-{run.name}-{started % 10**9:09d}"
    scratch = target.with_name(f"{target.name}.{os.getpid()}.partial")
    try:
        (scratch / "files").mkdir(parents=True)
        copies = [_copy(file, scratch, number) for number, file in enumerate(run.files)]
        content = {
            "version": SPOOL_VERSION,
            "experiment": destination.experiment,
            "reason": reason,
            "ended_ms": started // 1_000_000,
            "run": _content(run, copies),
        }
        write_text(scratch / RECORD, json.dumps(content, indent=2, allow_nan=False, default=str) + "\n", summed=True)
        os.replace(scratch, target)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return target


def kept(spool: Path) -> list[Path]:
    """Return the folders of the runs that wait in ``spool``, the oldest first."""
    return sorted(record.parent for record in spool.glob(f"*/{RECORD}") if record.parent.suffix != ".partial")


def _copy(file: Path, folder: Path, number: int) -> str:
    name = file.name if not (folder / "files" / file.name).exists() else f"{number}-{file.name}"
    shutil.copyfile(file, folder / "files" / name)
    return f"files/{name}"


def _content(run: Run, files: list[str]) -> dict[str, Any]:
    return {
        "name": run.name,
        "run_id": run.run_id,
        "params": dict(run.params),
        "config": dict(run.config),
        "metrics": {name: float(value) for name, value in run.metrics.items() if math.isfinite(value)},
        # As they are now: when the run is logged, another revision may be checked out.
        "tags": {**revision_tags(checkout()), **run.tags},
        "files": files,
        "datasets": [asdict(dataset) | {"path": str(dataset.path.resolve())} for dataset in run.datasets],
        "model": None if run.model is None else _model(run.model),
    }


def _model(model: Model) -> dict[str, Any]:
    """Return what the files do not say: the weights are among them, the architecture is in their header."""
    return {"name": model.name, "inputs": model.inputs.tolist(), "outputs": model.outputs.tolist()}
