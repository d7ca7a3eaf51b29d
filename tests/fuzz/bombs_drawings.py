"""Bombs for drawings and models: SVG, DXF, IFC."""

from collections.abc import Callable, Iterator

import numpy as np

from tests.fuzz.bombs_common import DEEP, Bombs, replace_main
from tests.fuzz.sample import (
    Sample,
)


def svg_bombs(sample: Sample) -> Bombs:
    def body(inner: str) -> Sample:
        return replace_main(sample, f'<svg xmlns="http://www.w3.org/2000/svg">{inner}</svg>'.encode())

    rng = np.random.default_rng(0)
    scribble = " ".join(f"{x},{y}" for x, y in rng.uniform(0, 5000, (3000, 2)).tolist())
    yield "a scribble", body(f'<polygon class="Wall" points="{scribble}"/>')
    yield "a scribbled line", body(f'<polyline class="Wall" fill="none" points="{scribble}"/>')
    yield "a long path", body(f'<path class="Wall" d="M0 0{" l 1 1" * 50_000}"/>')
    yield "a path of a million letters", body(f'<path class="Wall" d="{"M" * 1_000_000}"/>')
    yield "a path of digits", body(f'<path class="Wall" d="M{"1" * 1_000_000}"/>')
    yield "path in path", body(f'<path class="Wall" d="{"M0 0h9v9h-9z" * 5000}"/>')
    yield "spread path in path", body(f'<path class="Wall" d="{"".join(f"M{k} 0h9v9h-9z" for k in range(3000))}"/>')
    yield (
        "1,000 walls",
        body(
            "".join(
                f'<rect class="Wall" x="{k % 300 * 20}" y="{k // 300 * 20}" width="9" height="9"/>' for k in range(1000)
            )
        ),
    )
    yield "arcs", body('<path class="Wall" d="M0 0' + "a 1e300 1e-300 1e300 1 1 1e308 -1e308" * 100 + '"/>')
    yield (
        "many transforms",
        body(f'<g transform="{"rotate(1)" * 50_000}"><rect class="Wall" width="900" height="900"/></g>'),
    )
    yield (
        "unclosed transforms",
        body(f'<g transform="{"(" * 100_000}"><rect class="Wall" width="900" height="900"/></g>'),
    )
    yield (
        "blank transforms",
        body(f'<g transform="rotate({" " * 100_000}x"><rect class="Wall" width="900" height="900"/></g>'),
    )
    yield "long style", body(f'<rect class="Wall" style="{"fill:" * 100_000}" width="900" height="900"/>')
    yield "long classes", body(f'<rect class="{"wall " * 100_000}" width="900" height="900"/>')
    yield "star class", body(f'<rect class="{"a-" * 50_000}" width="900" height="900"/>')
    yield "long space", body(f'<g class="Space {"a" * 1_000_000}"><rect width="900" height="900"/></g>')
    for number in ("1e308", "nan", "inf", "1" * 400, "5%", "1e", "", "5in", "-9"):
        yield (
            f"rect of {number[:9]}",
            body(
                f'<rect class="Wall" x="{number}" y="0" width="{number}" height="{number}" rx="{number}"/>'
                f'<circle class="Wall" r="{number}"/>'
            ),
        )
    deep = '<g class="Wall">' * 99 + '<rect width="900" height="900"/>' + "</g>" * 99
    yield "99 groups", body(deep)
    wall = '<rect class="Wall" width="900" height="900"/>'
    yield from ((name, body(inner)) for name, inner in _svg_style_bombs(wall))
    yield from ((name, body(inner)) for name, inner in _svg_copy_bombs(wall))
    pen = 'class="Wall" fill="none" stroke="#000" stroke-width="50"'
    yield "a scribble with a pen", body(f'<polyline {pen} points="{scribble}"/>')
    yield "a comb with a pen", body(f'<path {pen} d="M0 0{"v900h3v-900h3" * 8000}"/>')
    spots = " ".join(f"M{x:.0f} {y:.0f}h40v40h-40z" for x, y in rng.uniform(0, 900, (20_000, 2)).tolist())
    yield "20,000 squares in a path", body(f'<path class="Wall" d="{spots}"/>')
    grid = "".join(f"M{k} 0v600h1v-600zM0 {k}h600v-1h-600z" for k in range(0, 600, 3))
    yield "a grid in a path", body(f'<path class="Wall" d="{grid}"/>')


def _svg_style_bombs(wall: str) -> Iterator[tuple[str, str]]:
    deep = "<g>" * 95 + wall * 2000 + "</g>" * 95
    for name, selector in (
        ("ancestors", "g " * 60 + "a"),
        ("siblings", "rect ~ " * 60 + "a"),
        ("nots", ":not(" * 20_000),
        ("brackets", "(" * 200_000),
        ("counts", "rect:nth-last-of-type(n)"),
        ("texts", "[class*=a]" * 300),
    ):
        yield f"a sheet of {name}", f"<style>{selector}{{fill:none}}</style>{deep}"
    yield "a sheet of rules", f"<style>{'*{fill:none}' * 3000}</style>{deep}"
    yield "a sheet of classes", f"<style>{''.join(f'.a{k}{{fill:none}}' for k in range(30_000))}</style>{wall}"
    yield "a sheet in sheets", f"<style>{'@media screen{' * 20_000}</style>{wall}"
    yield "a sheet of braces", f"<style>{'a{' * 100_000}</style>{wall}"
    yield "brackets in a style", wall.replace("/>", f' style="fill:{"(" * 200_000}"/>')
    yield "a long colour", wall.replace("/>", f' fill="rgb({"1," * 200_000}"/>')
    yield (
        "an attribute of texts",
        f"<style>{'[class~=a]{fill:none}' * 2000}</style>" + wall.replace("Wall", "Wall " * 200_000),
    )


def _svg_copy_bombs(wall: str) -> Iterator[tuple[str, str]]:
    towers = "".join(f'<g id="t{k}">{f"""<use href="#t{k + 1}"/>""" * 20}</g>' for k in range(20))
    yield "a tower of copies", f'<defs>{towers}<g id="t20">{wall}</g></defs><use href="#t0"/>'
    yield "copies in a circle", f'<g id="a"><use href="#b"/>{wall}</g><g id="b"><use href="#a"/><use href="#a"/></g>'
    yield "copies of the whole", f'<g id="a">{wall}{"""<use href="#a"/>""" * 20_000}</g>'
    crown = " ".join(f"{900 + 800 * np.cos(k / 900):.3f},{900 + 800 * np.sin(k / 900):.3f}" for k in range(5600))
    clip = f'<clipPath id="c"><polygon points="{crown}"/></clipPath>'
    yield "a clip path of corners", clip + f'<g clip-path="url(#c)">{wall}</g>' * 500
    clips = "".join(f'<clipPath id="c{k}"><g clip-path="url(#c{k + 1})">{wall * 3}</g></clipPath>' for k in range(200))
    yield "a chain of clip paths", f'{clips}<g clip-path="url(#c0)">{wall}</g>'
    yield "clip paths in each other", '<g clip-path="url(#c)">' * 90 + wall * 200 + "</g>" * 90 + clip


def dxf_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    newline = "\r\n" if "\r\n" in text else "\n"

    def tags(*pairs: object) -> str:
        return newline.join(str(part) for part in pairs) + newline

    def model(entities: str, blocks: str = "") -> bytes:
        head = tags(0, "SECTION", 2, "HEADER", 9, "$ACADVER", 1, "AC1009", 9, "$INSUNITS", 70, 6, 0, "ENDSEC")
        inner = tags(0, "SECTION", 2, "BLOCKS") + blocks + tags(0, "ENDSEC")
        return (head + inner + tags(0, "SECTION", 2, "ENTITIES") + entities + tags(0, "ENDSEC", 0, "EOF")).encode()

    def block(name: str, *inserts: tuple[object, ...]) -> str:
        content = "".join(tags(0, "INSERT", 8, "WALL", 2, to, 10, x, 20, 0.0, *more) for to, x, *more in inserts)
        line = tags(0, "LINE", 8, "WALL", 10, 0.0, 20, 0.0, 11, 5.0, 21, 5.0)
        return tags(0, "BLOCK", 8, 0, 2, name, 70, 0, 10, 0.0, 20, 0.0) + line + content + tags(0, "ENDBLK", 8, 0)

    def insert(name: str, *more: object) -> str:
        return tags(0, "INSERT", 8, "WALL", 2, name, 10, 0.0, 20, 0.0, *more)

    yield "a block in itself", replace_main(sample, model(insert("A"), block("A", ("A", 1.0))))
    yield (
        "blocks in a circle",
        replace_main(sample, model(insert("A"), block("A", ("B", 1.0)) + block("B", ("A", 1.0), ("A", 2.0)))),
    )
    tower = "".join(block(f"B{k}", *[(f"B{k + 1}", float(x)) for x in range(20)]) for k in range(8)) + block("B8")
    yield "a tower of blocks", replace_main(sample, model(insert("B0"), tower))
    yield (
        "an array of inserts",
        replace_main(sample, model(insert("A", 70, 30_000, 71, 30_000, 44, 1.0, 45, 1.0), block("A"))),
    )
    yield (
        "an array of nothing",
        replace_main(
            sample,
            model(
                insert("A", 70, 30_000, 71, 30_000, 44, 1.0, 45, 1.0),
                tags(0, "BLOCK", 8, 0, 2, "A", 70, 0, 10, 0.0, 20, 0.0, 0, "ENDBLK", 8, 0),
            ),
        ),
    )
    rng = np.random.default_rng(0)
    lines = "".join(
        tags(0, "LINE", 8, "WALL", 10, a, 20, b, 11, c, 21, d) for a, b, c, d in rng.uniform(0, 90, (1500, 4)).tolist()
    )
    yield "a scribble", replace_main(sample, model(lines))
    doors = "".join(
        tags(0, "ARC", 8, "DOOR", 10, x, 20, y, 40, 0.9, 50, 0, 51, 90)
        for x, y in rng.uniform(0, 90, (3000, 2)).tolist()
    )
    yield "3,000 doors", replace_main(sample, model(doors + tags(0, "LINE", 8, "WALL", 10, 0, 20, 0, 11, 90, 21, 90)))
    curves = "".join(
        tags(
            0,
            "SPLINE",
            8,
            "WALL",
            70,
            8,
            71,
            3,
            72,
            8,
            73,
            4,
            *[p for k in (0, 0, 0, 0, 1, 1, 1, 1) for p in (40, k)],
            *[p for k in range(4) for p in (10, k * 1e300, 20, 1e308, 30, 0)],
        )
        for _ in range(20)
    )
    yield "splines to infinity", replace_main(sample, model(curves).replace(b"AC1009", b"AC1015"))
    knots = tags(
        0, "SPLINE", 8, "WALL", 70, 8, 71, 30_000, 72, 2_000_000_000, 73, 4, 40, 0, 40, 1, 10, 0, 20, 0, 10, 5, 20, 5
    )
    yield "a spline of degree 30,000", replace_main(sample, model(knots).replace(b"AC1009", b"AC1015"))
    fit = tags(
        0,
        "SPLINE",
        8,
        "WALL",
        70,
        8,
        71,
        3,
        74,
        2000,
        *[p for k in range(2000) for p in (11, k % 7, 21, k % 11, 31, 0)],
    )
    yield "a spline through 2,000 points", replace_main(sample, model(fit).replace(b"AC1009", b"AC1015"))
    turn = tags(0, "ARC", 8, "WALL", 10, 0, 20, 0, 40, 1e300, 50, -1e300, 51, 1e300) + tags(
        0, "CIRCLE", 8, "WALL", 10, 0, 20, 0, 40, 1e9
    )
    yield "huge arcs", replace_main(sample, model(turn))
    ellipse = tags(0, "ELLIPSE", 8, "WALL", 10, 0, 20, 0, 11, 1e-300, 21, 0, 40, 1e300, 41, 0, 42, 1e9)
    yield "a thin ellipse", replace_main(sample, model(ellipse).replace(b"AC1009", b"AC1015"))
    yield (
        "1,000 lines",
        replace_main(
            sample,
            model(
                "".join(
                    tags(0, "LINE", 8, "WALL", 10, k % 40, 20, k // 40, 11, k % 40 + 0.5, 21, k // 40)
                    for k in range(1000)
                )
            ),
        ),
    )
    yield from _dxf_areas(sample, tags, model)
    yield "long layer", replace_main(sample, model(tags(0, "LINE", 8, "x" * 100_000, 10, 0, 20, 0, 11, 9, 21, 9)))
    yield (
        "odd layers",
        replace_main(
            sample, model("".join(tags(0, "LINE", 8, f"\x1b\u202e{k}", 10, 0, 20, 0, 11, 9, 21, 9) for k in range(30)))
        ),
    )
    yield "a comment without end", replace_main(sample, (tags(999, "x") * 100_000).encode())
    yield "blank lines", replace_main(sample, b"\n" * 1_000_000)
    yield "binary, cut", replace_main(sample, b"AutoCAD Binary DXF\r\n\x1a\x00" + b"\xff" * 1000)


def _dxf_areas(sample: Sample, tags: Callable[..., str], model: Callable[..., bytes]) -> Bombs:
    """Areas, widths and swings that are far too many, too large or cross themselves."""
    rng = np.random.default_rng(1)

    def new(entities: str, blocks: str = "") -> Sample:
        return replace_main(sample, model(entities, blocks).replace(b"AC1009", b"AC1015"))

    def polyline(corners: list[list[float]], layer: str, *more: object) -> str:
        spots = [part for x, y in corners for part in (10, x, 20, y)]
        return tags(0, "LWPOLYLINE", 100, "AcDbEntity", 8, layer, 100, "AcDbPolyline", 90, len(corners), *more, *spots)

    def hatch(rings: list[list[list[float]]]) -> str:
        paths = [
            part
            for ring in rings
            for part in (92, 2, 72, 0, 73, 1, 93, len(ring), *(p for x, y in ring for p in (10, x, 20, y)), 97, 0)
        ]
        head = (
            0,
            "HATCH",
            100,
            "AcDbEntity",
            8,
            "WALL",
            100,
            "AcDbHatch",
            10,
            0.0,
            20,
            0.0,
            30,
            0.0,
            2,
            "SOLID",
            70,
            1,
        )
        return tags(*head, 71, 0, 91, len(rings), *paths, 75, 0, 76, 1, 98, 0)

    scribble = rng.uniform(0, 90, (1500, 2)).tolist()
    yield "a wide scribble", new(polyline(scribble, "WALL", 70, 1, 43, 0.5))
    yield "a long wide line", new(polyline([[k, k % 2] for k in range(5_000)], "WALL", 43, 0.2))
    yield "a line of endless width", new(polyline([[0, 0], [9, 0], [9, 9]], "WALL", 43, 1e308))
    yield "a line of no width", new(polyline([[0, 0], [9, 0], [9, 9]], "WALL", 43, "nan"))
    yield "a scribbled hatch", new(hatch([scribble]))
    box = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    yield "a hatch of 2,500 rings", new(hatch([(box * k).tolist() for k in range(1, 2500)]))
    rows = [box + np.array([k % 50, k // 50]) for k in range(2500)]
    yield "a hatch of 2,500 boxes", new(hatch([(2 * spot + box).tolist() for spot in rows]))
    yield "2,000 hatches", new("".join(hatch([spot.tolist()]) for spot in rows[:2000]))
    turns = np.linspace(0, np.pi / 2, 12)
    swing = np.stack([np.cos(turns), 0.7 * np.sin(turns)], axis=1)
    swings = "".join(polyline((swing + spot).tolist(), "DOOR") for spot in rng.uniform(0, 90, (1500, 2)))
    yield "1,500 chains", new(swings + tags(0, "LINE", 8, "WALL", 10, 0, 20, 0, 11, 90, 21, 90))
    spiral = np.stack([np.cos(np.arange(5000) / 9), np.sin(np.arange(5000) / 9)], axis=1) * np.arange(5000)[:, None]
    yield "a spiral of a door", new(polyline(spiral.tolist(), "DOOR") + polyline(scribble[:9], "WALL"))
    solids = "".join(
        tags(0, "SOLID", 8, "WALL", 10, a, 20, b, 11, c, 21, d, 12, d, 22, a, 13, c, 23, b)
        for a, b, c, d in rng.uniform(0, 90, (1000, 4)).tolist()
    )
    yield "1,000 solids", new(solids)
    elsewhere = "".join(
        tags(0, "BLOCK", 8, 0, 2, f"X{k}", 70, 4, 10, 0.0, 20, 0.0, 1, f"{k}\u202e.dxf", 0, "ENDBLK", 8, 0)
        for k in range(300)
    )
    inserts = "".join(tags(0, "INSERT", 8, "WALL", 2, f"X{k}", 10, 0.0, 20, 0.0) for k in range(400))
    yield "300 external references", new(inserts + polyline([[0, 0], [9, 0], [9, 9]], "WALL", 70, 1), elsewhere)
    kinds = "".join(tags(0, f"KIND{k}", 8, f"WALL {k}") for k in range(1000))
    yield "1,000 kinds", new(kinds + polyline([[0, 0], [9, 0], [9, 9]], "WALL", 70, 1))


def ifc_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()

    def edited(old: str, new: str) -> Sample:
        assert old in text
        return replace_main(sample, text.replace(old, new, 1).encode())

    yield "placement in itself", edited("#9=IFCLOCALPLACEMENT($,#6)", "#9=IFCLOCALPLACEMENT(#9,#6)")
    yield (
        "placements in a circle",
        edited("#9=IFCLOCALPLACEMENT($,#6);", "#9=IFCLOCALPLACEMENT(#99,#6);\n#99=IFCLOCALPLACEMENT(#9,#6);"),
    )
    chain = (
        "".join(f"#{k}=IFCLOCALPLACEMENT(#{k + 1},#6);\n" for k in range(10_000, 30_000))
        + "#30000=IFCLOCALPLACEMENT($,#6);"
    )
    yield "a chain of placements", edited("#9=IFCLOCALPLACEMENT($,#6);", f"#9=IFCLOCALPLACEMENT(#10000,#6);\n{chain}")
    yield (
        "a whole in itself",
        edited(
            "#13=IFCRELAGGREGATES('0000000000000000000005',$,$,$,#11,(#10))",
            "#13=IFCRELAGGREGATES('0000000000000000000005',$,$,$,#10,(#10))",
        ),
    )
    yield "deep brackets", edited("(#10)", "(" * DEEP + ")" * DEEP)
    yield "open brackets", edited("(#10)", "(" * DEEP)
    yield (
        "solid in itself",
        edited("#104=IFCEXTRUDEDAREASOLID(#103,#6,#4,3.000)", "#104=IFCBOOLEANRESULT(.DIFFERENCE.,#104,#104)"),
    )
    yield (
        "a mapped item in itself",
        edited(
            "#104=IFCEXTRUDEDAREASOLID(#103,#6,#4,3.000)",
            "#104=IFCMAPPEDITEM(#500,#501);\n#500=IFCREPRESENTATIONMAP(#6,#105);\n#501=IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$,#3,1.,$)",
        ),
    )
    yield (
        "units in a circle",
        edited(
            "#1=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.)",
            "#1=IFCCONVERSIONBASEDUNIT(#98,.LENGTHUNIT.,'x',#97);\n#98=IFCDIMENSIONALEXPONENTS(1,0,0,0,0,0,0);\n#97=IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(1.),#1)",
        ),
    )
    for schema in ("IFC9", "", "IFC2X3", "IFC4X3_ADD2", "x" * 100_000):
        yield f"schema {schema[:9]}", edited("'IFC4'", f"'{schema}'")
    for number in ("1.E308", "-1.E308", "1.E400", "NAN", "1.E-300", "9" * 400, "'a'", "$", "*", ".T.", "()", "#3"):
        yield f"depth {number[:9]}", edited("#6,#4,3.000)", f"#6,#4,{number})")
        yield f"elevation {number[:9]}", edited(".ELEMENT.,0.)", f".ELEMENT.,{number})")
        yield (
            f"point {number[:9]}",
            edited("#3=IFCCARTESIANPOINT((0.,0.,0.))", f"#3=IFCCARTESIANPOINT((0.,0.,{number}))"),
        )
        yield f"width {number[:9]}", edited(",8.000,0.200)", f",{number},0.200)")
    for name in (
        "'\\X2\\D800\\X0\\'",
        "'\\X\\0A'",
        "'\\S\\'",
        "'" + "a" * 1_000_000 + "'",
        "'\\X4\\FFFFFFFF\\X0\\'",
        "'\\X2\\000A\\X0\\'",
        "'" + "''" * 5000 + "'",
        "'a\x00b'",
    ):
        yield f"name {name[:12]!r}", edited("'Ground'", name)
    storeys = "".join(
        f"#{k}=IFCBUILDINGSTOREY('{k:022}',$,'S{k}',$,$,#9,$,$,.ELEMENT.,{k / 1e6});\n" for k in range(20_000, 25_000)
    )
    yield "5,000 storeys", edited("#11=", f"{storeys}#11=")
    walls = "".join(f"#{k}=IFCWALL('{k:022}',$,'w',$,$,#9,#106,$,$);\n" for k in range(20_000, 20_300))
    yield "300 walls in one place", edited("#11=", f"{walls}#11=")
    holes = ",".join(f"#{k}" for k in range(20_000, 40_000))
    yield "a solid of nothing", edited("(#104)", f"({holes})")
    circle = "#103=IFCCIRCLEPROFILEDEF(.AREA.,$,#102,1.E9)"
    yield "a huge circle", edited("#103=IFCRECTANGLEPROFILEDEF(.AREA.,$,#102,8.000,0.200)", circle)
    for keyword in ("IFCWALL", "IFCSPACE", "IFCLOCALPLACEMENT", "IFCBUILDINGSTOREY", "IFCPROJECT", "IFCUNITASSIGNMENT"):
        for other in ("IFCBOOLEAN", "IFCREAL", "IFCROOT", "IFCNONSENSE", "IFCDOOR", "IFCCARTESIANPOINT"):
            yield f"{keyword} becomes {other}", edited(f"={keyword}(", f"={other}(")
    yield "the same number twice", edited("#12=", "#11=")
    yield "numbers beyond 64 bits", edited("#12=", f"#{'9' * 30}=")
    yield "a number of 0", edited("#12=", "#0=")
    yield "no end", replace_main(sample, text.replace("ENDSEC;", "").encode())
    yield "head alone", replace_main(sample, text[: text.index("DATA;")].encode())
