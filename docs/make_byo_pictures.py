"""Make the sample buildings and the pictures of bring-your-own-floor-plan.md, by the commands that stand there.

    python docs/make_byo_pictures.py                    # all pictures, by way of a small experiment: some minutes
    python docs/make_byo_pictures.py --samples DIR      # only the sample files, to follow the page with

The samples are offices of the generator, written as people send them: drawings in millimetres, one without a unit and
with its doors on an odd layer, a scan with light walls on dark paper, a venue of two levels in degrees.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import cos, radians
from pathlib import Path

import ezdxf
import numpy as np
import shapely
from PIL import Image
from shapely.geometry.base import BaseGeometry

from pipeline.files import replacing
from pipeline.floorplans.generators.office import OfficeShape, draw_office
from pipeline.floorplans.plan import FREE, Bounds, Door, FloorPlan
from pipeline.grids.rasterize import rasterize
from pipeline.randomness import stream

IMAGES = Path(__file__).parent / "images"
ROOT = Path(__file__).resolve().parents[1]
LATITUDE, LONGITUDE, METRES_PER_DEGREE = 48.15, 11.57, 111_200.0
PAPER, CHALK = (22, 42, 78), (214, 226, 240)
WIDEST = 1000  # of a picture of the page [pixels]
MOST_BYTES = 150_000
SMALL = OfficeShape(length_m=36.0, min_distance_m=20.0, hallway_m=2.4)
LARGE = OfficeShape(length_m=48.0, min_distance_m=20.0, hallway_m=3.0)
EXPERIMENT = (
    "experiment=floors",
    "rasterize.min_distance_m=15",
    "train.steps=400",
    "tracking.enabled=false",
    "execution.workers=1",
    "execution.progress=false",
)
ANNEX = ("--scale", "0.001", "--door-layer", "LEAVES")
STAGES = ("plans", "rasterize", "harvest", "train", "evaluate", "report")


def main() -> None:
    """Make the samples, run the commands of the page on them, and keep the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--samples", type=Path, metavar="DIR", help="only write the sample files there")
    given = parser.parse_args()
    if given.samples is not None:
        write_samples(given.samples)
        return
    with tempfile.TemporaryDirectory(prefix="hinterland-") as scratch:
        place = Path(scratch)
        write_samples(place / "incoming")
        look_at_plans(place)
        gather(place)
        run_experiment(place)


def look_at_plans(place: Path) -> None:
    """Steps 1 to 3: one good drawing, a scan said what it lacks, sealed rooms opened."""
    plan(place, "info", "incoming/north-ground.dxf", "--draw", "seen/north-ground.png")
    keep("byo-1-look", place / "seen/north-ground.png")
    plan(place, "info", "incoming/works.png", fails=True)
    plan(place, "info", "incoming/works.png", "--scale", "0.05", "--draw", "seen/works-dark.png")
    plan(place, "info", "incoming/works.png", "--scale", "0.05", "--invert", "--draw", "seen/works.png")
    keep("byo-2-say", place / "incoming/works.png", place / "seen/works-dark.png", place / "seen/works.png")
    plan(place, "info", "incoming/annex.dxf", fails=True)
    plan(place, "info", "incoming/annex.dxf", "--scale", "0.001", "--draw", "seen/annex-sealed.png")
    plan(place, "info", "incoming/annex.dxf", *ANNEX, "--draw", "seen/annex.png")
    keep("byo-3-fix", place / "seen/annex-sealed.png", place / "seen/annex.png")


def gather(place: Path) -> None:
    """Step 4: every file, read as it must be, becomes a plan that carries its scale; then all of them at a glance."""
    plan(place, "convert", "incoming/works.png", "buildings/works.yaml", "--scale", "0.05", "--invert")
    plan(place, "convert", "incoming/annex.dxf", "buildings/annex.geojson", *ANNEX)
    plan(place, "convert", "incoming/venue.geojson", "buildings", "--to", "plan_geojson", "--door-width", "1.0")
    for drawing in sorted((place / "incoming").glob("*-*.dxf")):
        plan(place, "convert", f"incoming/{drawing.name}", f"buildings/{drawing.stem}.geojson")
    files = sorted(file for file in (place / "buildings").iterdir() if file.suffix != ".pgm")
    lines = ["file,building", *(f"{file.name},{re.split('[-.]', file.name)[0]}" for file in files)]
    (place / "buildings" / "manifest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    say("\n".join(lines))
    plan(place, "sheet", "buildings", "sheet.png", "--workers", "1", "--quiet")
    plan(place, "survey", "buildings", "--workers", "1", "--quiet")
    keep("byo-4-folder", place / "sheet.png")


def run_experiment(place: Path) -> None:
    """Steps 5 and 6: the stages one by one, in a folder of their own, as `hinterland experiment=floors` runs them."""
    places = (f"plans.root={place / 'buildings'}", f"artifacts={place / 'artifacts'}")
    for stage in STAGES:
        say(f"$ {stage}")
        subprocess.run([sys.executable, "-m", f"pipeline.stages.{stage}", *EXPERIMENT, *places], cwd=ROOT, check=True)
    figures = place / "artifacts" / "report" / "figures"
    keep("byo-5-run", figures / "trajectories_0.png")
    keep("byo-6-report", figures / "scatter_learned.png")


def say(text: str) -> None:
    """Print a line at once, in order with what the commands print."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def plan(place: Path, *arguments: str, fails: bool = False) -> None:
    """Run ``hinterland plan`` in ``place``, printing the command as the page shows it."""
    say(f"\n$ hinterland plan {' '.join(arguments)}")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-m", "pipeline", "plan", *arguments], cwd=place, env=environment)
    if bool(done.returncode) != fails:
        raise SystemExit(f"ended with {done.returncode}")


def keep(name: str, *pictures: Path) -> None:
    """Put pictures below each other into docs/images, small: few colours are enough for plans."""
    images = [_fitted(Image.open(picture).convert("RGB")) for picture in pictures]
    sheet = Image.new("RGB", (max(image.width for image in images), sum(image.height for image in images)), "white")
    top = 0
    for image in images:
        sheet.paste(image, ((sheet.width - image.width) // 2, top))
        top += image.height
    target = IMAGES / f"{name}.png"
    with replacing(target) as scratch:
        sheet.quantize(128, dither=Image.Dither.NONE).save(scratch, format="PNG", optimize=True)
    size = target.stat().st_size
    say(f"{target.name}: {sheet.width} x {sheet.height}, {size:,} bytes")
    if size > MOST_BYTES:
        raise SystemExit(f"{target} is larger than {MOST_BYTES:,} bytes")


def _fitted(image: Image.Image) -> Image.Image:
    share = min(1.0, WIDEST / image.width)
    return image.resize((round(image.width * share), round(image.height * share)), Image.Resampling.LANCZOS)


def write_samples(folder: Path) -> None:
    """Write the buildings as they come in."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(("north-ground", "north-upper", "south-ground", "tower-ground", "library-ground")):
        write_dxf(folder / f"{name}.dxf", _office(LARGE if name.startswith("tower") else SMALL, number))
    write_dxf(folder / "annex.dxf", _office(SMALL, 10), unit=None, door_layer="LEAVES", closed=True)
    write_scan(folder / "works.png", _office(SMALL, 11))
    write_venue(folder / "venue.geojson", [_office(SMALL, 12), _office(SMALL, 13)])


def _office(shape: OfficeShape, number: int) -> FloorPlan:
    return draw_office(shape, stream(7, "samples", number), plan_id=f"sample-{number}")


def write_dxf(
    path: Path, office: FloorPlan, *, unit: int | None = 4, door_layer: str = "A-DOOR", closed: bool = False
) -> None:
    """Write both faces of the walls, doors as leaf and swing, and the desks, in millimetres.

    unit: $INSUNITS, 4 for millimetres; None leaves it out. closed: draw the walls on through the doors.
    """
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = unit or 0
    space = document.modelspace()
    rooms = shapely.union_all([room.outline for room in office.rooms])
    _add_rings(space, _walls(office, closed=closed), "A-WALL")
    _add_rings(space, rooms.difference(office.free), "I-FURN")
    for door in office.doors:
        _add_door(space, door, office, door_layer)
    document.saveas(path)


def _walls(office: FloorPlan, *, closed: bool = False) -> BaseGeometry:
    """Return the walls of an office [m], all as thick as its inner ones, with or without the openings of doors."""
    rooms = shapely.union_all([room.outline for room in office.rooms])
    return rooms.buffer(SMALL.wall_m, join_style="mitre").difference(rooms if closed else rooms.union(office.free))


def _add_rings(space: ezdxf.layouts.Modelspace, area: BaseGeometry, layer: str) -> None:
    for part in shapely.get_parts(area):
        for ring in (part.exterior, *part.interiors):
            corners = [(round(x * 1000), round(y * 1000)) for x, y in shapely.get_coordinates(ring)[:-1]]
            space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})


def _add_door(space: ezdxf.layouts.Modelspace, door: Door, office: FloorPlan, layer: str) -> None:
    """Draw the leaf and its swing of a quarter turn, into the office behind the door."""
    along = _direction(door, office)
    offices = shapely.union_all([room.outline for room in office.rooms if room.label == "office"])
    away = np.array([-along[1], along[0]])
    if not shapely.contains_xy(offices, *(np.array([door.x, door.y]) + 0.5 * away)):
        along = -along  # turned round, the leaf opens to the other side
        away = -away
    hinge = (np.array([door.x, door.y]) - along * door.width / 2) * 1000
    leaf = hinge + away * door.width * 1000
    start = float(np.degrees(np.arctan2(along[1], along[0])))
    attributes = {"layer": layer}
    space.add_line(hinge.tolist(), leaf.tolist(), dxfattribs=attributes)
    space.add_arc(hinge.tolist(), door.width * 1000, start, start + 90, dxfattribs=attributes)


def _direction(door: Door, office: FloorPlan) -> np.ndarray:
    """Return the unit vector along the wall that the door is in."""
    beside = shapely.contains_xy(office.free, [door.x + door.width, door.x], [door.y, door.y + door.width])
    return np.array([0.0, 1.0] if beside[0] else [1.0, 0.0])


def write_scan(path: Path, office: FloorPlan) -> None:
    """Write light walls and desks on dark paper, 5 cm a pixel; the paper ends where the building does."""
    outline = shapely.union_all([room.outline for room in office.rooms]).buffer(SMALL.wall_m, join_style="mitre")
    cells = rasterize(replace(office, bounds=Bounds(*outline.bounds)), 0.05).cells[::-1] == FREE
    Image.fromarray(np.where(cells[..., None], PAPER, CHALK).astype(np.uint8)).save(path)


def write_venue(path: Path, offices: Sequence[FloorPlan]) -> None:
    """Write levels 0, 1, ... with OpenStreetMap's indoor tags, in degrees; doors are points without a width."""
    features = [feature for level, office in enumerate(offices) for feature in _level(office, str(level))]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")


def _level(office: FloorPlan, level: str) -> Iterator[dict[str, object]]:
    half_wall = SMALL.wall_m / 2
    for room in office.rooms:
        kind = {"indoor": "corridor"} if room.label == "hallway" else {"indoor": "room", "room": "office"}
        outline = room.outline.buffer(half_wall, join_style="mitre")  # there rooms touch in the middle of the wall
        yield _feature(outline, {"level": level, **kind})
    for door in office.doors:
        yield _feature(shapely.Point(door.x, door.y), {"level": level, "door": "hinged"})


def _feature(shape: BaseGeometry, properties: dict[str, str]) -> dict[str, object]:
    scale = np.array([METRES_PER_DEGREE * cos(radians(LATITUDE)), METRES_PER_DEGREE])
    degrees = shapely.transform(shape, lambda points: points / scale + (LONGITUDE, LATITUDE))
    return {"type": "Feature", "properties": properties, "geometry": shapely.geometry.mapping(degrees)}


if __name__ == "__main__":
    main()
