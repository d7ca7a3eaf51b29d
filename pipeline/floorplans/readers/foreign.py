"""What a file that no reader takes looks like, why that is so, and what to do about it.

The kind is told by the first bytes (signatures as in the formats' own specifications and in the database of file(1)),
by the names within a zip file, or, of text, by its root element, its keys or its first line: see `foreign_text`.
"""

import re
import struct
import zipfile
import zlib
from pathlib import Path
from typing import NamedTuple

from pipeline.floorplans.readers.foreign_text import ANY, look_of_text
from pipeline.floorplans.readers.json_file import short_text

_HEAD_BYTES = 1 << 16
_SHOWN = 8  # names of arrays, bytes of a beginning

_PICTURE = "Convert it to PNG and give its scale: plans.read.metres_per_unit=0.05"
_GIS = "Export it as GeoJSON: ogr2ogr -f GeoJSON floor.geojson FILE, with indoor and level tags on its rooms"
_SOLID = "Cut it about 1 m above the floor and save the cut as DXF or SVG, or as a picture with its scale"
_ROBOT = "Play it into a mapper and save the map (ros2 run nav2_map_server map_saver_cli), then give its YAML"
_CAD = "Open it in the program that wrote it and save the floor as DXF or IFC"
_DWG = (
    "Save it as DXF: in the program that wrote it, with `dwg2dxf floor.dwg` of LibreDWG, or with the free ODA File "
    "Converter"
)
_PDF = (
    "Where its lines are vectors make an SVG: `pdftocairo -svg floor.pdf floor.svg`, or Inkscape, where walls "
    "and doors get layers; else a picture: `pdftoppm -png -r 200 floor.pdf floor`. Give the scale of either: "
    "plans.read.metres_per_unit"
)
_OSM = "Turn it into GeoJSON with all tags: `osmium export floor.osm.pbf -o floor.geojson`"
_OFFICE = "Save the drawing or picture in it as SVG, DXF or PNG and give that"
_SAVE_XYZ = "Save it as text or as a picture in PNG"

# Offset, bytes, what it is, what to do.
_SIGNATURES: tuple[tuple[int, bytes, str, str], ...] = (
    (0, b"%PDF-", "a PDF document", _PDF),
    (0, b"%!PS", "a PostScript document", "Turn it into PDF (`ps2pdf`), and that into SVG with `pdftocairo -svg`"),
    (0, b"\xc5\xd0\xd3\xc6", "a PostScript document", "Turn it into SVG with Inkscape, or into a picture"),
    (0, b"(DWF V", "a DWF file, a drawing for viewing", _CAD),
    (0, b"\x08\x09\xfe\x02", "a MicroStation drawing (DGN)", "Save it as DXF in the program that wrote it"),
    (0, b"\xff\xfe\xff\x0eS\x00k\x00e\x00t\x00c\x00h\x00U\x00p", "a SketchUp model", _CAD),
    (0, b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a compound file of Microsoft (Word, Excel, Visio, Revit, DGN)", _CAD),
    (0, b"{\\rtf", "a text document (RTF)", _OFFICE),
    (0, b"BLENDER", "a Blender scene", _SOLID),
    (0, b"glTF", "a 3D scene (glTF)", _SOLID),
    (0, b"Kaydara FBX", "a 3D scene (FBX)", _SOLID),
    (0, b"ply\n", "a 3D mesh or point cloud (PLY)", _SOLID),
    (0, b"ply\r\n", "a 3D mesh or point cloud (PLY)", _SOLID),
    (0, b"# .PCD", "a point cloud (PCD)", _SOLID),
    (0, b"LASF", "a point cloud (LAS, LAZ)", _SOLID),
    (0, b"ASTM-E57", "a laser scan (E57)", _SOLID),
    (0, b"# Octomap OcTree", "a 3D map (OctoMap)", _SOLID),
    (0, b"#ROSBAG", "a recording (ROS bag)", _ROBOT),
    (0, b"\x89MCAP", "a recording (MCAP)", _ROBOT),
    (0, b"\xdb\x01\xf5\x5b\x1f\x1d\x7b\x7b", "a state of the mapper Cartographer", _ROBOT),
    (4, b"\x0a\x09OSMHeader", "raw OpenStreetMap data (PBF)", _OSM),
    (0, b"SQLite format 3\x00", "an SQLite database, such as a GeoPackage or a recording of ROS 2", _GIS),
    (0, b"\x00\x00\x27\x0a", "a shapefile", _GIS),
    (0, b"fgb\x03", "a FlatGeobuf file", _GIS),
    (0, b"PAR1", "a Parquet table", _GIS),
    (0, b"8BPS", "a Photoshop picture", _PICTURE),
    (0, b"gimp xcf", "a GIMP picture", _PICTURE),
    (0, b"AT&TFORM", "a DjVu document", _PICTURE),
    (0, b"\x00\x00\x00\x0cjP  ", "a JPEG 2000 picture", _PICTURE),
    (0, b"\x00\x00\x01\x00", "an icon", _PICTURE),
    (4, b"ftypheic", "a HEIC picture", _PICTURE),
    (4, b"ftypmif1", "a HEIF picture", _PICTURE),
    (4, b"ftypavif", "an AVIF picture", _PICTURE),
    (4, b"ftyp", "a film", "Give a plan instead"),
    (8, b"WEBP", "a WebP picture", _PICTURE),
    (0, b"\x89PNG", "the beginning of a PNG picture", "Get the file again"),
    (0, b"\xff\xd8\xff", "the beginning of a JPEG picture", "Get the file again"),
    (0, b"\x89HDF\r\n", "an HDF5 file", _SAVE_XYZ),
    (0, b"MATLAB 5.0", "a MATLAB file", _SAVE_XYZ),
    (0, b"\x93NUMPY", "a single array of NumPy", "Save it as a picture in PNG (white is free) and give its scale"),
    (0, b"\x7fELF", "a program", "Give a plan instead"),
    (0, b"MZ", "a program", "Give a plan instead"),
)
_DWG_VERSIONS = {
    b"AC1012": "R13", b"AC1014": "R14", b"AC1015": "2000", b"AC1018": "2004", b"AC1021": "2007", b"AC1024": "2010",
    b"AC1027": "2013", b"AC1032": "2018",
}  # fmt: skip
_PICKLE = re.compile(rb"\x80[\x02-\x05]")
# The first name in a zip file that begins so tells what it is.
_IN_ZIP = (
    ("word/", "a Word document", _OFFICE),
    ("xl/", "an Excel table", _OFFICE),
    ("ppt/", "a PowerPoint presentation", _OFFICE),
    ("visio/", "a Visio drawing", "Save it as SVG or DXF in Visio and give that"),
    ("META-INF/manifest.xml", "a document of OpenOffice or LibreOffice", _OFFICE),
    ("META-INF/MANIFEST.MF", "a Java archive", "Give a plan instead"),
    ("dwf/", "a DWFx file, a drawing for viewing", _CAD),
)


class Look(NamedTuple):
    """What a file is, such as "a PDF document", and what to do with it, as one or more sentences without a stop."""

    what: str
    advice: str


def look_of(path: Path) -> Look:
    """Return what a file that no reader takes is; never raises."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
        size = path.stat().st_size
    except (OSError, ValueError) as problem:
        return Look(f"cannot be opened ({getattr(problem, 'strerror', None) or problem})", "Check its rights")
    if not head.strip(b" \t\r\n\x00"):
        empty = (
            "an empty file" if not head else f"a file of {size:,} bytes that begins with nothing but blanks or zeros"
        )
        return Look(empty, "Get the file again")
    if version := re.match(rb"AC10\d\d|AC1\.\d|AC2\.\d", head):
        name = _DWG_VERSIONS.get(version[0])
        return Look(f"a drawing of AutoCAD{f' {name}' if name else ''} (DWG)", _DWG)
    if head.startswith(b"PK"):
        return _look_of_zip(path)
    for offset, signature, what, advice in _SIGNATURES:
        if head.startswith(signature, offset):
            return Look(what, advice)
    if _PICKLE.match(head):
        return Look("a pickle of Python, which could run programs", "Save what is in it as GeoJSON, npz or a picture")
    return _look_of_rest(path, head)


def sentence_of(shown: Path, path: Path) -> str:
    """Return the sentence that refuses ``path``, which a person knows as ``shown``."""
    look = look_of(path)
    return f"{shown}: {look.what}, which is not read. {look.advice}."


def _look_of_rest(path: Path, head: bytes) -> Look:
    for encoding in ("utf-8-sig", "utf-16") if head[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig",):
        try:
            # A letter may be cut where the beginning ends.
            text = head.decode(encoding, errors="strict" if len(head) < _HEAD_BYTES else "ignore")
        except (UnicodeDecodeError, ValueError):
            continue
        if "\x00" not in text:
            return Look(*look_of_text(path, text))
    letters = sum(byte >= 32 or byte in b"\t\r\n" for byte in head)
    if b"\x00" not in head and letters > 0.95 * len(head):
        what, advice = look_of_text(path, head.decode("latin-1"))
        return Look(f"{what}, not in UTF-8", advice)
    start = head[:_SHOWN].hex(" ")
    return Look(f"binary data of no known kind (it begins with {start})", ANY)


def _look_of_zip(path: Path) -> Look:
    try:
        with zipfile.ZipFile(path) as archive:
            names = [name for name in archive.namelist() if not name.endswith("/")]
    except (OSError, ValueError, RuntimeError, NotImplementedError, zipfile.BadZipFile, zlib.error, struct.error):
        return Look("a zip file that is damaged or breaks off", "Get the file again")
    for start, what, advice in _IN_ZIP:
        if any(name.startswith(start) for name in names):
            return Look(what, advice)
    if names and all(name.endswith(".npy") for name in names):
        arrays = ", ".join(short_text(name.removesuffix(".npy")) for name in names[:_SHOWN])
        more = ", ..." if len(names) > _SHOWN else ""
        return Look(
            f"an npz with the arrays {arrays}{more}, those of no known format",
            "Save the grid as a picture in PNG (white is free) and give its scale",
        )
    return Look(f"a zip file of {len(names):,} files, none of them a plan", ANY)
