import pytest
import yaml

from pipeline.floorplans.readers.map_yaml import is_meant_as_map, load_map_yaml

TABS = "{} lines have tabs, which YAML forbids (line {} first): read as spaces"
OPENCV = "its first line %YAML:1.0, which OpenCV writes, is not YAML and was passed over"


@pytest.mark.parametrize(
    ("text", "content", "remarks"),
    [
        ("image: a.pgm\nresolution: 0.1\n", {"image": "a.pgm", "resolution": 0.1}, ()),
        ("image:\ta.pgm\nresolution:\t0.1\n", {"image": "a.pgm", "resolution": 0.1}, (TABS.format(2, 1),)),
        ("image: a.pgm\norigin:\t[1,\t2, 3]\n", {"image": "a.pgm", "origin": [1, 2, 3]}, (TABS.format(1, 2),)),
        ("image: a.pgm\t# saved\n", {"image": "a.pgm"}, (TABS.format(1, 1),)),
        ('image: "a\tb.pgm"\n', {"image": "a\tb.pgm"}, ()),
        ('%YAML:1.0\n---\nimage: "a.pgm"\n', {"image": "a.pgm"}, (OPENCV,)),
        ("%YAML:1.0\r\nimage: a.pgm\r\n", {"image": "a.pgm"}, (OPENCV,)),
        ("%YAML:1.0\n---\nimage:\ta.pgm\n", {"image": "a.pgm"}, (OPENCV, TABS.format(1, 3))),
        ("%YAML 1.1\n---\nimage: a.pgm\n", {"image": "a.pgm"}, ()),
        (r'image: "C:\maps\new.pgm"', {"image": r"C:\maps\new.pgm"}, ()),
        (r'image: "C:\\maps\\map.pgm"', {"image": r"C:\maps\map.pgm"}, ()),
        (r'{"image": "..\it' "'" r's\map.pgm", "negate": 0}', {"image": r"..\it's\map.pgm", "negate": 0}, ()),
    ],
)
def test_what_tools_write_is_read_and_what_was_mended_is_said(text, content, remarks):
    assert load_map_yaml(text) == (content, remarks)


@pytest.mark.parametrize("text", ["image: [1, 2", "image: a\n\tb: [", "%YAML:1.0\n---\na: *b\n", "a: b: c"])
def test_what_cannot_be_mended_raises_the_error_of_the_text_as_it_came(text):
    with pytest.raises(yaml.YAMLError) as problem:
        load_map_yaml(text)
    with pytest.raises(yaml.YAMLError) as plain:
        yaml.safe_load(text)
    assert problem.value.problem_mark.line == plain.value.problem_mark.line


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("image: a\nresolution: [", True),
        ('{"image": 1, "resolution": 0.1', True),
        ("image: a\n", False),
        ("my_image: a\nresolution: 1", False),
        ("resolution: 1", False),
    ],
)
def test_a_map_is_known_by_its_keys_however_damaged(text, meant):
    assert is_meant_as_map(text) is meant
