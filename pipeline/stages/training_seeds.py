"""The spread over training seeds: ``python -m pipeline.stages.training_seeds SUMMARY.json SUMMARY.json ...``.

Each file is the ``artifacts/evaluate/summary.json`` of a run that differs from the others by ``train.seed`` alone:

    for s in 0 1 2; do
      hinterland train.seed=$s && cp artifacts/evaluate/summary.json summary-$s.json
    done
    python -m pipeline.stages.training_seeds summary-*.json
"""

import json
import sys
from pathlib import Path
from typing import Any

from pipeline.errors import HinterlandError, TableError
from pipeline.evaluation.training_spread import training_spread
from pipeline.stages.door import refuse


def main(arguments: list[str]) -> None:
    """Print the table of the runs whose summaries are named."""
    if not arguments or set(arguments) & {"-h", "--help"}:
        print(__doc__)
        return
    try:
        print(training_spread({name: _read(Path(name)) for name in arguments}))
    except HinterlandError as error:
        refuse(error)


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise TableError(f"{path}: not a readable summary.json of the evaluate stage ({error}).") from error
    if not isinstance(content, dict):
        raise TableError(f"{path}: not the summary.json of an evaluate stage, but a JSON {type(content).__name__}.")
    return content


if __name__ == "__main__":
    main(sys.argv[1:])
