import io
import json
import sqlite3
import zipfile

import numpy as np
import pytest

from pipeline.errors import PlanError
from pipeline.floorplans.readers import BAD, UNRECOGNISED, classify, nothing_found, read_plan_file
from pipeline.floorplans.readers.foreign import look_of
from pipeline.floorplans.sources import lone_file, open_source


def zipped(*names: str) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name in names:
            archive.writestr(name, "<a/>")
    return packed.getvalue()


FEATURE = {"type": "Feature", "properties": {"name": "hall", "use": "office"}, "geometry": None}


@pytest.mark.parametrize(
    ("name", "content", "what", "advice"),
    [
        ("floor.pdf", b"%PDF-1.7\n%\xe2\xe3", "a PDF document", "pdftocairo -svg"),
        ("floor.ai", b"%PDF-1.5\n", "a PDF document", "--scale"),
        ("floor", b"%!PS-Adobe-3.0 EPSF-3.0\n", "a PostScript document", "ps2pdf"),
        ("old.dwg", b"AC1015\x00\x00", "a drawing of AutoCAD 2000 (DWG)", "Save it as DXF"),
        ("new.dwg", b"AC1032\x00\x00", "a drawing of AutoCAD 2018 (DWG)", "dwg2dxf"),
        ("misnamed.dxf", b"AC1009\x00\x00", "a drawing of AutoCAD (DWG)", "ODA File Converter"),
        ("a.dgn", b"\x08\x09\xfe\x02\x00", "a MicroStation drawing (DGN)", "Save it as DXF"),
        ("a.rvt", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(80), "a compound file of Microsoft", "DXF or IFC"),
        ("map.osm", b"<?xml version='1.0'?>\n<!-- x -->\n<osm v='0.6'>", "raw OpenStreetMap data", "osmium export"),
        ("map.xml", b"\xef\xbb\xbf<osm version='0.6'><node/>", "raw OpenStreetMap data (XML)", "osmium export"),
        ("m.osm.pbf", b"\x00\x00\x00\x0d\x0a\x09OSMHeader\x18", "raw OpenStreetMap data (PBF)", "osmium export"),
        ("o.json", b'{"version": 0.6, "generator": "Overpass", "elements": []}', "an answer of Over", "osmtogeojson"),
        ("n.docx", zipped("[Content_Types].xml", "word/document.xml"), "a Word document", "as SVG, DXF or PNG"),
        ("n.vsdx", zipped("[Content_Types].xml", "visio/document.xml"), "a Visio drawing", "SVG or DXF in Visio"),
        ("n.odg", zipped("mimetype", "META-INF/manifest.xml"), "a document of OpenOffice", "as SVG, DXF or PNG"),
        ("page.svg", b"<!DOCTYPE html>\n<html>", "a web page (HTML)", "download the file itself"),
        ("page.dxf", b"\n\n<html lang='de'>", "a web page (HTML)", "download the file itself"),
        ("lfs.ifc", b"version https://git-lfs.github.com/spec/v1\noid", "a pointer of Git LFS", "git lfs pull"),
        ("a.kml", b'<?xml version="1.0"?><kml xmlns="x">', "a KML file", "ogr2ogr"),
        ("a.gml", b"<wfs:FeatureCollection xmlns:wfs='x'>", "a GML file", "ogr2ogr"),
        ("a.xml", b"<building2 id='1'><x/>", "XML of the kind <building2>", "DXF, SVG, IFC, GeoJSON or PNG"),
        ("a.json", b'{"walls": [], "size": 3}', "JSON with the keys walls, size,", "--reader"),
        ("a.json", b'[{"x": 1, "y": 2}, {"x": 2}]', "JSON, a list of 2 entries, the first with the keys x, y", ""),
        ("a.json", b'{"walls": [', "JSON that is not understood: not whole JSON", "get the file again"),
        ("t.json", b'{"type": "Topology", "objects": {}}', "a TopoJSON file", "ogr2ogr"),
        ("c.json", b'{"type": "CityJSON", "version": "1.1"}', "a city model (CityJSON)", ""),
        ("f.geojson", json.dumps(FEATURE).encode(), "GeoJSON of a single feature", "FeatureCollection"),
        (
            "f.geojson",
            json.dumps({"type": "FeatureCollection", "features": [FEATURE, FEATURE]}).encode(),
            "GeoJSON with 2 features whose properties are name, use,",
            "indoor=room and level=0",
        ),
        ("m.yaml", b"doors: a\n  width: 1\n", "YAML that is not understood (line 2: ", "Repair it"),
        ("m.yaml", b"doors: 3\nwidth: 1\n", "YAML with the keys doors, width, not those", "image, resolution and"),
        ("a.webp", b"RIFF\x00\x01\x00\x00WEBPVP8 ", "a WebP picture", "PNG"),
        ("a.heic", b"\x00\x00\x00\x18ftypheic", "a HEIC picture", "PNG"),
        ("a.las", b"LASF\x00\x00", "a point cloud (LAS, LAZ)", "Cut it about 1 m"),
        ("a.bag", b"#ROSBAG V2.0\n", "a recording (ROS bag)", "map_saver"),
        ("a.pkl", b"\x80\x04\x95\x00", "a pickle of Python", "npz"),
        ("a.png", b"", "an empty file", "Get the file again"),
        ("a.pgm", bytes(400), "a file of 400 bytes that begins with nothing but", "Get the file again"),
        ("a.csv", b"x;y;w\n1;2;3\n", "a table whose first line is 'x;y;w'", ""),
        ("a.txt", b"r\xf6om\n1\n" * 9, "text that begins with 'r\u00f6om', not in UTF-8", ""),
        ("a.bin", b"\x8f\x03\x00\xff\x01\x02\x03\x04\x05", "binary data of no known kind (it begins with 8f 03 00", ""),
    ],
)  # fmt: skip
def test_a_file_that_no_reader_takes_is_called_what_it_is(name, content, what, advice, tmp_path, monkeypatch, capsys):
    from pipeline.stages.plan_command import main

    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(content)
    assert main(["info", name]) == 1
    out, err = capsys.readouterr()
    assert err.startswith(f"error: {name}: {what}")
    assert advice in err
    assert "which is not read" in err
    assert (out, err.count("\n")) == ("", 1)
    assert len(err) < 450
    assert "plans.re" not in err
    assert "mit_campus_grids" not in err


def test_a_database_and_an_npz_of_strange_arrays(tmp_path):
    base = sqlite3.connect(tmp_path / "floors.gpkg")
    base.execute("create table rooms (x)")
    base.commit()
    base.close()
    assert look_of(tmp_path / "floors.gpkg").what.startswith("an SQLite database, such as a GeoPackage")
    np.savez(tmp_path / "g.npz", walls=np.zeros(3), height=np.zeros(2))
    assert look_of(tmp_path / "g.npz").what == "an npz with the arrays walls, height, those of no known format"
    with pytest.raises(PlanError, match=r"g.npz: an npz with the arrays walls, height"):
        read_plan_file(tmp_path / "g.npz")


def test_a_name_of_an_array_never_reaches_the_terminal_raw(tmp_path):
    (tmp_path / "g.npz").write_bytes(zipped("a\x1b[31mred.npy"))
    assert look_of(tmp_path / "g.npz").what.isprintable()


def test_a_document_in_a_folder_is_one_file_that_is_passed_over(tmp_path):
    (tmp_path / "notes.docx").write_bytes(zipped("[Content_Types].xml", "word/document.xml", "word/styles.xml"))
    (tmp_path / "plan.odt").write_bytes(zipped("mimetype", "content.xml", "META-INF/manifest.xml"))
    with open_source(tmp_path) as files:
        assert [(each.file.name, each.role) for each in classify(files)] == [
            ("notes.docx", UNRECOGNISED),
            ("plan.odt", UNRECOGNISED),
        ]
    (alone,) = classify([lone_file(tmp_path / "notes.docx")])
    assert alone.role == BAD
    assert "a Word document" in str(alone.problem)


def test_a_folder_without_a_plan_says_what_is_in_it(tmp_path):
    for number in range(3):
        (tmp_path / f"{number}.dwg").write_bytes(b"AC1027\x00\x00")
    (tmp_path / "readme.txt").write_text("hello")
    found = classify([lone_file(path) for path in sorted(tmp_path.iterdir())])
    told = nothing_found(tmp_path, None, found)
    assert told.startswith(
        f"plans.root = {tmp_path}: no floor plan among 4 files: 3 x a drawing of AutoCAD 2013 (DWG); 1 x text that"
    )
    assert "Save it as DXF" in told
    assert nothing_found(tmp_path, "dxf", found).startswith(f"plans.root = {tmp_path}: no *.dxf in this folder")
