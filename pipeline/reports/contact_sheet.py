"""A contact sheet: many plans, small, each with its name and a scale bar. One look finds what no check does.

Drawn pixel by pixel with Pillow: two thousand plans take seconds. Each plan is drawn a few times larger than shown; a
pixel of the sheet is a mix of the mean and the darkest of what it stands for, so that thin walls do not fade away.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from matplotlib import font_manager
from PIL import Image, ImageDraw, ImageFont

from pipeline.files import replacing
from pipeline.floorplans.openings import NARROWEST_DOOR_M
from pipeline.floorplans.plan import FloorPlan, GridPlan, bounds_of, without_margins
from pipeline.reports.plan_looks import DOOR, SPLINTER, WALL, Pixels, parts_of, shades_of, tint
from pipeline.reports.style import INK, MUTED

_FINER = 3  # drawn so many times larger than shown
_LARGEST_TILE, _SMALLEST_TILE = 460, 96  # [pixels]
_SHEET_PIXELS = 16_000_000
_GAP = 14
_CAPTION = 26
_NICE_M = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


class Tile(NamedTuple):
    """One plan of a sheet.

    name: what stands below it. image: [rows, cols, 3], row 0 the top. metres_per_pixel: its scale.
    """

    name: str
    image: Pixels
    metres_per_pixel: float


def tile_size(count: int) -> int:
    """Return the side [pixels] of a tile on a sheet of ``count`` plans: the more, the smaller."""
    side = math.sqrt(_SHEET_PIXELS / max(1, count))
    return int(min(_LARGEST_TILE, max(_SMALLEST_TILE, side - 2 * _GAP)))


def draw_tile(plan: FloorPlan | GridPlan, side: int, *, name: str | None = None) -> Tile:
    """Draw ``plan`` so that it fills a square of ``side`` pixels; ``name`` stands below it, by default its plan id.

    Margins of unknown cells are left out. A line runs around the drawing, where a robot could not go on either.
    """
    plan = without_margins(plan)
    low_x, low_y, high_x, high_y = bounds_of(plan)
    longer = max(high_x - low_x, high_y - low_y)
    finer = side * _FINER
    cols, rows = (
        max(_FINER, math.ceil(length / longer * finer / _FINER) * _FINER) for length in (high_x - low_x, high_y - low_y)
    )
    if isinstance(plan, GridPlan):
        canvas = _cells_image(plan, cols, rows)
    else:
        canvas = _geometry_image(plan, cols, rows, finer / longer)
    pen = ImageDraw.Draw(canvas)
    _mark_doors(pen, plan, rows, finer / longer)
    pen.rectangle((0, 0, cols - 1, rows - 1), outline=WALL, width=_FINER)
    return Tile(name or plan.plan_id, _shrink(np.asarray(canvas)), longer / side)


def write_contact_sheet(tiles: Sequence[Tile], path: Path, *, title: str = "", columns: int | None = None) -> Path:
    """Write the tiles in reading order to ``path`` as PNG, atomically; returns ``path``."""
    if not tiles:
        raise ValueError("a contact sheet needs at least one plan")
    columns = columns or max(1, round(math.sqrt(len(tiles) * 1.3)))
    columns = min(columns, len(tiles))
    width = max(tile.image.shape[1] for tile in tiles)
    lines = [tiles[start : start + columns] for start in range(0, len(tiles), columns)]
    heights = [max(tile.image.shape[0] for tile in line) + _CAPTION + _GAP for line in lines]
    head = 34 if title else _GAP
    sheet = Image.new("RGB", (columns * (width + _GAP) + _GAP, head + sum(heights)), "white")
    pen = ImageDraw.Draw(sheet)
    if title:
        pen.text((_GAP, 9), title, fill=INK, font=_font(15))
    top = head
    for line, height in zip(lines, heights, strict=True):
        for place, tile in enumerate(line):
            _paste(sheet, pen, tile, _GAP + place * (width + _GAP), top, width)
        top += height
    with replacing(path) as scratch:
        sheet.save(scratch, format="PNG", optimize=True)
    return path


def _paste(sheet: Image.Image, pen: ImageDraw.ImageDraw, tile: Tile, left: int, top: int, width: int) -> None:
    """Put a tile on the sheet; below it its name, and a bar of a round length."""
    rows = tile.image.shape[0]
    sheet.paste(Image.fromarray(tile.image), (left, top))
    length = next((nice for nice in reversed(_NICE_M) if nice / tile.metres_per_pixel <= 0.34 * width), _NICE_M[0])
    bar, font = length / tile.metres_per_pixel, _font(10)
    right, level = left + width - 1, top + rows + 5
    pen.line((right - bar, level, right, level), fill=INK, width=2)
    text = f"{length} m"
    pen.text((right - pen.textlength(text, font=font), level + 4), text, fill=MUTED, font=font)
    room = width - 10 - max(bar, pen.textlength(text, font=font))
    pen.text((left, level + 1), _fitting(pen, tile.name, room, font), fill=INK, font=font)


def _fitting(pen: ImageDraw.ImageDraw, name: str, room: float, font: ImageFont.FreeTypeFont) -> str:
    """Return ``name``, or its end after dots where it is too long: the end tells plans of one file apart."""
    if pen.textlength(name, font=font) <= room:
        return name
    start = 1
    while start < len(name) and pen.textlength(f"..{name[start:]}", font=font) > room:
        start += 1
    return f"..{name[start:]}"


def _cells_image(plan: GridPlan, cols: int, rows: int) -> Image.Image:
    """Return the cells as ``cols`` x ``rows`` pixels; where several fall into one, the wall among them shows."""
    shades = shades_of(plan)[::-1]
    factor = max(1, math.ceil(max(shades.shape[0] / rows, shades.shape[1] / cols)))
    return Image.fromarray(_darkest(shades, factor)).resize((cols, rows), Image.Resampling.NEAREST)


def _geometry_image(plan: FloorPlan, cols: int, rows: int, scale: float) -> Image.Image:
    canvas = Image.new("RGB", (cols, rows), WALL)
    pen = ImageDraw.Draw(canvas)
    for rank, part in reversed(list(enumerate(parts_of(plan)))):
        for ring, colour in ((part.exterior, tint(rank)), *((hole, WALL) for hole in part.interiors)):
            corners = shapely.get_coordinates(ring)
            x, y = (corners[:, 0] - plan.bounds.min_x) * scale, rows - (corners[:, 1] - plan.bounds.min_y) * scale
            pen.polygon([*zip(x.tolist(), y.tolist(), strict=True)], fill=colour, outline=WALL)
    return canvas


def _mark_doors(pen: ImageDraw.ImageDraw, plan: FloorPlan | GridPlan, rows: int, scale: float) -> None:
    low_x, low_y, _, _ = bounds_of(plan)
    for door in plan.doors:
        x, y = (door.x - low_x) * scale, rows - (door.y - low_y) * scale
        radius = max(1.5 * _FINER, min(door.width, 3.0) / 2 * scale)
        colour = DOOR if door.width >= NARROWEST_DOOR_M else SPLINTER
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), outline=colour, width=_FINER)


def _shrink(image: Pixels) -> Pixels:
    rows, cols = (length // _FINER for length in image.shape[:2])
    blocks = image[: rows * _FINER, : cols * _FINER].reshape(rows, _FINER, cols, _FINER, 3).astype(np.float32)
    mean = blocks.mean(axis=(1, 3))
    return np.asarray(0.5 * mean + 0.5 * blocks.min(axis=(1, 3))).round().astype(np.uint8)


def _darkest(image: Pixels, factor: int) -> Pixels:
    """Return one pixel for ``factor`` x ``factor``: the darkest of them."""
    rows, cols = image.shape[:2]
    padded = np.pad(image, ((0, -rows % factor), (0, -cols % factor), (0, 0)), mode="edge")
    blocks = padded.reshape(padded.shape[0] // factor, factor, padded.shape[1] // factor, factor, 3)
    return np.asarray(blocks.min(axis=(1, 3)))


def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(font_manager.findfont("DejaVu Sans"), size)  # comes with matplotlib
