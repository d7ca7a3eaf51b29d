"""Tiny valid files of every format, made here: what the mutations start from."""

import gzip
import json
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np

from tests.fuzz.sample import (
    ARCHIVE,
    CENTIMETRES,
    MANIFEST,
    METRES,
    TENTHS,
    Sample,
    box,
    collection,
    feature,
    gathered,
    geometry,
    npz_bytes,
    picture_bytes,
    wkt,
    zip_bytes,
)
from tests.fuzz.seeds_drawings import dxf_samples, ifc_samples, luperto_samples, svg_samples


@cache
def samples_of(reader: str) -> tuple[Sample, ...]:
    return tuple(_MAKERS[reader]())


def known_formats() -> set[str]:
    return set(_MAKERS)


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
        ("tif", "TIFF", grey),
    ):
        yield Sample({f"home.{ending}": picture_bytes(pixels, kind)}, f"home.{ending}", TENTHS)
    on_paper = np.pad(grey, 15, constant_values=255)
    yield Sample({"home.png": picture_bytes(on_paper)}, "home.png", replace(TENTHS, paper=True))
    yield Sample({"home.tiff": picture_bytes(grey, "TIFF", big_tiff=True)}, "home.tiff", TENTHS)
    yield Sample({"plain.pgm": b"P2\n# a floor\n3 2\n255\n254 254 0\n254 0 254\n"}, "plain.pgm", METRES)


def _amrl() -> Iterator[Sample]:
    rings = [box(0, 0, 8, 5), [[4, 0], [4, 2]], [[4, 3], [4, 5]]]
    segments = [
        {"p0": {"x": a[0], "y": a[1]}, "p1": {"x": b[0], "y": b[1]}} for ring in rings for a, b in pairwise(ring)
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


def _malls() -> Iterator[Sample]:
    features = [
        feature("Polygon", box(0, 0, 60, 40), two_class="floor", name="F1"),
        feature("Polygon", box(5, 5, 20, 30), two_class="shop", name="Books", category="shop"),
        feature("Polygon", box(35, 5, 20, 30), two_class="shop", name="Shoes", category="shop"),
    ]
    info = {"map_info": {"width": 60.0, "height": 40.0}}
    main = "site1/F1/geojson_map.json"
    yield Sample({main: collection(features), "site1/F1/floor_info.json": json.dumps(info).encode()}, main)
    features += [
        gathered(geometry("MultiPolygon", box(25, 5, 5, 5)), geometry("Point", [[1, 1]]), category="shop"),
        feature("MultiPoint", [[2, 2], [3, 4]], category="sign"),
    ]
    yield Sample({main: collection(features)}, main)


def _wrld() -> Iterator[Sample]:
    features = [
        feature("Polygon", box(0, 0, 20, 10), type="building_outline", id=1),
        feature("Polygon", box(0, 0, 20, 0.3), type="wall"),
        feature("Polygon", box(9.8, 0, 0.3, 10), type="wall"),
        feature("Polygon", box(9.7, 4, 0.5, 1), type="door"),
        feature("Polygon", box(0.3, 0.3, 9.5, 9.4), type="room", name="Hall"),
    ]
    yield Sample({"house-floor1.geojson": collection(features)}, "house-floor1.geojson")
    features += [
        feature("MultiLineString", [[0, 7], [9, 7], [9, 9]], type="wall"),
        feature("LineString", [[4, 7], [5, 7]], type="door"),
        gathered(geometry("Polygon", box(12, 0, 0.2, 4)), geometry("LineString", [[12, 4], [12, 7]]), type="wall"),
        feature("MultiPoint", [[2, 2], [3, 4]], type="door"),
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
    yield Sample({"school.geojson": collection([*features, *_indoor_in_the_wild()])}, "school.geojson")


def _indoor_in_the_wild() -> Iterator[dict[str, object]]:
    """Features as people and other tools write them."""
    nested = {"type": "way", "id": 7, "tags": {"indoor": "room", "level": "0,5;+1;\u22122;3-2"}, "meta": {}}
    yield feature("Polygon", box(16, 0, 5, 6), **nested)
    yield feature("MultiPolygon", box(16, 6, 5, 3), other_tags='"indoor"=>"area","level"=>"0","repeat_on"=>"B1"')
    yield gathered(
        gathered(geometry("MultiLineString", [[1, 1], [2, 4]]))["geometry"],  # type: ignore[arg-type]
        geometry("Polygon", box(5, 1, 1, 1)),
        indoor="wall",
    )
    yield feature("LineString", [[8, 1], [8, 2.4]], door="sliding", width="90 cm")
    yield feature("MultiPoint", [[16, 2], [16, 5]], indoor="door", width="2'8\"")
    yield feature("Polygon", box(15.9, 3, 0.2, 1.1), indoor="door", level="EG")
    yield feature("Polygon", box(30, 0, 4, 4), indoor="yes", level="0")
    yield feature("Point", [[16, 1]], door="yes", level="0", width="1,2")


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
    shape = gathered(geometry("Polygon", box(0, 6, 8, 3)), geometry("Point", [[1, 7]]))
    files["unit"] += [shape | {"id": "unit4", "feature_type": "unit", "properties": {"category": "room", **level}}]
    files["opening"] += [
        one("opening", 2, [[2, 6], [3, 6], [4, 6]], "MultiLineString", **level),
        one("opening", 3, [[6, 6]], "MultiPoint", **level),
        one("opening", 4, [[6, 0]], "Point", level_id="level9"),
    ]
    yield Sample({f"mall/{kind}.geojson": collection(listed) for kind, listed in files.items()}, main)


def _plan_geojson() -> Iterator[Sample]:
    def one(kind: str, shape: str, coordinates: object, **more: object) -> dict[str, object]:
        drawn = {"type": shape, "coordinates": coordinates}
        return {"type": "Feature", "properties": {"kind": kind, **more}, "geometry": drawn}

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
    about_floor = about | {"form": "geometry", "bounds": [0, 0, 8, 5]}
    yield Sample({"plan.geojson": collection([hall, *spots, room], hinterland=about_floor)}, "plan.geojson")
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
    doors = one("door", "MultiPoint", [[4, 2.5], [4, 4.5]], width=0.8)
    parts = [{"type": "Polygon", "coordinates": [box(0, 0, 4, 5)]}, {"type": "Point", "coordinates": [1, 1]}]
    mixed = {"type": "GeometryCollection", "geometries": parts}
    edited = [hall, doors, room | {"geometry": mixed}, one("note", "LineString", [[0, 0], [1, 2]])]
    yield Sample({"plan.geojson": collection(edited, hinterland=about_floor)}, "plan.geojson")


def _archives() -> Iterator[Sample]:
    """Archives of plans whose content says by itself what it is."""
    map_files = next(_ros()).files
    floors = {k: v for sample in (*_mit(), *_kth()) for k, v in sample.files.items()}
    mall = next(_malls()).files
    yield Sample({"maps.zip": zip_bytes(map_files)}, "maps.zip")
    yield Sample({"all.zip": zip_bytes(floors | {"__MACOSX/._x": b"x", "readme.txt": b"hello"})}, "all.zip")
    yield Sample({"malls.zip": zip_bytes(mall)}, "malls.zip")
    table = b"file,member,building\nW1-2_17.npz,,MIT-WALKER\n1234_A.npz,,KTH\n"
    yield Sample({"said.zip": zip_bytes(floors | {"manifest.csv": table})}, "said.zip")
    yield Sample({"robot.json.gz": gzip.compress(next(_valetudo()).files["robot.json"], mtime=0)}, "robot.json.gz")
    drawing = gzip.compress(next(svg_samples()).files["flat.svg"], mtime=0)
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
    "luperto": luperto_samples,
    "svg": svg_samples,
    "dxf": dxf_samples,
    "ifc": ifc_samples,
    "moving_ai": _moving_ai,
    "imdf": _imdf,
    "plan_geojson": _plan_geojson,
    ARCHIVE: _archives,
    MANIFEST: _manifests,
}
