import pytest

from pipeline.floorplans.readers.osm_values import levels_in, metres_in, tags_in


@pytest.mark.parametrize(
    ("text", "levels"),
    [
        ("0", ["0"]),
        ("0;1", ["0", "1"]),
        (" 0 ; 3 ", ["0", "3"]),
        ("0, 1", ["0", "1"]),
        ("0,1", ["0", "1"]),
        ("-1,0", ["-1", "0"]),
        ("0,1,2", ["0", "1", "2"]),
        ("0-2", ["0", "1", "2"]),
        ("2-0", ["0", "1", "2"]),
        ("-1-1", ["-1", "0", "1"]),
        ("1--1", ["-1", "0", "1"]),
        ("-3--1", ["-3", "-2", "-1"]),
        ("1 - 2", ["1", "2"]),
        ("- 2", ["-2"]),
        ("+1", ["1"]),
        ("+1;+3", ["1", "3"]),
        ("\u22122", ["-2"]),
        ("\u22121\u20131", ["-1", "0", "1"]),
        ("0.5", ["0.5"]),
        (".5", ["0.5"]),
        ("0.5-2.5", ["0.5", "1.5", "2.5"]),
        ("-0", ["0"]),
        ("1.0", ["1"]),
        ("1;1;1-2", ["1", "2"]),
        ("0;;1;", ["0", "1"]),
        ("", []),
    ],
)
def test_levels(text, levels):
    assert levels_in(text) == (tuple(levels), (), ())


@pytest.mark.parametrize(
    ("text", "levels"),
    [
        ("0,5", ["0.5"]),
        ("-1,5", ["-1.5"]),
        ("0;2,25", ["0", "2.25"]),
        ("0,5-2,5", ["0.5", "1.5", "2.5"]),
        ("3,0", ["3"]),
    ],
)
def test_a_comma_between_numbers_that_do_not_follow_each_other_is_a_decimal_one_and_said(text, levels):
    found = levels_in(text)
    assert list(found.found) == levels
    assert found.unread == ()
    assert len(found.with_comma) == 1


@pytest.mark.parametrize(
    ("text", "levels", "unread"),
    [
        ("B1", [], ["B1"]),
        ("B1;1", ["1"], ["B1"]),
        ("ground", [], ["ground"]),
        ("1 2", [], ["1 2"]),
        ("0-1000", [], ["0-1000"]),
        ("9" * 90, [], ["9" * 90]),
        ("nan", [], ["nan"]),
        ("1e3", [], ["1e3"]),
        ("-", [], ["-"]),
    ],
)
def test_what_is_no_level_is_handed_back(text, levels, unread):
    assert levels_in(text) == (tuple(levels), tuple(unread), ())


@pytest.mark.parametrize(
    ("text", "width"),
    [
        ("0.9", 0.9),
        ("1,2", 1.2),
        ("1.2 m", 1.2),
        ("1.2M", 1.2),
        ("2m", 2.0),
        ("1,05 metres", 1.05),
        (" .85 m ", 0.85),
        ("90 cm", 0.9),
        ("82,5cm", 0.825),
        ("900 mm", 0.9),
        ("1,010 mm", 1.01),
        ("3'", 0.9144),
        ("2.5 ft", 0.762),
        ('36"', 0.9144),
        ("30 in", 0.762),
        ("32''", 0.8128),
        ("3'6\"", 1.0668),
        ("3' 6\"", 1.0668),
        ("2 ft 8 in", 0.8128),
        ("2'10", 0.8636),
        ("2\u20328\u2033", 0.8128),
        *(
            (text, None)
            for text in ("0.1", "90", "36", "nan", "inf", "-1", "", "wide", "0.9-1.2", "1 yard", "8 mm", "1e0")
        ),
    ],
)
def test_widths_of_doors(text, width):
    assert metres_in(text) == (None if width is None else pytest.approx(width))


@pytest.mark.parametrize(
    ("value", "tags"),
    [
        ({"level": 1}, {"level": 1}),
        ('"indoor"=>"room","level"=>"0;1"', {"indoor": "room", "level": "0;1"}),
        ('"name"=>"a \\"b\\" => c", "level" => "2"', {"name": 'a "b" => c', "level": "2"}),
        ('{"indoor": "area", "level": "-1"}', {"indoor": "area", "level": "-1"}),
        *((value, {}) for value in ("{", "[1]", "{" * 9000, '{"a":' * 3000, "no tags", 7, None, ["a"], "x" * 30_000)),
    ],
)
def test_tags_that_are_packed_in_one_value(value, tags):
    assert tags_in(value) == tags
