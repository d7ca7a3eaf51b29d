"""A plan on its own: to scale, with its doors, the labels of its rooms, and every cut-off part of the floor tinted."""

from pathlib import Path

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from shapely.geometry import Polygon

from pipeline.floorplans.checks import PlanReport
from pipeline.floorplans.openings import NARROWEST_DOOR_M
from pipeline.floorplans.plan import CLUTTER, UNKNOWN, Bounds, FloorPlan, GridPlan, bounds_of, without_margins
from pipeline.reports.plan_looks import (
    DOOR,
    FURNITURE,
    SPLINTER,
    TINTS,
    UNSEEN,
    WALL,
    parts_of,
    shades_of,
    tint,
)
from pipeline.reports.style import INK, dress, new_figure, save_figure

_LONGER_SIDE_INCHES = 9.0
_SHORTEST_SIDE_INCHES = 2.0
_MARGIN = 0.03  # around the drawing, as a share of its longer side
_MOST_LABELS = 120  # more room names than this cover the plan


def draw_plan(plan: FloorPlan | GridPlan, report: PlanReport) -> Figure:
    """Return the plan drawn to scale, x and y in metres, with a legend; margins of unknown cells are left out."""
    plan = without_margins(plan)
    bounds = bounds_of(plan)
    width, height = bounds.max_x - bounds.min_x, bounds.max_y - bounds.min_y
    inches = _LONGER_SIDE_INCHES / max(width, height)
    figure = new_figure(*(max(_SHORTEST_SIDE_INCHES, side * inches) + 0.9 for side in (width, height)))
    axes = figure.subplots()
    _draw_floor(axes, plan, bounds)
    _draw_doors(axes, plan)
    if isinstance(plan, FloorPlan):
        _name_rooms(axes, plan)
    margin = _MARGIN * max(width, height)
    axes.set(
        xlim=(bounds.min_x - margin, bounds.max_x + margin),
        ylim=(bounds.min_y - margin, bounds.max_y + margin),
        aspect="equal",
    )
    dress(axes, x="x [m]", y="y [m]", title=f"{plan.plan_id}: {width:.1f} x {height:.1f} m", grid=False)
    figure.legend(
        handles=_legend(plan, report), loc="outside lower center", ncols=6, fontsize=8, frameon=False, labelcolor=INK
    )
    return figure


def write_plan_picture(plan: FloorPlan | GridPlan, report: PlanReport, path: Path, *, dpi: int = 110) -> Path:
    """Draw the plan to ``path`` as PNG, atomically; returns ``path``."""
    return save_figure(draw_plan(plan, report), path, dpi=dpi)


def _draw_floor(axes: Axes, plan: FloorPlan | GridPlan, bounds: Bounds) -> None:
    low_x, low_y, high_x, high_y = bounds
    if isinstance(plan, GridPlan):
        axes.imshow(shades_of(plan), origin="lower", extent=(low_x, high_x, low_y, high_y), interpolation="antialiased")
        return
    axes.add_patch(PathPatch(_outline(shapely.box(low_x, low_y, high_x, high_y)), facecolor=_rgb(WALL), linewidth=0))
    for rank, part in enumerate(parts_of(plan)):
        axes.add_patch(PathPatch(_outline(part), facecolor=_rgb(tint(rank)), edgecolor=_rgb(WALL), linewidth=0.4))


def _outline(polygon: Polygon) -> Outline:
    """Return the outline and the holes of ``polygon`` as one path; holes run the other way round and stay empty."""
    polygon = shapely.geometry.polygon.orient(polygon)
    rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
    codes = np.concatenate([_codes(len(ring)) for ring in rings])
    return Outline(np.concatenate(rings), codes)


def _codes(count: int) -> NDArray[np.uint8]:
    codes = np.full(count, Outline.LINETO, dtype=np.uint8)
    codes[0], codes[-1] = Outline.MOVETO, Outline.CLOSEPOLY
    return codes


def _draw_doors(axes: Axes, plan: FloorPlan | GridPlan) -> None:
    """Draw each door as a disc as wide as the door."""
    if not plan.doors:
        return
    widths = np.array([door.width for door in plan.doors])
    middles = np.array([(door.x, door.y) for door in plan.doors])
    for chosen, colour in ((widths >= NARROWEST_DOOR_M, DOOR), (widths < NARROWEST_DOOR_M, SPLINTER)):
        axes.add_collection(
            EllipseCollection(
                widths[chosen],
                widths[chosen],
                np.zeros(int(chosen.sum())),
                units="xy",
                offsets=middles[chosen],
                offset_transform=axes.transData,
                facecolors=colour,
                alpha=0.65,
                linewidths=0,
            )
        )


def _name_rooms(axes: Axes, plan: FloorPlan) -> None:
    named = [room for room in plan.rooms if room.label and not room.outline.is_empty]
    if len(named) > _MOST_LABELS:
        return
    for room in named:
        spot = room.outline.representative_point()
        axes.text(
            spot.x,
            spot.y,
            room.label[:24],
            fontsize=6,
            color=INK,
            ha="center",
            va="center",
            clip_on=True,
            parse_math=False,
            alpha=0.85,
        )


def _legend(plan: FloorPlan | GridPlan, report: PlanReport) -> list[Patch]:
    entries = [Patch(facecolor="white", edgecolor=_rgb(WALL), linewidth=0.6, label="free floor")]
    entries.append(Patch(facecolor=_rgb(WALL), label="wall"))
    if report.free_components > 1:
        parts = report.free_components - 1
        entries.append(Patch(facecolor=_rgb(TINTS[0]), label=f"{parts} cut-off part{'s' if parts > 1 else ''}"))
    if isinstance(plan, GridPlan):
        for value, colour, name in ((UNKNOWN, UNSEEN, "unknown"), (CLUTTER, FURNITURE, "furniture")):
            if (plan.cells == value).any():
                entries.append(Patch(facecolor=_rgb(colour), label=name))
    splinters = sum(door.width < NARROWEST_DOOR_M for door in plan.doors)
    if len(plan.doors) > splinters:
        entries.append(Patch(facecolor=DOOR, alpha=0.65, label="door"))
    if splinters:
        entries.append(Patch(facecolor=SPLINTER, alpha=0.65, label=f"door below {NARROWEST_DOOR_M} m"))
    return entries


def _rgb(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    red, green, blue = colour
    return red / 255, green / 255, blue / 255
