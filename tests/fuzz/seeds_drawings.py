"""Tiny drawings and models: XML of floors, SVG, DXF, IFC."""

import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

from tests.fuzz.sample import (
    CENTIMETRES,
    METRES,
    Sample,
    box,
)

if TYPE_CHECKING:
    from ezdxf.document import Drawing


def luperto_samples() -> Iterator[Sample]:
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


def svg_samples() -> Iterator[Sample]:
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
    yield Sample({"styled.svg": _STYLED_SVG.encode()}, "styled.svg", CENTIMETRES)


_STYLED_SVG = """<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 800 500">
<style type="text/css">.Wall path, #post { fill: none } .fat{stroke-width:20px;stroke:#333!important}
g &gt; .old ~ rect{display:none} @media screen{.off{visibility:hidden}} rect[rx]:not(.a):nth-child(2n+1){opacity:.5}
.m{transform:translate(5%, 10px) rotate(.25turn);transform-origin:center;fill-rule:evenodd}</style>
<defs><clipPath id="c" clip-rule="evenodd"><path d="M0 0h800v500h-800zM1 1h2v2h-2z"/><use href="#post"/></clipPath>
<symbol id="s" viewBox="0 0 10 10" preserveAspectRatio="xMinYMax slice">
<rect class="Wall" width="50%" height="1"/></symbol>
<g id="both"><use xlink:href="#s" width="90" height="90"/><use href="#s" x="3"/></g></defs>
<g class="Wall fat" clip-path="url(#c)"><path d="M10 10H790V490H10Z" stroke-linejoin="bevel"/>
<path class="m" fill="#fff" stroke="none" d="M390 0h20v200h-20zM395 100h10v390h-10z"/>
<rect id="post" x="100" y="100" width="9" height="9" rx="2"/></g>
<svg class="Walls" x="50%" y="1cm" width="100" height="200" viewBox="0 0 50 50"><polyline points="9,9 40,9 40,40"
stroke-width="4" stroke-linecap="square" vector-effect="non-scaling-stroke" stroke="rgb(1 2 3 / 40%)"/></svg>
<g class="off"><rect class="Wall" width="20" height="9"/>
<use href="#both" transform="skewX(9) matrix(1 0 0 2 9 9)"/></g>
<use class="Wall" href="#both" y="60" opacity="80%" style="translate:9px;scale:2 1"/></svg>"""


def dxf_samples() -> Iterator[Sample]:
    import ezdxf

    ezdxf.options.write_fixed_meta_data_for_testing = True  # else every file has its own date and numbers
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
    stream = io.StringIO()
    _dxf_of_all_kinds().write(stream)
    yield Sample({"kinds.dxf": stream.getvalue().encode()}, "kinds.dxf")


def _dxf_of_all_kinds() -> "Drawing":
    """Widths, areas, multilines, stretched doors, clips, layers that are switched off, and an external reference."""
    import ezdxf
    from ezdxf.xclip import XClip

    document = ezdxf.new("R2010", units=4)
    space = document.modelspace()
    document.layers.add("WALL-OLD").off()
    document.layers.add("WALL-NEW").freeze()
    walls, doors = {"layer": "WALL"}, {"layer": "DOOR"}
    hall = [(0, 0), (8000, 0), (8000, 5000), (0, 5000)]
    space.add_lwpolyline(hall, close=True, dxfattribs=walls | {"const_width": 200})
    space.add_lwpolyline([(1000, 0, 90, 300, 0.5), (1000, 2000, 0, 0, 0)], format="xyseb", dxfattribs=walls)
    space.add_solid([(2000, 0), (2200, 0), (2000, 2000), (2200, 2000)], dxfattribs=walls)
    space.add_3dface([(3000, 0, 0), (3000, 0, 2500), (3000, 900, 2500), (3000, 900, 0)], dxfattribs=walls)
    hatch = space.add_hatch(dxfattribs=walls)
    hatch.paths.add_polyline_path([(4000, 0), (4500, 0, 0.3), (4500, 900), (4000, 900)], is_closed=True)
    hatch.paths.add_edge_path().add_line((4100, 100), (4200, 300))
    space.add_mline([(5000, 0), (5000, 5000)], dxfattribs=walls).set_scale_factor(150)
    space.add_line((6000, 0), (6000, 900), dxfattribs={"layer": "WALL-OLD"})
    block = document.blocks.new("LEAF")
    block.add_arc((0, 0), 1, 0, 90)
    block.add_lwpolyline([(0, 0), (0, 1), (0.3, 0.954), (0.5, 0.866), (0.7, 0.714), (0.9, 0.436), (1, 0)])
    place = {"xscale": 900, "yscale": 700, "rotation": 90}
    space.add_blockref("LEAF", (5000, 2000), dxfattribs=doors | place)
    space.add_blockref("LEAF", (5000, 4000), dxfattribs={"layer": "WALL-NEW"} | place)
    document.blocks.new("BAR").add_line((0, 0), (3000, 0), dxfattribs=walls)
    XClip(space.add_blockref("BAR", (200, 3000))).set_block_clipping_path([(0, -100), (900, 100)])
    document.add_xref_def("shell.dxf", "SHELL")
    space.add_blockref("SHELL", (0, 0))
    space.add_text("W1", dxfattribs=walls)
    return document


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


def ifc_samples() -> Iterator[Sample]:
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
