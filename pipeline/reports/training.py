"""Training curves from artifacts/train/curves.parquet."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.errors import TableError
from pipeline.files import check_sum
from pipeline.reports.style import BLUE, GRID, ORANGE, dress, new_figure

Curves = dict[str, dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]]

_COLUMNS = ("step", "split", "name", "value")
_MOST_PANELS = 8
_WIDE_RANGE = 50.0


def read_curves(path: Path) -> Curves:
    """Return name -> split -> (steps [n], values [n]), by step.

    Raises TableError for a damaged file or missing columns.
    """
    check_sum(path, "Run `dvc repro -f train`.")
    try:
        table = pq.ParquetFile(path).read()
    except (pa.ArrowInvalid, OSError) as error:
        raise TableError(f"{path}: not a readable parquet file ({error}): run `dvc repro -f train`.") from error
    missing = [name for name in _COLUMNS if name not in table.schema.names]
    if missing:
        raise TableError(
            f"{path}: the columns {missing} are missing, expected {list(_COLUMNS)}: run `dvc repro -f train`."
        )
    gathered: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for row in table.select(list(_COLUMNS)).to_pylist():
        if row["value"] is not None and np.isfinite(row["value"]):
            splits = gathered.setdefault(row["name"], {})
            splits.setdefault(row["split"], []).append((float(row["step"]), float(row["value"])))
    return {
        name: {split: _sorted(points) for split, points in sorted(splits.items())} for name, splits in gathered.items()
    }


def draw_training(curves: Curves) -> Figure:
    """Return one panel per quantity, train and validation together; the whole loss first, then its parts."""
    names = sorted(curves, key=lambda name: (name != "loss", "loss" not in name, name))[:_MOST_PANELS]
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    figure = new_figure(4.3 * columns, 2.9 * rows)
    panels = np.atleast_1d(figure.subplots(rows, columns, squeeze=False).ravel())
    for axes, name in zip(panels, names, strict=False):
        _draw_quantity(axes, name, curves[name])
    for axes in panels[len(names) :]:
        axes.set_visible(False)
    return figure


def _draw_quantity(axes: Axes, name: str, splits: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]) -> None:
    lowest, highest = np.inf, 0.0
    for split, (steps, values) in splits.items():
        colour = {"train": ORANGE, "validation": BLUE}.get(split, GRID)
        smooth = _running_mean(values)
        if smooth.size < values.size:
            axes.plot(steps, values, color=colour, linewidth=0.6, alpha=0.25)
        axes.plot(steps[-smooth.size :], smooth, color=colour, linewidth=1.6, label=split)
        if values.size == 1:
            axes.plot(steps, values, "o", color=colour)
        lowest, highest = min(lowest, float(values.min())), max(highest, float(values.max()))
    if lowest > 0 and highest / lowest > _WIDE_RANGE:
        axes.set_yscale("log")
    dress(axes, x="training step", y="", title=name.replace("_", " "))
    axes.legend(fontsize=8, frameon=False)


def _running_mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean over the last 2 % of the points where there are many, else the points themselves."""
    width = values.size // 50
    return values if width < 4 else np.convolve(values, np.ones(width) / width, mode="valid")


def _sorted(points: list[tuple[float, float]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    ordered = np.array(sorted(points), dtype=np.float64)
    return ordered[:, 0], ordered[:, 1]
