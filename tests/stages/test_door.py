"""The door: sections become typed records, and what is refused is named by its full key."""

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf

from pipeline.checking import note_taken_out
from pipeline.errors import ConfigError
from pipeline.planning import ordering
from pipeline.settings import RobotConfig, SensorConfig, require
from pipeline.stages.door import typed, workspace
from pipeline.stages.settings import ExecutionConfig
from pipeline.systems.subgoals.settings import PlannerConfig


class Order(Enum):
    FIRST = 1
    LAST = 2


@dataclass(frozen=True, kw_only=True)
class Corridor:
    width_m: float
    doors: int = 0


@dataclass(frozen=True, kw_only=True)
class Shop:
    sells: str
    order: Order = Order.LAST
    stock: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class TownConfig:
    resolution_m: float
    name: str | None = None
    streets: int = 2
    paved: bool = False
    order: Order = Order.FIRST
    widths_m: list[float] = field(default_factory=list)
    corridor: Corridor = field(default_factory=lambda: Corridor(width_m=1.0))
    shops: dict[str, Shop] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require(self.resolution_m > 0, "town.resolution_m", self.resolution_m, "above 0 m")


def town(**content: object) -> TownConfig:
    return typed(TownConfig, OmegaConf.create({"town": {"resolution_m": 0.1, **content}}), "town")


def test_a_section_becomes_a_frozen_record() -> None:
    record = town(streets=3, widths_m=[1, 2.5], corridor={"width_m": 2}, order="LAST")
    assert record == TownConfig(
        resolution_m=0.1, streets=3, widths_m=[1.0, 2.5], corridor=Corridor(width_m=2.0), order=Order.LAST
    )
    assert isinstance(record.corridor, Corridor)
    with pytest.raises(AttributeError):
        record.streets = 4  # type: ignore[misc]


def test_interpolations_are_resolved() -> None:
    raw = OmegaConf.create({"cell_m": 0.25, "town": {"resolution_m": "${cell_m}"}})
    assert typed(TownConfig, raw, "town").resolution_m == 0.25


def test_a_mapping_of_records_is_typed_entry_by_entry() -> None:
    bakery, books = {"sells": "bread", "stock": {"rye": [1, 2]}}, {"sells": "books", "order": "FIRST"}
    record = town(shops={"bakery": bakery, "closed": None, "books": books})
    assert record.shops == {
        "bakery": Shop(sells="bread", stock={"rye": [1, 2]}),
        "books": Shop(sells="books", order=Order.FIRST),
    }
    assert list(record.shops) == ["bakery", "books"]


REFUSED: list[tuple[dict[str, object], tuple[str, ...]]] = [
    ({"resolutoin_m": 0.2}, ("unknown key town.resolutoin_m", "Did you mean town.resolution_m?", "conf/town/")),
    ({"corridor": {"width": 2}}, ("unknown key town.corridor.width.", "Did you mean town.corridor.width_m?")),
    ({"zzz": 1}, ("unknown key town.zzz", "Allowed are town.resolution_m, town.name")),
    ({"corridor": {"doors": 2}}, ("town.corridor.width_m is missing", "a number")),
    ({"resolution_m": "fine"}, ("town.resolution_m = 'fine'", "expected a number", "conf/town/")),
    ({"resolution_m": None}, ("town.resolution_m = None", "expected a number")),
    ({"resolution_m": "???"}, ("town.resolution_m is missing", "town.resolution_m=...")),
    ({"streets": 2.5}, ("town.streets = 2.5", "expected a whole number")),
    ({"paved": "maybe"}, ("town.paved = 'maybe'", "true or false")),
    ({"order": "MIDDLE"}, ("town.order = 'MIDDLE'", "one of FIRST, LAST")),
    ({"widths_m": [1.0, "wide"]}, ("town.widths_m[1] = 'wide'", "a number")),
    ({"widths_m": 3}, ("town.widths_m = 3", "a list of: a number")),
    ({"corridor": {"width_m": "wide"}}, ("town.corridor.width_m = 'wide'", "a number")),
    ({"resolution_m": -1}, ("town.resolution_m = -1", "above 0 m")),
    ({"resolution_m": float("nan")}, ("town.resolution_m = nan", "above 0 m")),
    ({"name": "${nowhere}"}, ("town.name", "nowhere")),
    (
        {"shops": {"bakery": {"sels": "bread"}}},
        ("unknown key town.shops.bakery.sels.", "Did you mean town.shops.bakery.sells?", "(conf/town/)"),
    ),
    ({"shops": {"bakery": {"order": "LAST"}}}, ("town.shops.bakery.sells is missing", "in conf/town/")),
    (
        {"shops": {"bakery": {"sells": "bread", "order": "NEVER"}}},
        ("town.shops.bakery.order = 'NEVER'", "one of FIRST, LAST", "in conf/town/ "),
    ),
    ({"shops": {"bakery": {"sells": ["bread"]}}}, ("town.shops.bakery.sells = ['bread']: expected text",)),
    ({"shops": {"bakery": {"sells": "x", "stock": 3}}}, ("town.shops.bakery.stock = 3: expected a mapping",)),
    ({"shops": ["bakery"]}, ("town.shops = ['bakery']", "a mapping of names to mappings with the keys sells, order")),
    ({"shops": {"bakery": "bread"}}, ("town.shops.bakery = 'bread'", "a mapping with the keys sells, order")),
]


@pytest.mark.parametrize(("content", "expected"), REFUSED, ids=lambda entry: str(entry)[:40])
def test_bad_sections_are_refused_by_name(content: dict[str, object], expected: tuple[str, ...]) -> None:
    with pytest.raises(ConfigError) as refusal:
        town(**content)
    message = str(refusal.value)
    assert "\n" not in message
    for part in expected:
        assert part in message


def test_what_a_tilde_takes_out_is_told_where_a_default_takes_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    note_taken_out(["~town.streets", "~town.shops.bakery.order", "~town.shops.books", "~country"])
    town(shops={"bakery": {"sells": "bread"}})
    assert sorted(capsys.readouterr().err.splitlines()) == [
        f"~town.shops.bakery.order: falls back to {Order.LAST!r}, the default of the code, not that of conf/town/",
        "~town.streets: falls back to 2, the default of the code, not that of conf/town/",
    ]


def test_a_missing_section_is_named() -> None:
    with pytest.raises(ConfigError, match="section town is missing: expected the keys resolution_m"):
        typed(TownConfig, OmegaConf.create({}), "town")


IMPOSSIBLE = [
    (SensorConfig, {"max_range_m": 0.0}, "sensor.max_range_m"),
    (SensorConfig, {"max_range_m": 10.0, "beams": 1000}, "multiple of sensor.input_beams = 256"),
    (
        SensorConfig,
        {"max_range_m": 10.0, "input_beams": 56},
        "sensor.input_beams = 56: expected 64 to 1024, a multiple",
    ),
    (
        SensorConfig,
        {"max_range_m": 10.0, "beams": 1000, "input_beams": 100},
        "sensor.input_beams = 100: expected 64 to",
    ),
    (SensorConfig, {"max_range_m": 10.0, "beams": 2048, "input_beams": 2048}, "sensor.input_beams = 2048: expected"),
    (SensorConfig, {"max_range_m": 10.0, "noise_m": -0.1}, "sensor.noise_m"),
    (RobotConfig, {"radius_m": -0.1, "step_m": 0.5}, "robot.radius_m"),
    (RobotConfig, {"radius_m": 0.1, "step_m": 0.0}, "robot.step_m"),
    (PlannerConfig, {"max_subgoals": 0}, "planner.max_subgoals"),
    (PlannerConfig, {"max_subgoals": ordering.MOST_SUBGOALS + 1}, "planner.max_subgoals = 21: expected from 1 to 20"),
    (PlannerConfig, {"failure_penalty_m": float("nan")}, "planner.failure_penalty_m"),
    (ExecutionConfig, {"workers": 0}, "execution.workers"),
    (ExecutionConfig, {"backend": "thread"}, "execution.backend"),
]


@pytest.mark.parametrize(("schema", "values", "expected"), IMPOSSIBLE)
def test_shared_settings_refuse_impossible_values(schema: type, values: dict[str, object], expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        schema(**values)


def test_workspace_takes_its_keys_from_the_root() -> None:
    raw = OmegaConf.create({"seed": 7, "artifacts": "out", "execution": {"workers": 3, "progress": False}})
    work = workspace(raw)
    assert (work.seed, work.workers, work.progress) == (7, 3, False)
    assert work.folder("harvest") == Path("out/harvest")
    assert not work.folder("harvest").exists()


@pytest.mark.parametrize(
    ("root", "expected"),
    [
        ({"seed": -1}, "seed = -1"),
        ({"seed": "x"}, "seed = 'x'"),
        ({"seed": True}, "seed"),
        ({"artifacts": ""}, "artifacts = ''"),
    ],
)
def test_workspace_refuses(root: dict[str, object], expected: str) -> None:
    raw = OmegaConf.create({"seed": 1, "artifacts": "out", "execution": {}} | root)
    with pytest.raises(ConfigError, match=expected):
        workspace(raw)
