import json
import math
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import PlanError
from pipeline.floorplans.readers.json_file import (
    LARGEST_NUMBER,
    contains_all,
    finite_number,
    finite_points,
    load_json,
    parse_json,
    read_json_lines,
    short_name,
    short_text,
    sniff_text,
)

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)


def write(tmp_path: Path, content: bytes | str, name: str = "plan.json") -> Path:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_a_file_is_loaded_with_and_without_a_byte_order_mark(tmp_path, mark):
    assert load_json(write(tmp_path, mark + b'{"name": "H\xc3\xb6rsaal"}')) == {"name": "Hörsaal"}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "not whole JSON"),
        (b'{"verts": [[0, 0], [1', "not whole JSON"),
        (b'{"verts": 1} {"verts": 2}', "not whole JSON"),
        (b"\x89PNG\r\n\x1a\n", "byte 0 is not UTF-8"),
        (b'{"name": "H\xf6rsaal"}', "byte 11 is not UTF-8"),
        (b"[" * 200_000, "nested too deeply"),
        (b'{"a":' * 200_000 + b"1" + b"}" * 200_000, "nested too deeply"),
        (b"[" + b"9" * 5000 + b"]", "not whole JSON"),
        (b"\x00\x00\x00", "not whole JSON"),
    ],
)
def test_damaged_json_is_refused_in_one_sentence_with_the_name_of_the_file(tmp_path, content, said):
    path = write(tmp_path, content)
    with pytest.raises(PlanError, match=said) as caught:
        load_json(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value)) < 400 and "\n" not in str(caught.value)


def test_missing_files_folders_and_large_files_are_refused(tmp_path):
    with pytest.raises(PlanError, match=r"gone.json: cannot be read \(No such file"):
        load_json(tmp_path / "gone.json")
    with pytest.raises(PlanError, match=r"cannot be read \(Is a directory"):
        load_json(tmp_path)
    path = write(tmp_path, '"' + "x" * 98 + '"')
    assert load_json(path, most_bytes=100) == "x" * 98
    with pytest.raises(PlanError, match=r"more than 99 bytes, at most that many are read\. Split the file"):
        load_json(path, most_bytes=99)


def test_lines_are_read_one_by_one_past_bad_ones(tmp_path):
    lines = [
        b'\xef\xbb\xbf{"a": 1}',
        b"",
        b"   ",
        b"{",
        b'"' + b"x" * 100 + b'"',
        b"\xff",
        b'{"a": 2}\r',
        b"[" * 60_000,
    ]
    path = write(tmp_path, b"\n".join(lines[:-1]))
    found = dict(read_json_lines(path, most_line_bytes=50))
    assert [name.rpartition(" ")[2] for name in found] == ["1", "4", "5", "6", "7"]  # blank lines are counted
    first, cut, long, foreign, last = found.values()
    assert (first, last) == ({"a": 1}, {"a": 2})
    assert isinstance(cut, PlanError) and f"{path}, line 4: not whole JSON" in str(cut)
    assert isinstance(long, PlanError) and "line 5: longer than 50 bytes, expected one plan per line" in str(long)
    assert isinstance(foreign, PlanError) and "line 6: byte 0 is not UTF-8" in str(foreign)
    ((_, deep),) = read_json_lines(write(tmp_path, lines[-1]))
    assert isinstance(deep, PlanError) and "nested too deeply" in str(deep)


def test_a_line_exactly_as_long_as_allowed_is_read(tmp_path):
    path = write(tmp_path, '"12345678"\n"123456789"\n1')
    assert [value for _, value in read_json_lines(path, most_line_bytes=11)][::2] == ["12345678", 1]


def test_lines_of_a_missing_file_are_an_error(tmp_path):
    with pytest.raises(PlanError, match="cannot be read"):
        list(read_json_lines(tmp_path / "gone.jsonl"))


@given(st.lists(JSON, max_size=5))
def test_lines_give_back_what_was_written(tmp_path_factory, values):
    path = write(tmp_path_factory.mktemp("lines"), "\n".join(json.dumps(value) for value in values))
    assert [value for _, value in read_json_lines(path)] == values


@given(st.binary(max_size=200))
def test_any_bytes_are_json_or_refused(content):
    with suppress(PlanError):
        assert parse_json(content, "noise") == json.loads(content.decode("utf-8-sig")) or b"NaN" in content


@given(st.binary(max_size=100))
def test_a_look_into_any_file_gives_text(tmp_path_factory, content):
    path = write(tmp_path_factory.mktemp("look"), content)
    assert sniff_text(path, 50) == content[:50].decode("utf-8-sig", errors="replace")


def test_a_look_into_what_is_no_file_is_empty(tmp_path):
    assert sniff_text(tmp_path) == sniff_text(tmp_path / "gone") == sniff_text(Path("a\0b")) == ""


@pytest.mark.parametrize("value", [True, "1", None, [1], {}, "9" * 500])
def test_what_is_no_number_is_refused(value):
    with pytest.raises(PlanError, match=r"f: scale is .*, expected a number") as caught:
        finite_number(value, "f: scale")
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, 10**400, -(10**400), 2 * LARGEST_NUMBER])
def test_numbers_without_bound_are_refused(value):
    with pytest.raises(PlanError, match=r"f: scale is .*, expected a finite number of size at most 1e"):
        finite_number(value, "f: scale")
    with pytest.raises(PlanError, match="f: verts: a coordinate is not finite or beyond 1e"):
        finite_points([[0, 0], [1, value]], "f: verts")


@given(st.integers(-(10**9), 10**9) | st.floats(-1e9, 1e9))
def test_numbers_within_the_bounds_stay_as_they_are(value):
    assert finite_number(value, "f") == value


def test_numbers_may_have_a_bound_of_their_own():
    with pytest.raises(PlanError, match="at most 100"):
        finite_number(101, "f: width", largest=100)


def test_points_lose_what_comes_after_x_and_y():
    points = finite_points([[1, 2], [3.5, 4, 9], [5, 6, 7, 8]], "f")
    assert points.dtype == np.float64
    assert points.tolist() == [[1, 2], [3.5, 4], [5, 6]]
    assert finite_points([], "f").shape == (0, 2)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("many", "f is 'many', expected a list of points"),
        ({"x": 1}, "f is 'a mapping of 1', expected a list of points"),
        ([1, 2], r"a point is not a list \[x, y\]"),
        ([[1]], r"a point is not a list \[x, y\]"),
        ([[1, 2, 3, 4, 5]], r"a point is not a list \[x, y\]"),
        ([[1, "2"]], "a coordinate is not a number"),
        ([[1, None]], "a coordinate is not a number"),
        ([[True, 2]], "a coordinate is not a number"),
        ([[0, 0]] * 4, "f has 4 points, at most 3 are read"),
    ],
)
def test_what_are_no_points_is_refused(value, said):
    with pytest.raises(PlanError, match=said):
        finite_points(value, "f", most=3)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("  Room\n12\t\x00b ", "Room 12 b"),
        ("half \ud800 pair", "half ? pair"),
        (3, "3"),
        (2.50, "2.5"),
        (None, "None"),
        (True, "True"),
        ([1, [2]], "a list of 2"),
        ({"a": {}}, "a mapping of 1"),
        (10**4000, "a very large integer"),
        ("x" * 500, "x" * 117 + "..."),
    ],
)
def test_any_value_becomes_a_short_line(value, text):
    assert short_text(value) == text


@given(st.text() | JSON)
def test_short_texts_are_clean_and_can_be_stored(value):
    text = short_text(value)
    assert len(text) <= 120
    assert text.isprintable() and text == text.strip()
    assert text.encode().decode() == text
    assert short_text(text) == text


@given(st.text(alphabet="./\\ab"))
def test_names_never_lead_out_of_a_folder(value):
    name = short_name(value)
    assert "/" not in name and "\\" not in name and not name.startswith(".")


@pytest.mark.parametrize("before", [0, (1 << 20) - 3, 2_500_000])
def test_patterns_are_found_anywhere_in_a_file(tmp_path, before):
    path = tmp_path / "a.json"
    path.write_bytes(b"x" * before + b"wall" + b"\xff" * 50 + b"door")
    assert contains_all(path, ["wa[l]{2}", "door"])
    assert not contains_all(path, ["wall", "window"])
    assert contains_all(path, ["door"], most_bytes=before + 58)
    assert not contains_all(path, ["door"], most_bytes=before + 57)


def test_patterns_are_not_found_where_nothing_can_be_read(tmp_path):
    assert not any(contains_all(path, ["a"]) for path in (tmp_path, tmp_path / "gone", Path("a\0b")))
