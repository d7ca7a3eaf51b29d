"""Tiny valid files of every format, made here: what the mutations start from."""

import gzip
import io
import itertools
import json
import zipfile
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import NamedTuple

import numpy as np
from PIL import Image

from pipeline.floorplans.readers import ReadOptions

ARCHIVE, MANIFEST = "archive", "manifest"  # fuzzed as the readers are
METRES = ReadOptions(metres_per_unit=1.0)
CENTIMETRES = ReadOptions(metres_per_unit=0.01)
TENTHS = ReadOptions(metres_per_unit=0.1)


class Sample(NamedTuple):
    """Files by name, which of them is read, and what is said about it."""

    files: dict[str, bytes]
    main: str
    options: ReadOptions = ReadOptions()

    @property
    def ending(self) -> str:
        return PurePosixPath(self.main).suffix


def samples_of(reader: str) -> list[Sample]:
    return list(_MAKERS[reader]())


def known_formats() -> set[str]:
    return set(_MAKERS)


def picture_bytes(grey: np.ndarray, kind: str = "PNG", **changes: object) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(grey).save(stream, format=kind, **changes)
    return stream.getvalue()


def npz_bytes(layers: dict[str, np.ndarray], *, packed: bool = True) -> bytes:
    stream = io.BytesIO()
    (np.savez_compressed if packed else np.savez)(stream, **layers)
    return stream.getvalue()


def box(x: float, y: float, wide: float, high: float) -> list[list[float]]:
    """Corners of a closed ring."""
    return [[x, y], [x + wide, y], [x + wide, y + high], [x, y + high], [x, y]]


def _grid() -> np.ndarray:
    """Two rooms of 3 x 2.5 m at 0.1 m per cell, with a doorway; True is a wall."""
    wall = np.zeros((27, 64), dtype=np.bool_)
    wall[[0, -1]] = wall[:, [0, 31, 32, -1]] = True
    wall[10:19, 31:33] = False
    return wall


def _mit() -> Iterator[Sample]:
    wall = _grid()
    semantic = np.where(wall, 0, 3).astype(np.uint8)
    semantic[10:19, 31:33], semantic[3:6, 3:6] = 2, 1
    layers = {
        "occ_grid": wall.astype(np.uint8),
        "semantic_grid": semantic,
        "semantic_labels": np.array(["background", "clutter", "door", "room"]),
        "resolution": np.float64(0.1),
    }
    layers["occ_grid"][3:6, 3:6] = 1
    for packed in (True, False):
        yield Sample({"W1-2_17.npz": npz_bytes(layers, packed=packed)}, "W1-2_17.npz")


def _kth() -> Iterator[Sample]:
    wall = _grid()
    numbers = np.where(wall, 0, 1).astype(np.int32)
    numbers[:, 33:] *= 2
    numbers[10:19, 31:33] = 0
    layers = {"occ_map": np.where(wall, 0, 254).astype(np.uint8), "valid_space": numbers}
    for packed in (True, False):
        yield Sample({"1234_A.npz": npz_bytes(layers, packed=packed)}, "1234_A.npz")


def _ros() -> Iterator[Sample]:
    grey = np.where(_grid(), 0, 254).astype(np.uint8)
    rest = "resolution: 0.1\norigin: [-1.5, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    for picture, kind, more in (("map.pgm", "PPM", ""), ("map.png", "PNG", "mode: scale\n")):
        header = f"image: {picture}\n{rest}{more}".encode()
        yield Sample({"lab/map.yaml": header, f"lab/{picture}": picture_bytes(grey, kind)}, "lab/map.yaml")


def _pictures() -> Iterator[Sample]:
    grey = np.where(_grid(), 0, 254).astype(np.uint8)
    colours = np.stack([grey, grey, grey, np.full_like(grey, 255)], axis=-1)
    for ending, kind, pixels in (
        ("png", "PNG", grey),
        ("png", "PNG", colours),
        ("png", "PNG", grey.astype(np.uint16) * 257),
        ("pgm", "PPM", grey),
        ("jpg", "JPEG", grey),
        ("bmp", "BMP", grey),
        ("gif", "GIF", grey),
    ):
        yield Sample({f"home.{ending}": picture_bytes(pixels, kind)}, f"home.{ending}", TENTHS)
    yield Sample({"plain.pgm": b"P2\n# a floor\n3 2\n255\n254 254 0\n254 0 254\n"}, "plain.pgm", METRES)


def _amrl() -> Iterator[Sample]:
    rings = [box(0, 0, 8, 5), [[4, 0], [4, 2]], [[4, 3], [4, 5]]]
    segments = [
        {"p0": {"x": a[0], "y": a[1]}, "p1": {"x": b[0], "y": b[1]}}
        for ring in rings
        for a, b in itertools.pairwise(ring)
    ]
    yield Sample({"GHC6.vectormap.json": json.dumps(segments).encode()}, "GHC6.vectormap.json")


def _mlstruct() -> Iterator[Sample]:
    bars = [(0, 0, 8, 0.2), (0, 4.8, 8, 0.2), (0, 0, 0.2, 5), (7.8, 0, 0.2, 5), (4, 0, 0.2, 3)]
    content = {
        "floor": {"7": {"image": "7.png", "scale": 0.01}},
        "rect": {str(k): {"wallID": k, "floorID": 7} | _xy(box(*bar)[:4]) for k, bar in enumerate(bars)},
        "slab": {"1": {"floorID": 7} | _xy(box(0, 0, 8, 5)[:4])},
    }
    yield Sample({"fp.json": json.dumps(content).encode()}, "fp.json")
    content["slab"] = {}
    yield Sample({"fp.json": json.dumps(content).encode()}, "fp.json")


def _xy(corners: list[list[float]]) -> dict[str, list[float]]:
    return {"x": [x for x, _ in corners], "y": [y for _, y in corners]}


def wkt(corners: list[list[float]]) -> str:
    return f"POLYGON (({', '.join(f'{x} {y}' for x, y in corners)}))"


def _resplan() -> Iterator[Sample]:
    shapes = {
        "living": [wkt(box(0, 0, 40, 50))],
        "bedroom": [wkt(box(42, 0, 38, 50))],
        "wall": [wkt(box(40, 0, 2, 20)), wkt(box(40, 30, 2, 20))],
        "door": [wkt(box(40, 20, 2, 10))],
        "front_door": [wkt(box(10, -2, 10, 2))],
        "window": [],
    }
    homes = [{"id": 5, "net_area": 39.0, "geometries": shapes}, {"id": 6, "geometries": shapes}]
    yield Sample({"homes.json": json.dumps(homes).encode()}, "homes.json")
    yield Sample({"homes.json": json.dumps(homes[1]).encode()}, "homes.json", TENTHS)


def _valetudo() -> Iterator[Sample]:
    walls = [n for k in range(42) for n in (100 + k, 100, 100 + k, 140)]
    layers = [
        {"__class": "MapLayer", "type": "floor", "pixels": [], "compressedPixels": [101, 101, 40]},
        {"type": "wall", "pixels": walls, "metaData": {}},
        {
            "type": "segment",
            "compressedPixels": [n for y in range(102, 140) for n in (101, y, 40)],
            "metaData": {"segmentId": "16", "name": "Kitchen"},
        },
    ]
    content = {"__class": "ValetudoMap", "metaData": {"version": 2}, "pixelSize": 5, "layers": layers, "entities": []}
    yield Sample({"robot.json": json.dumps(content).encode()}, "robot.json")


def degrees(corners: list[list[float]]) -> list[list[float]]:
    """Metres to degrees near (8, 48)."""
    return [[8 + x * 1.34e-5, 48 + y * 9e-6] for x, y in corners]


def feature(kind: str, corners: list[list[float]], **properties: object) -> dict[str, object]:
    listed = degrees(corners)
    coordinates = {"Polygon": [listed], "LineString": listed, "Point": listed[0]}[kind]
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def collection(features: list[dict[str, object]], **members: object) -> bytes:
    return json.dumps({"type": "FeatureCollection", **members, "features": features}).encode()


def _malls() -> Iterator[Sample]:
    features = [
        feature("Polygon", box(0, 0, 60, 40), two_class="floor", name="F1"),
        feature("Polygon", box(5, 5, 20, 30), two_class="shop", name="Books", category="shop"),
        feature("Polygon", box(35, 5, 20, 30), two_class="shop", name="Shoes", category="shop"),
    ]
    info = {"map_info": {"width": 60.0, "height": 40.0}}
    main = "site1/F1/geojson_map.json"
    yield Sample({main: collection(features), "site1/F1/floor_info.json": json.dumps(info).encode()}, main)


def _wrld() -> Iterator[Sample]:
    features = [
        feature("Polygon", box(0, 0, 20, 10), type="building_outline", id=1),
        feature("Polygon", box(0, 0, 20, 0.3), type="wall"),
        feature("Polygon", box(9.8, 0, 0.3, 10), type="wall"),
        feature("Polygon", box(9.7, 4, 0.5, 1), type="door"),
        feature("Polygon", box(0.3, 0.3, 9.5, 9.4), type="room", name="Hall"),
    ]
    yield Sample({"house-floor1.geojson": collection(features)}, "house-floor1.geojson")


def _indoor() -> Iterator[Sample]:
    features = [
        feature("Polygon", box(0, 0, 8, 6), indoor="room", level="0;1", room="office"),
        feature("Polygon", box(8, 0, 8, 6), indoor="area", level="0-2"),
        feature("LineString", box(0, 6, 16, 2), indoor="corridor", level="0"),
        feature("LineString", [[3, 0], [3, 4]], indoor="wall", level="0"),
        feature("Point", [[8, 3]], door="yes", level="0;1", width="1.2 m"),
        feature("Point", [[4, 6]], entrance="main", level="0"),
        feature("Polygon", box(0, 20, 8, 6), building="yes"),
    ]
    yield Sample({"school.geojson": collection(features)}, "school.geojson")


def _houseexpo() -> Iterator[Sample]:
    house = {
        "id": "c0ffee",
        "verts": [[0, 0], [8, 0], [8, 5], [4.1, 5], [4.1, 3], [4, 3], [4, 5], [0, 5]],
        "room_num": 2,
        "bbox": {"min": [0, 0], "max": [8, 5]},
        "room_category": {"Kitchen": [[0, 0, 4, 5]], "Hall": [[4.1, 0, 8, 5]]},
    }
    text = json.dumps(house).encode()
    yield Sample({"c0ffee.json": text}, "c0ffee.json")
    yield Sample({"houses.jsonl": b"\n".join([text, text.replace(b"c0ffee", b"beef"), b"", text])}, "houses.jsonl")
    yield Sample({"houses.json": b"[%s, %s]" % (text, text)}, "houses.json")


def _luperto() -> Iterator[Sample]:
    def space(number: int, corners: list[list[float]], other: int) -> str:
        points = "".join(f'<point x="{x}" y="{y}"/>' for x, y in corners)
        return (
            f'<space id="s{number}"><labels><label>CLASSROOM</label></labels>'
            f"<bounding_polygon>{points}</bounding_polygon><space_representation>"
            f'<linesegment id="l{number}"><point x="60" y="20"/><point x="60" y="30"/></linesegment>'
            f"</space_representation><portals><portal><linesegment>l{number}</linesegment>"
            f"<target><id>s{number}</id><id>s{other}</id></target><type>EXPLICIT</type><features>DOUBLE</features>"
            "</portal></portals></space>"
        )

    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<building id="b"><name>x</name><scale>'
        "<represented_distance><value>10</value><um>pixel</um></represented_distance>"
        "<real_distance><value>90</value><um>cm</um></real_distance></scale>"
        "<building_type><main_type>SCHOOL</main_type></building_type><floor><spaces>"
        f"{space(1, box(0, 0, 60, 50), 2)}{space(2, box(60, 0, 60, 50), 1)}</spaces></floor></building>"
    )
    yield Sample({"north_P1.xml": text.encode()}, "north_P1.xml")


def _svg() -> Iterator[Sample]:
    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<svg xmlns="http://www.w3.org/2000/svg" width="900" height="600">'
        '<g class="Floor"><g class="Floorplan Floor-1" style="display:none">'
        '<g class="Wall" transform="translate(0 0) scale(1,1)"><polygon points="0,0 800,0 800,20 0,20"/></g>'
        '<g class="Wall"><rect x="0" y="480" width="800" height="20"/></g>'
        '<path class="Wall" d="M0 0 h20 v500 h-20 z"/><line class="wall" x1="790" y1="0" x2="790" y2="500"/>'
        '<g id="Wall-3"><polygon points="400,0 420,0 420,500 400,500"/>'
        '<g class="Door Swing"><polygon points="400,200 420,200 420,290 400,290"/>'
        '<path d="M400 200 q 40 10 50 90 a 90 90 0 0 1 -20 -3 c 1 2 3 4 5 6"/></g></g>'
        '<g class="Space Kitchen"><polygon points="20,20 400,20 400,480 20,480" style="fill:none"/></g>'
        '<circle class="Wall" cx="200" cy="250" r="15"/><use href="#a"/></g></g></svg>'
    )
    yield Sample({"flat.svg": text.encode()}, "flat.svg", CENTIMETRES)
    start, _, rest = text.partition("</g></g></svg>")
    walls_only = start[: start.index('<g class="Space')] + "</g></g></svg>" + rest
    yield Sample({"flat.svg": walls_only.encode()}, "flat.svg", CENTIMETRES)


def _dxf() -> Iterator[Sample]:
    import ezdxf

    document = ezdxf.new("R2010", units=6)
    space = document.modelspace()
    for name in ("A-WALL", "A-DOOR"):
        document.layers.add(name)
    walls = {"layer": "A-WALL"}
    space.add_lwpolyline([(0, 0), (8, 0), (8, 5), (0, 5)], close=True, dxfattribs=walls)
    space.add_line((4, 0), (4, 2), dxfattribs=walls)
    space.add_line((4, 3), (4, 5), dxfattribs=walls)
    space.add_circle((2, 2), 0.3, dxfattribs=walls)
    space.add_spline([(5, 1, 0), (6, 2, 0), (7, 1, 0)], dxfattribs=walls)
    space.add_arc((4, 2), 1.0, 0, 90, dxfattribs={"layer": "A-DOOR"})
    block = document.blocks.new("DOOR-90")
    block.add_arc((0, 0), 0.9, 0, 90)
    block.add_line((0, 0), (0, 0.9))
    space.add_blockref("DOOR-90", (1, 0), dxfattribs={"layer": "A-DOOR", "rotation": 30})
    stream = io.StringIO()
    document.write(stream)
    yield Sample({"plan.dxf": stream.getvalue().encode()}, "plan.dxf")
    packed = io.BytesIO()
    document.write(packed, fmt="bin")
    yield Sample({"plan.dxf": packed.getvalue()}, "plan.dxf")
    old = ezdxf.new("R12")
    old.modelspace().add_polyline2d([(0, 0), (8, 0, 0), (8, 5), (0, 5)], close=True, dxfattribs=walls)
    stream = io.StringIO()
    old.write(stream)
    yield Sample({"old.dxf": stream.getvalue().encode()}, "old.dxf", METRES)


_IFC_HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('ViewDefinition [CoordinationView]'),'2;1');
FILE_NAME('a.ifc','2020-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('IFC4'));
ENDSEC;
DATA;
#1=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);
#2=IFCUNITASSIGNMENT((#1));
#3=IFCCARTESIANPOINT((0.,0.,0.));
#4=IFCDIRECTION((0.,0.,1.));
#5=IFCDIRECTION((1.,0.,0.));
#6=IFCAXIS2PLACEMENT3D(#3,#4,#5);
#7=IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-05,#6,$);
#8=IFCPROJECT('0000000000000000000001',$,'p',$,$,$,$,(#7),#2);
#9=IFCLOCALPLACEMENT($,#6);
#10=IFCBUILDINGSTOREY('0000000000000000000002',$,'Ground',$,$,#9,$,$,.ELEMENT.,0.);
#11=IFCBUILDING('0000000000000000000003',$,'b',$,$,#9,$,$,.ELEMENT.,$,$,$);
#12=IFCRELAGGREGATES('0000000000000000000004',$,$,$,#8,(#11));
#13=IFCRELAGGREGATES('0000000000000000000005',$,$,$,#11,(#10));
"""


def _ifc() -> Iterator[Sample]:
    lines = [_IFC_HEAD]
    bodies = [
        ("IFCWALL", 4, 0.1, 8, 0.2, 3),
        ("IFCWALL", 4, 4.9, 8, 0.2, 3),
        ("IFCWALL", 0.1, 2.5, 0.2, 5, 3),
        ("IFCWALL", 7.9, 2.5, 0.2, 5, 3),
        ("IFCWALL", 4, 2.5, 0.2, 5, 3),
        ("IFCDOOR", 4, 2.5, 0.2, 1, 2.1),
        ("IFCSPACE", 2, 2.5, 3.8, 4.6, 2.5),
    ]
    for k, (kind, x, y, wide, deep, high) in enumerate(bodies):
        n = 100 + 10 * k
        tail = {"IFCWALL": ",$", "IFCDOOR": ",2.1,1.,$,$,$", "IFCSPACE": ",'Office',.ELEMENT.,$,$"}[kind]
        tag = "$" + tail if kind != "IFCSPACE" else tail[1:]
        lines.append(
            f"#{n}=IFCCARTESIANPOINT(({x:.3f},{y:.3f}));\n#{n + 1}=IFCDIRECTION((1.,0.));\n"
            f"#{n + 2}=IFCAXIS2PLACEMENT2D(#{n},#{n + 1});\n"
            f"#{n + 3}=IFCRECTANGLEPROFILEDEF(.AREA.,$,#{n + 2},{wide:.3f},{deep:.3f});\n"
            f"#{n + 4}=IFCEXTRUDEDAREASOLID(#{n + 3},#6,#4,{high:.3f});\n"
            f"#{n + 5}=IFCSHAPEREPRESENTATION(#7,'Body','SweptSolid',(#{n + 4}));\n"
            f"#{n + 6}=IFCPRODUCTDEFINITIONSHAPE($,$,(#{n + 5}));\n"
            f"#{n + 7}={kind}('00000000000000000000{n}',$,'n{k}',$,$,#9,#{n + 6},{tag});\n"
        )
    text = "".join(lines) + "ENDSEC;\nEND-ISO-10303-21;\n"
    yield Sample({"house.ifc": text.encode()}, "house.ifc")


def _moving_ai() -> Iterator[Sample]:
    rows = ["".join("@" if wall else "." for wall in row) for row in _grid()[:, ::2]]
    rows[2] = rows[2][:3] + "STWGO" + rows[2][8:]
    text = f"type octile\nheight {len(rows)}\nwidth {len(rows[0])}\nmap\n" + "\n".join(rows) + "\n"
    yield Sample({"maze/maze.map": text.encode()}, "maze/maze.map", METRES)
    crlf = text.replace("\n", "\r\n").encode()
    yield Sample({"maze/maze.map": crlf}, "maze/maze.map", METRES)


def _imdf() -> Iterator[Sample]:
    def one(
        kind: str, number: int, corners: list[list[float]], shape: str = "Polygon", **more: object
    ) -> dict[str, object]:
        return feature(shape, corners, **more) | {"id": f"{kind}{number}", "feature_type": kind}

    level = {"level_id": "level1"}
    named = {"ordinal": 0, "short_name": {"en": "G"}, "building_ids": ["b1"], "outdoor": False}
    files = {
        "unit": [
            one("unit", 1, box(0, 0, 8, 6), category="room", **level),
            one("unit", 2, box(8, 0, 8, 6), category="walkway", **level),
            one("unit", 3, box(2, 2, 1, 1), category="brick", **level),
        ],
        "level": [one("level", 1, box(0, 0, 16, 6), **named)],
        "opening": [one("opening", 1, [[8, 2], [8, 3.2]], "LineString", category="pedestrian", **level)],
        "fixture": [one("fixture", 1, box(10, 1, 1, 1), **level)],
    }
    main = "mall/unit.geojson"
    yield Sample({f"mall/{kind}.geojson": collection(listed) for kind, listed in files.items()}, main)


def _plan_geojson() -> Iterator[Sample]:
    def one(kind: str, shape: str, coordinates: object, **more: object) -> dict[str, object]:
        geometry = {"type": shape, "coordinates": coordinates}
        return {"type": "Feature", "properties": {"kind": kind, **more}, "geometry": geometry}

    about: dict[str, object] = {
        "version": 1,
        "units": "m",
        "plan_id": "p",
        "building": "b",
        "floor": "f",
        "split": "train",
    }
    about |= {"environment": "e", "remarks": ["one"]}
    hall = one("free", "MultiPolygon", [[box(0, 0, 8, 5), box(3, 3, 1, 1)[::-1]]])
    spots = [one("start", "Point", [1, 1]), one("goal", "Point", [7, 4]), one("door", "Point", [4, 2.5], width=0.9)]
    room = one("room", "Polygon", [box(0, 0, 4, 5)], label="OFFICE")
    geometry = about | {"form": "geometry", "bounds": [0, 0, 8, 5]}
    yield Sample({"plan.geojson": collection([hall, *spots, room], hinterland=geometry)}, "plan.geojson")
    cells = [one("free", "Polygon", [box(0.5, 0.5, 7, 4)]), one("unknown", "Polygon", [box(0, 0, 8, 0.5)])]
    layer = one("layer", "Polygon", [box(0.5, 0.5, 4, 4)], layer="rooms", value=1)
    grid = about | {
        "form": "grid",
        "resolution": 0.5,
        "origin": [0, 0],
        "shape": [10, 16],
        "layers": {"rooms": {"1": "A"}},
    }
    yield Sample({"grid.geojson": collection([*cells, layer], hinterland=grid)}, "grid.geojson")


def zip_bytes(members: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def _archives() -> Iterator[Sample]:
    """Archives of plans whose content says by itself what it is."""
    map_files = next(_ros()).files
    floors = {k: v for sample in (*_mit(), *_kth()) for k, v in sample.files.items()}
    mall = next(_malls()).files
    yield Sample({"maps.zip": zip_bytes(map_files)}, "maps.zip")
    yield Sample({"all.zip": zip_bytes(floors | {"__MACOSX/._x": b"x", "readme.txt": b"hello"})}, "all.zip")
    yield Sample({"malls.zip": zip_bytes(mall)}, "malls.zip")
    yield Sample({"robot.json.gz": gzip.compress(next(_valetudo()).files["robot.json"], mtime=0)}, "robot.json.gz")
    drawing = gzip.compress(next(_svg()).files["flat.svg"], mtime=0)
    yield Sample({"flat.svgz": drawing}, "flat.svgz", CENTIMETRES)


def _manifests() -> Iterator[Sample]:
    table = b"id,file,member,building,floor\nc0ffee,houses.jsonl,,B1,1\n,maps.zip,gates/map.png,B2,\n"
    house = next(_houseexpo()).files["c0ffee.json"]
    yield Sample({"manifest_dev.csv": table, "c0ffee.json": house}, "manifest_dev.csv")


_MAKERS = {
    "mit_campus_grids": _mit,
    "kth_campus_grids": _kth,
    "ros_map_server": _ros,
    "raster_picture": _pictures,
    "amrl_vector_maps": _amrl,
    "mlstruct": _mlstruct,
    "resplan": _resplan,
    "valetudo": _valetudo,
    "malls_geojson": _malls,
    "wrld": _wrld,
    "indoor_geojson": _indoor,
    "houseexpo": _houseexpo,
    "luperto": _luperto,
    "svg": _svg,
    "dxf": _dxf,
    "ifc": _ifc,
    "moving_ai": _moving_ai,
    "imdf": _imdf,
    "plan_geojson": _plan_geojson,
    ARCHIVE: _archives,
    MANIFEST: _manifests,
}
