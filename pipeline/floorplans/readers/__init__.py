"""Readers of floor plans, one per format, found by name or by a look into the file."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path

from pipeline.errors import PlanError
from pipeline.floorplans.manifest import PATTERN, Manifest, find_manifest
from pipeline.floorplans.paper import without_paper
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.amrl_vector_maps import AmrlVectorMaps
from pipeline.floorplans.readers.asked import read_as_asked, say_unused
from pipeline.floorplans.readers.dxf import Dxf
from pipeline.floorplans.readers.foreign import look_of, sentence_of
from pipeline.floorplans.readers.houseexpo import HouseExpo
from pipeline.floorplans.readers.ifc import Ifc
from pipeline.floorplans.readers.imdf import Imdf
from pipeline.floorplans.readers.indoor_geojson import IndoorGeoJson
from pipeline.floorplans.readers.kth_campus_grids import KthCampusGrids
from pipeline.floorplans.readers.luperto import Luperto
from pipeline.floorplans.readers.malls_geojson import MallsGeoJson
from pipeline.floorplans.readers.map_pictures import YAML_ENDINGS, pictures_named_by
from pipeline.floorplans.readers.mit_campus_grids import MitCampusGrids
from pipeline.floorplans.readers.mlstruct import MlStruct
from pipeline.floorplans.readers.moving_ai import MovingAi
from pipeline.floorplans.readers.plan_geojson import PlanGeoJson
from pipeline.floorplans.readers.raster_picture import RasterPicture
from pipeline.floorplans.readers.reader import Reader, ReadOptions
from pipeline.floorplans.readers.resplan import ResPlan
from pipeline.floorplans.readers.ros_map_server import RosMapServer
from pipeline.floorplans.readers.svg import Svg
from pipeline.floorplans.readers.valetudo import Valetudo
from pipeline.floorplans.readers.wrld import Wrld
from pipeline.floorplans.sources import SourceFile, lone_file

__all__ = [
    "BAD",
    "COMPANION",
    "PLAN",
    "READERS",
    "UNRECOGNISED",
    "Classified",
    "ReadOptions",
    "Reader",
    "classify",
    "find_plan_files",
    "nothing_found",
    "read_plan_file",
    "read_plans",
    "say_unused",
]

# In the order in which they are asked: narrow formats first, any picture last.
_ALL: tuple[Reader, ...] = (
    MitCampusGrids(),
    KthCampusGrids(),
    RosMapServer(),
    AmrlVectorMaps(),
    MlStruct(),
    ResPlan(),
    Valetudo(),
    PlanGeoJson(),
    MallsGeoJson(),
    Wrld(),
    Imdf(),
    IndoorGeoJson(),
    HouseExpo(),
    Luperto(),
    Dxf(),
    Svg(),
    Ifc(),
    MovingAi(),
    RasterPicture(),
)
READERS: dict[str, Reader] = {reader.name: reader for reader in _ALL}

_MOST_LOOKS = 100  # files that are looked at to say what a folder without a plan holds
_SHOWN = 4

# What a file may be.
PLAN, COMPANION, UNRECOGNISED, BAD = "plan", "companion", "unrecognised", "bad"


@dataclass(frozen=True, kw_only=True)
class Classified:
    """A file and what it is.

    role: PLAN or COMPANION of a format; UNRECOGNISED; BAD for an archive that cannot be unpacked, and for a file whose
    name says that it holds a plan while its content is that of no format. reader: the format. problem: why it is BAD.
    """

    file: SourceFile
    role: str
    reader: Reader | None = None
    problem: PlanError | None = None


def classify(files: Sequence[SourceFile], reader: str | Reader | None = None) -> list[Classified]:
    """Return what each file is, by a look into it. With a named reader, all files whose name fits it are plans.

    Raises:
        PlanError: no such reader.
    """
    named = None if reader is None else _named(reader)
    maps = pictures_named_by(file.path for file in files if file.path.suffix.lower() in YAML_ENDINGS)
    return [_classify(file, named, alone=len(files) == 1, of_maps=maps) for file in files]


def find_plan_files(root: Path, reader: str | Reader | None = None) -> list[Path]:
    """Return the files under ``root`` (a folder or one file) that hold plans, or should by their names; sorted.

    Archives are not looked into: see `pipeline.floorplans.sources.open_source`.

    Raises:
        PlanError: no such folder, or no file in it that fits.
    """
    if not root.exists():
        raise PlanError(f"plans.root = {root}: no such folder or file. Give the folder that holds the plans.")
    if root.is_file():
        return [root]
    files = [lone_file(path) for path in sorted(root.rglob("*")) if path.is_file()]
    classified = classify(files, reader)
    found = [entry.file.path for entry in classified if entry.role in (PLAN, BAD)]
    if not found:
        raise PlanError(nothing_found(root, reader, classified))
    return found


def nothing_found(root: Path, reader: str | Reader | None, found: Sequence[Classified] = ()) -> str:
    """Return the sentence that says why there is no plan below ``root``, where the files ``found`` are."""
    if reader is not None:
        named = _named(reader)
        wanted = " or ".join(named.patterns)
        return f"plans.root = {root}: no {wanted} in this folder, as {named.name} reads. Is it the right one?"
    others = [entry.file for entry in found if entry.role == UNRECOGNISED]
    if not others:
        return f"plans.root = {root}: no floor plan in this folder. Is it the right one?"
    looks = Counter(look_of(file.path) for file in others[:_MOST_LOOKS])
    (look, count), *more = looks.most_common()
    kinds = "; ".join(f"{count} x {look.what}" for look, count in [(look, count), *more][:_SHOWN])
    rest = "; ..." if len(looks) > _SHOWN or len(others) > _MOST_LOOKS else ""
    return f"plans.root = {root}: no floor plan among {len(others)} files: {kinds}{rest}. {look.advice}."


def read_plan_file(
    path: Path, reader: str | Reader | None = None, options: ReadOptions | None = None
) -> list[FloorPlan | GridPlan | PlanError]:
    """Read one file with the named reader, or with the first one that recognises its content.

    A record of the file that is no plan comes back as the error that says why.

    Raises:
        PlanError: no such file, no reader recognises it, or it is damaged.
    """
    if not path.is_file():
        raise PlanError(f"{path}: no such file.")
    readers = [_named(reader)] if reader is not None else [r for r in READERS.values() if r.sniff(path)]
    if not readers:
        raise PlanError(sentence_of(path, path))
    return list(read_plans(replace(lone_file(path), lone=True), readers[0], options))


def read_plans(
    file: SourceFile, reader: Reader, options: ReadOptions | None = None
) -> Iterator[FloorPlan | GridPlan | PlanError]:
    """Yield each plan of a file, with building and split from its manifest, or the error that refuses one record.

    Raises:
        PlanError: the file as a whole is damaged or lacks something.
    """
    given = options or ReadOptions()
    try:
        manifest = find_manifest(file)
        for found in read_as_asked(file.path, reader, given, lone=file.lone):
            yield _finished(found, file, manifest, given)
    except PlanError as problem:
        raise PlanError(file.named_anew(str(problem))) from problem
    except MemoryError as problem:
        raise PlanError(
            f"{file.original}: needs more memory than there is. Give it in parts, or scale it down."
        ) from problem
    except Exception as problem:
        raise PlanError(
            f"{file.original}: the reader {reader.name} failed ({type(problem).__name__}: {str(problem)[:200]}), "
            "which is its fault. Please report it with the file."
        ) from problem


def _finished(
    found: FloorPlan | GridPlan | PlanError, file: SourceFile, manifest: Manifest | None, options: ReadOptions
) -> FloorPlan | GridPlan | PlanError:
    """Return what a reader found as a person knows it: with building, split and source, and without paper."""
    if isinstance(found, PlanError):
        return PlanError(file.named_anew(str(found)))
    said = (manifest.building_of(found.plan_id), manifest.split_of(found.plan_id)) if manifest else (None, None)
    building, split = said[0] or found.building, said[1] or found.split
    plan = replace(found, building=building, split=split, source=file.source_of(found.source))
    if not options.paper or not isinstance(plan, GridPlan):
        return plan
    try:
        return without_paper(plan)
    except PlanError as problem:
        return problem


def _classify(file: SourceFile, named: Reader | None, *, alone: bool, of_maps: frozenset[Path]) -> Classified:
    if file.problem is not None:
        return Classified(file=file, role=BAD, problem=file.problem)
    if fnmatch(file.path.name, PATTERN):
        return Classified(file=file, role=COMPANION)
    if of_maps and file.path.resolve() in of_maps:
        return Classified(file=file, role=COMPANION, reader=READERS["raster_picture"])
    if named is not None and (alone or _fits(file.path, named)):
        return Classified(file=file, role=COMPANION if named.accompanies(file.path) else PLAN, reader=named)
    for reader in READERS.values() if named is None else (named,):
        if reader.accompanies(file.path):
            return Classified(file=file, role=COMPANION, reader=reader)
        if named is None and reader.sniff(file.path):
            return Classified(file=file, role=PLAN, reader=reader)
    if named is None and (alone or any(_fits(file.path, reader) for reader in READERS.values())):
        return Classified(file=file, role=BAD, problem=PlanError(sentence_of(file.original, file.path)))
    return Classified(file=file, role=UNRECOGNISED)


def _fits(path: Path, reader: Reader) -> bool:
    return any(fnmatch(path.name.lower(), pattern.lower()) for pattern in reader.patterns)


def _named(name: str | Reader) -> Reader:
    if not isinstance(name, str):
        return name
    if name not in READERS:
        raise PlanError(f"plans.reader = {name}: no such reader. Choose one of {', '.join(READERS)}, or null.")
    return READERS[name]
