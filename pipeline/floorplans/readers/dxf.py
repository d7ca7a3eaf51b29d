"""DXF drawings: walls and doors by the names of their layers.

Walls are the lines, polylines and curves of the layers of walls and windows, ``wall_m`` thick or as wide as they state,
and the areas: solids, hatches, faces, multilines. A wall drawn by both faces is filled (`pipeline.floorplans.walls`). A
closed polyline is a line too: it may as well outline a room as a pillar. Layers of hatches, dimensions and tags are
passed over (`dxf_layers`), and what the author switched off (`dxf_entities`).

What touches on the door layers is one door. An arc, stretched or not, is the swing of a leaf (`dxf_doors`): the doorway
runs from its centre to the end of the arc that lies in a wall, or nearest to one; the other end is where the open leaf
stands. A door without an arc is as wide as the longer side of its box. Doorways are cut through walls drawn across.

The unit is ``$INSUNITS`` of the header; ``metres_per_unit`` replaces it, and is needed where it is unset.
"""

import logging
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from shapely.errors import GEOSException
from shapely.geometry import LineString

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.drawing import Drawing, plan_of, scale_of
from pipeline.floorplans.readers.dxf_doors import WIDTHS_M, doorways, is_doorway
from pipeline.floorplans.readers.dxf_entities import Collector, Found, damage
from pipeline.floorplans.readers.dxf_layers import LayerTable
from pipeline.floorplans.readers.dxf_remarks import remarks_on, why_no_wall
from pipeline.floorplans.readers.json_file import short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # what matters is in the error or in the remarks

_BINARY = "AutoCAD Binary DXF"
_MOST_BYTES = 200_000_000
_PEN_M = 0.01  # a polyline no wider is a line drawn with a pen
_INCH_M, _SURVEY_FOOT_M = 0.0254, 1200 / 3937
_METRES_OF_UNIT = dict(  # by code of $INSUNITS, from 1; the last four are units of the US survey foot of 1893
    enumerate(
        (
            *(_INCH_M, 12 * _INCH_M, 63_360 * _INCH_M, 1e-3, 1e-2, 1.0, 1e3, 1e-6 * _INCH_M, 1e-3 * _INCH_M),
            *(36 * _INCH_M, 1e-10, 1e-9, 1e-6, 0.1, 10.0, 100.0, 1e9),
            *(149_597_870_700.0, 9.4607304725808e15, 3.0856775814913673e16),  # astronomical unit, light year, parsec
            *(_SURVEY_FOOT_M, _SURVEY_FOOT_M / 12, 3 * _SURVEY_FOOT_M, 5280 * _SURVEY_FOOT_M),
        ),
        start=1,
    )
)


@dataclass(frozen=True)
class Dxf:
    """Reader of one floor per DXF file; the file is the building."""

    name: str = "dxf"
    patterns: tuple[str, ...] = ("*.dxf",)
    uses: tuple[str, ...] = ("metres_per_unit", "wall_m", "wall_layers", "door_layers")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins with a section of DXF, as text or binary."""
        text = sniff_text(path)
        return text.startswith(_BINARY) or re.match(r"(?:\s*999\s*\n.*\n)*\s*0\s*\n\s*SECTION\s*\n", text) is not None

    def accompanies(self, path: Path) -> bool:
        """Return False: a drawing is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the plan in model space; see `Reader.read`. Uses scale, thickness of walls and layers."""
        from ezdxf.lldxf.const import DXFError

        document = _load(path)
        stated = _stated_scale(document)
        found = Found()
        thinnest = _PEN_M / (options.metres_per_unit or stated or 1.0)
        try:
            Collector(found, LayerTable.of(document), options, thinnest).collect(document.modelspace())
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        except DXFError as problem:  # an entity that has not what every entity has
            raise PlanError(f"{path}: damaged DXF ({short_text(str(problem))}). Export it again.") from problem
        except GEOSException as problem:
            raise PlanError(f"{path}: a clipped block cannot be cut ({problem}). Simplify the drawing.") from problem
        if not found.walls:
            raise PlanError(f"{path}: {why_no_wall(found, options)}")
        drawing = Drawing(walls=found.walls, remarks=remarks_on(found, options))
        scale = _scale(path, stated, found, drawing, options)
        try:
            openings = doorways(found.walls, found.doors, found.swings, scale)
        except GEOSException as problem:
            raise PlanError(f"{path}: the doors cannot be combined ({problem}). Simplify the drawing.") from problem
        drawing.openings = [opening for opening in openings if is_doorway(opening, scale)]
        if unlikely := len(openings) - len(drawing.openings):
            drawing.remarks.append(f"{unlikely} doors are not {WIDTHS_M[0]} to {WIDTHS_M[1]} m wide: left out")
        yield plan_of(
            drawing, scale, options, plan_id=path.stem, building=path.stem, environment="dxf_plans", path=path
        )


def _load(path: Path) -> "Document":
    from ezdxf.filemanagement import readfile

    try:
        if path.stat().st_size > _MOST_BYTES:
            raise PlanError(f"{path}: more than {_MOST_BYTES:,} bytes, at most that many are read. Simplify it.")
        document = readfile(path)
        document.modelspace()  # raises where the file has none
        return document
    except PlanError:
        raise
    except OSError as problem:
        raise PlanError(f"{path}: not a readable DXF file ({short_text(str(problem))}).") from problem
    except damage() as problem:
        raise PlanError(
            f"{path}: damaged DXF ({type(problem).__name__}: {short_text(str(problem))}). Export it again."
        ) from problem


def _stated_scale(document: "Document") -> float | None:
    """Return metres per drawing unit as the header states them."""
    try:
        return _METRES_OF_UNIT.get(int(document.header.get("$INSUNITS", 0)))
    except damage():
        return None


def _scale(path: Path, stated: float | None, found: Found, drawing: Drawing, options: ReadOptions) -> float:
    """Return metres per drawing unit, from a person or from the header."""
    if stated is not None and options.metres_per_unit is None:
        return stated
    radii = [LineString((swing.centre, swing.start)) for swing in found.swings]
    scale = scale_of(str(path), Drawing(openings=[*radii]), options)
    if stated is not None and abs(scale / stated - 1) > 1e-6:
        drawing.remarks.append(f"the header states {stated:g} m per unit, {scale:g} m was asked for and taken")
    return scale
