import json
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import pytest

from pipeline.learning.records import as_plain, from_plain


class Scale(NamedTuple):
    slope: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Layer:
    widths: tuple[int, ...]
    scale: Scale = field(default_factory=Scale)


@dataclass(frozen=True)
class Whole:
    name: str
    layers: tuple[Layer, ...]
    window: tuple[int, float]
    most: int | None = None
    rate: float = 0.5
    bold: bool = False
    settings: dict[str, Any] = field(default_factory=dict)


WHOLE = Whole("w", (Layer((3, 4)), Layer((), Scale(2.0, -0.5))), (7, 0.25), most=9, settings={"a": [1, None]})


def test_json_and_back() -> None:
    plain = json.loads(json.dumps(as_plain(WHOLE)))
    assert plain["layers"][1] == {"widths": [], "scale": {"slope": 2.0, "offset": -0.5}}
    assert from_plain(Whole, plain) == WHOLE


def test_defaults_fill_what_is_missing_and_whole_numbers_are_numbers() -> None:
    found = from_plain(Whole, {"name": "w", "layers": [], "window": [7, 1], "rate": 1})
    assert found == Whole("w", (), (7, 1.0), rate=1.0)
    assert isinstance(found.rate, float)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"surprise": 1}, "surprise is no field of a Whole"),
        ({"name": 3}, "name is 3, no str"),
        ({"most": True}, "most is True"),
        ({"bold": 1}, "bold is 1, no bool"),
        ({"rate": "fast"}, "rate is 'fast', no float"),
        ({"window": [1, 2.0, 3]}, r"window is \[1, 2.0, 3\]"),
        ({"layers": [{"widths": [1.5]}]}, "widths is 1.5, no int"),
        ({"layers": [{"scale": {}}]}, "widths is missing of a Layer"),
        ({"layers": [7]}, "7 is no mapping of the fields of a Layer"),
        ({"settings": 3}, "settings is no table of settings"),
    ],
)
def test_what_does_not_fit_is_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        from_plain(Whole, as_plain(WHOLE) | change)
