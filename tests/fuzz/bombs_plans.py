"""Bombs for plans as geometry: coordinates in JSON and XML."""

import json

import numpy as np

from tests.fuzz.bombs_common import DEEP, Bombs, replace_main
from tests.fuzz.sample import (
    Sample,
    box,
    collection,
    feature,
    gathered,
    geometry,
    wkt,
)
from tests.fuzz.seeds import samples_of


def amrl_bombs(sample: Sample) -> Bombs:
    def segments(ends: np.ndarray) -> bytes:
        keys = [{"p0": {"x": a, "y": b}, "p1": {"x": c, "y": d}} for a, b, c, d in ends.reshape(-1, 4).tolist()]
        return json.dumps(keys).encode()

    rng = np.random.default_rng(0)
    yield "a scribble of 2,000 lines", replace_main(sample, segments(rng.uniform(0, 100, (2000, 4))))
    yield (
        "1,000 pieces",
        replace_main(sample, segments(np.tile(rng.uniform(0, 70, (1000, 2)), 2) + rng.uniform(0, 1, (1000, 4)))),
    )
    yield "coordinates of 1e9", replace_main(sample, segments(rng.uniform(-1e9, 1e9, (50, 4))))
    yield "one place", replace_main(sample, segments(np.zeros((1000, 4))))
    yield "1e-300", replace_main(sample, segments(rng.uniform(-1e-300, 1e-300, (50, 4))))


def mlstruct_bombs(sample: Sample) -> Bombs:
    rng = np.random.default_rng(0)

    def rects(corners: np.ndarray, floors: int = 1) -> bytes:
        rect = {str(k): {"floorID": k % floors, "x": c[0], "y": c[1]} for k, c in enumerate(corners.tolist())}
        return json.dumps({"rect": rect, "slab": {}, "floor": {}, "image": 1, "scale": 1}).encode()

    yield "twisted walls", replace_main(sample, rects(rng.uniform(0, 50, (3000, 2, 4))))
    yield "a scribble as wall", replace_main(sample, rects(rng.uniform(0, 50, (1, 2, 9000))))
    yield "500 floors", replace_main(sample, rects(rng.uniform(0, 50, (500, 2, 4)), floors=500))


def resplan_bombs(sample: Sample) -> Bombs:
    rng = np.random.default_rng(0)

    def home(shapes: list[str], kind: str = "living") -> bytes:
        return json.dumps([{"id": 1, "net_area": 50, "geometries": {kind: shapes}}]).encode()

    yield "a scribble as room", replace_main(sample, home([wkt([*rng.uniform(0, 100, (5000, 2)).tolist(), [0, 0]])]))
    yield "deep WKT", replace_main(sample, home(["GEOMETRYCOLLECTION(" * DEEP + ")" * DEEP]))
    yield "deep brackets", replace_main(sample, home(["POLYGON(" + "(" * DEEP]))
    yield "a number of a million digits", replace_main(sample, home([f"POLYGON(({'1' * 1_000_000} 0, 1 1, 0 1, 0 0))"]))
    for text in (
        "POLYGON EMPTY",
        "MULTIPOLYGON EMPTY",
        "POINT(0 0)",
        "POLYGON((0 0, 1 1))",
        "POLYGON((0 0,0 0,0 0,0 0))",
        "POLYGON Z((0 0 1,9 0 1,9 9 NaN,0 0 1))",
        "POLYGON((inf 0, 1 1, 0 1, inf 0))",
        "POLYGON((0 0,1 0,1 1,0 1))",
        "\x00",
        "\ud800",
        "POLYGON((1e308 0, -1e308 1, 0 1, 1e308 0))",
        "CURVEPOLYGON(CIRCULARSTRING(0 0, 4 0, 4 4, 0 4, 0 0))",
        "TRIANGLE((0 0, 1 0, 0 1, 0 0))",
        "POLYGON M((0 0 1,9 0 1,9 9 1,0 0 1))",
    ):
        yield text[:40].encode("ascii", "replace").decode(), replace_main(sample, home([text]))
    yield "20,000 rooms in one place", replace_main(sample, home([wkt(box(0, 0, 5, 5))] * 20_000))
    yield (
        "20,000 doors in one place",
        replace_main(
            sample,
            json.dumps(
                [
                    {
                        "id": 1,
                        "net_area": 50,
                        "geometries": {
                            "living": [wkt(box(0, 0, 9, 9))],
                            "wall": [wkt(box(0, 4, 9, 1))],
                            "door": [wkt(box(0, 4, 1, 1))] * 19_000,
                        },
                    }
                ]
            ).encode(),
        ),
    )
    yield "20,000 homes", replace_main(sample, json.dumps([{"geometries": {}}] * 20_000).encode())
    yield "net area of 1e-300", replace_main(sample, home([wkt(box(0, 0, 9, 9))]).replace(b"50", b"1e-300"))


def features_bombs(sample: Sample) -> Bombs:
    name = sample.main
    tags: dict[str, object] = {
        "indoor": "room",
        "level": "0",
        "two_class": "floor",
        "type": "building_outline",
        "level_id": "level1",
        "category": "room",
    }
    door: dict[str, object] = {"door": "yes", "level": "0", "type": "door", "indoor": "door", "two_class": "shop"}
    rng = np.random.default_rng(0)
    big = feature("Polygon", box(0, 0, 200, 200), **tags)
    scribble = rng.uniform(0, 100, (3000, 2)).tolist()
    yield "a scribble", replace_main(sample, collection([feature("Polygon", [*scribble, scribble[0]], **tags)]))
    circle = [[50 + 50 * np.cos(a), 50 + 50 * np.sin(a)] for a in np.linspace(0, 2 * np.pi, 100_000)]
    yield (
        "a circle of 100,000 corners",
        replace_main(sample, collection([feature("Polygon", [*circle, circle[0]], **tags)])),
    )
    steps = np.repeat(np.arange(2500), 2) * 0.03
    stairs = np.column_stack([np.append(steps[1:], 75.0), steps])
    corridor = [*stairs.tolist(), *np.add(stairs[::-1], (-3, 4)).tolist()]
    yield "a staircase", replace_main(sample, collection([feature("Polygon", [*corridor, corridor[0]], **tags)]))
    cells = [feature("Polygon", box(k % 100 * 2, k // 100 * 2, 2, 2), **tags) for k in range(300)]
    doors = [feature("Point", [[k % 100 * 2, k // 100 * 2 + 1.0]], **door) for k in range(300)]
    yield "300 rooms", replace_main(sample, collection(cells))
    yield "300 rooms and doors", replace_main(sample, collection(cells + doors))
    yield "200 rooms in one place", replace_main(sample, collection([big] * 200))
    many = [feature("Point", rng.uniform(0, 200, (1, 2)).tolist(), **door) for _ in range(1000)]
    yield "1,000 doors", replace_main(sample, collection([big, *cells[:50], *many]))
    yield from _parts_bombs(sample, tags, door)
    yield "100,001 features", replace_main(sample, collection([{"type": "Feature"}] * 100_001))
    yield (
        "levels",
        replace_main(
            sample,
            collection([big | {"properties": tags | {"level": ";".join(f"{k}-{k + 199}" for k in range(50))}}] * 5),
        ),
    )
    yield (
        "a long list of levels",
        replace_main(sample, collection([big | {"properties": tags | {"level": "0;" * 1_000_000}}])),
    )
    for place in (90, 180, 181, 1e10, -85, 84.9999):
        moved = json.loads(json.dumps(big).replace("8.0, 48.0", f"{place}, {place}"))
        yield f"a corner at {place}", replace_main(sample, collection([moved]))
    if "geojson_map" in name:
        for info in (
            b"",
            b"[]",
            b'{"map_info": {"width": "x"}}',
            b"[" * DEEP,
            b'{"map_info": {"width": 1e999, "height": 1}}',
        ):
            files = sample.files | {name.replace("geojson_map", "floor_info"): info}
            yield f"size {info[:20]!r}", Sample(files, name)


def _parts_bombs(sample: Sample, tags: dict[str, object], door: dict[str, object]) -> Bombs:
    """Shapes of many parts, and features that say where they stand only by their place."""
    rng = np.random.default_rng(0)
    big = feature("Polygon", box(0, 0, 200, 200), **tags)
    cells = [feature("Polygon", box(k % 100 * 2, k // 100 * 2, 2, 2), **tags) for k in range(300)]
    for many_parts in ("MultiPoint", "MultiLineString"):
        spots = rng.uniform(0, 200, (9000, 2)).tolist()
        parts = feature(many_parts, spots, **door)
        yield f"{many_parts} of 9,000 corners", replace_main(sample, collection([big, *cells, parts]))
    lines = [geometry("LineString", rng.uniform(0, 200, (2, 2)).tolist()) for _ in range(3000)]
    yield "3,000 lines in a wall", replace_main(sample, collection([big, gathered(*lines, indoor="wall", type="wall")]))
    yield "3,000 lines in a room", replace_main(sample, collection([big, gathered(*lines, **tags)]))
    deep = geometry("Point", [[1, 1]])
    for _ in range(300):
        deep = {"type": "GeometryCollection", "geometries": [deep]}
    yield (
        "deep collections",
        replace_main(sample, collection([big, {"type": "Feature", "properties": door, "geometry": deep}])),
    )
    many = [feature("Point", rng.uniform(0, 200, (1, 2)).tolist()) for _ in range(1300)]
    unsaid = [each | {"properties": {"door": "yes"}} for each in many]
    yield "1,300 doors without a level", replace_main(sample, collection([big, *cells, *unsaid]))
    indoors = [each | {"properties": {"indoor": "yes", "level": "0"}} for each in [big] * 200 + cells]
    yield "500 areas indoors", replace_main(sample, collection([big, *cells, *indoors]))
    yield "500 areas indoors alone", replace_main(sample, collection(indoors))


def imdf_bombs(sample: Sample) -> Bombs:
    yield from features_bombs(sample)
    levels = sample.files["mall/level.geojson"].decode()
    for ordinal in ("NaN", "1e308", '"0"', "null", "9" * 400):
        other = {"mall/level.geojson": levels.replace('"ordinal": 0', f'"ordinal": {ordinal}').encode()}
        yield f"ordinal {ordinal[:9]}", Sample(sample.files | other, sample.main)
    for kind in ("level", "opening", "fixture"):
        for content in (b"", b"{}", b"[" * DEEP, collection([])):
            yield (
                f"{kind} {content[:20]!r} x {len(content)}",
                Sample(sample.files | {f"mall/{kind}.geojson": content}, sample.main),
            )
    line = feature("LineString", [[8, 2], [8, 3.2]], level_id="level1")
    many = {"mall/opening.geojson": collection([line] * 5000)}
    yield "5,000 openings in one place", Sample(sample.files | many, sample.main)


def plan_geojson_bombs(sample: Sample) -> Bombs:
    text = samples_of("plan_geojson")[1].files["grid.geojson"].decode()
    for shape in (
        "[40000, 40000]",
        "[1e9, 1e9]",
        "[0, 5]",
        "[-3, -4]",
        "[1.5, 2.5]",
        "[6000, 6000]",
        '["a", 1]',
        "[1e-300, 1]",
    ):
        yield f"a grid of {shape}", replace_main(sample, text.replace("[10, 16]", shape).encode())
    for size in ("0", "-1", "1e-300", "1e300", "NaN"):
        yield (
            f"cells of {size} m",
            replace_main(sample, text.replace('"resolution": 0.5', f'"resolution": {size}').encode()),
        )
    yield "far away", replace_main(sample, text.replace('"origin": [0, 0]', '"origin": [1e10, -1e10]').encode())
    yield (
        "1,000 layers of 4 million cells",
        replace_main(
            sample,
            text.replace("[10, 16]", "[2000, 2000]")
            .replace('{"rooms"', "{" + "".join(f'"l{k}": {{}}, ' for k in range(1000)) + '"rooms"')
            .encode(),
        ),
    )
    rng = np.random.default_rng(0)
    scribble = [*rng.integers(0, 40, (3000, 2)).tolist(), [0, 0]]
    text = sample.files[sample.main].decode()
    yield (
        "a scribble",
        replace_main(sample, text.replace(json.dumps([box(0, 0, 4, 5)]), json.dumps([[[0, 0], *scribble]])).encode()),
    )
    circle = [[4 + np.cos(a), 2 + np.sin(a)] for a in np.linspace(0, 2 * np.pi, 100_000)]
    yield (
        "a room of 100,000 corners",
        replace_main(sample, text.replace(json.dumps([box(0, 0, 4, 5)]), json.dumps([[*circle, circle[0]]])).encode()),
    )


def houseexpo_bombs(sample: Sample) -> Bombs:
    rng = np.random.default_rng(0)

    def house(verts: list[list[float]], **more: object) -> bytes:
        return json.dumps({"id": "h", "verts": verts, **more}).encode()

    yield "a scribble", replace_main(sample, house(rng.uniform(0, 50, (40_000, 2)).tolist()))
    yield "a scribble of 500", replace_main(sample, house(rng.uniform(0, 50, (500, 2)).tolist()))
    comb = [[x / 100, y] for k in range(10_000) for x, y in ((2 * k, 0), (2 * k, 50), (2 * k + 1, 50), (2 * k + 1, 0))]
    yield "a comb", replace_main(sample, house([*comb, [200, -5], [0, -5]]))
    spiral = [[a * np.cos(a) / 10, a * np.sin(a) / 10] for a in np.linspace(0, 300, 20_000)]
    yield "a spiral", replace_main(sample, house([*spiral, *([x * 1.001, y * 1.001] for x, y in spiral[::-1])]))
    yield "boxes", replace_main(sample, house(box(0, 0, 9, 9), room_category={"a": [[0, 0, 1, 1]] * 9999}))
    line = house(box(0, 0, 9, 9)) + b"\n"
    lines = Sample({"many.jsonl": line * 500}, "many.jsonl")
    yield "500 houses", lines
    yield "100,000 bad lines", Sample({"many.jsonl": b"{]\n" * 100_000}, "many.jsonl")
    yield "a line of 9 MB", Sample({"many.jsonl": b'{"verts": [[' + b"0," * 4_500_000 + b"\n" + line}, "many.jsonl")


def luperto_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    start, end = text.index("<space "), text.index("</space>") + len("</space>")
    space = text[start:end]
    yield (
        "500 spaces",
        replace_main(sample, text.replace(space, "".join(space.replace("s1", f"s{k}") for k in range(500))).encode()),
    )
    portal = space[space.index("<portal>") : space.index("</portals>")]
    yield "50,000 portals", replace_main(sample, text.replace(portal, portal * 50_000).encode())
    yield (
        "scattered portals",
        replace_main(
            sample,
            text.replace(portal, "".join(portal.replace("l1", f"l{k}x") for k in range(10_000)))
            .replace(
                "<linesegment id",
                "".join(
                    f'<linesegment id="l{k}x"><point x="60" y="{20 + k / 500}"/></linesegment>' for k in range(10_000)
                )
                + "<linesegment id",
                1,
            )
            .encode(),
        ),
    )
    for pixels in ("1e-300", "1e300", "0", "-1", "nan"):
        yield f"scale {pixels}", replace_main(sample, text.replace("<value>10<", f"<value>{pixels}<").encode())
