"""One look for all figures: sizes, colours that colour-blind readers tell apart, and how a figure is saved."""

from collections.abc import Iterable
from itertools import cycle
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.evaluation.competitors import Role
from pipeline.files import replacing

# Okabe and Ito's palette, which stays distinct under the common kinds of colour blindness.
BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
SKY = "#56B4E9"
INK = "#1f2933"
MUTED = "#6b7785"
GRID = "#e3e7ec"
# P_S runs from red to green as in the paper; yellow between and a legend of values help where the two look alike.
P_SUCCESS_COLOURS = "RdYlGn"
PURPLE = "#CC79A7"
YELLOW = "#E69F00"
_CANDIDATES = (BLUE, PURPLE, YELLOW, SKY)
_BOUNDS = (GREEN, MUTED)


def colours_of(entries: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Return a colour for each competitor, given as (name, role) in the order of the tables.

    The baseline and the first of each role look the same in every report.
    """
    palettes = {
        Role.baseline: iter([ORANGE]),
        Role.candidate: cycle(_CANDIDATES),
        Role.bound: cycle(_BOUNDS),
    }
    return {name: next(palettes[Role(role)], MUTED) for name, role in entries}


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of ``width`` x ``height`` inches that belongs to no window."""
    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def dress(axes: Axes, *, x: str, y: str, title: str = "", grid: bool = True) -> None:
    """Give ``axes`` labels, a quiet frame and a grid behind the data."""
    axes.set_xlabel(x, color=INK, fontsize=10)
    axes.set_ylabel(y, color=INK, fontsize=10)
    if title:
        axes.set_title(title, color=INK, fontsize=11, loc="left")
    axes.tick_params(colors=MUTED, labelsize=9)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(MUTED)
    axes.set_axisbelow(True)
    if grid:
        axes.grid(color=GRID, linewidth=0.8)


def save_figure(figure: Figure, path: Path, *, dpi: int) -> Path:
    """Write ``figure`` to ``path`` as PNG, atomically and without a time stamp; returns ``path``."""
    with replacing(path) as scratch:
        figure.savefig(scratch, format="png", dpi=dpi, metadata={"Software": None})
    return path
