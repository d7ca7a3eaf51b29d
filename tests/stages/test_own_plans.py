"""Generators and readers of anybody's work wherever a name of ours does."""

from pathlib import Path

import pytest
from joblib.externals.loky import get_reusable_executor
from omegaconf import DictConfig, OmegaConf

from pipeline.errors import HinterlandError
from pipeline.floorplans.store import read_plans
from pipeline.parts import add_to_path
from pipeline.stages.plans import plans

GENERATOR = """
from dataclasses import dataclass

from shapely.geometry import box

from pipeline.floorplans.plan import Bounds, FloorPlan


@dataclass(frozen=True, kw_only=True)
class Settings:
    width_m: float = 8.0
    spread_m: float = 2.0

    def __post_init__(self):
        if self.width_m < 1:
            raise ValueError("width_m: expected at least 1 m")


def draw(settings: Settings, rng, plan_id, split):
    wide = settings.width_m + rng.uniform(0, settings.spread_m)
    return FloorPlan(plan_id=plan_id, building=plan_id, floor=plan_id, environment="halls", source="mine", split=split,
                     free=box(0, 0, wide, 5), bounds=Bounds(0, 0, wide, 5))


def elsewhere(rng, plan_id):
    return draw(Settings(), rng, plan_id, None)


def nothing():
    return 4


def broken(rng):
    return rng.no_such_law()
"""

READER = """
from dataclasses import dataclass

import numpy as np

from pipeline.floorplans.plan import FREE, OCCUPIED, GridPlan, Location


@dataclass(frozen=True, kw_only=True)
class Settings:
    wall: str = "#"


class Reader:
    name, patterns, uses = "letters", ("*.letters",), ("metres_per_unit",)

    def __init__(self, settings: Settings) -> None:
        self.wall = settings.wall

    def sniff(self, path):
        return path.suffix == ".letters"

    def accompanies(self, path):
        return False

    def read(self, path, options):
        lines = path.read_text().split()[::-1]
        cells = [[OCCUPIED if letter == self.wall else FREE for letter in line] for line in lines]
        yield GridPlan(plan_id=path.stem, building=path.stem, floor=path.stem, environment="letters", source=path.name,
                       cells=np.array(cells, np.uint8), resolution=options.metres_per_unit, origin=Location(0.0, 0.0))
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"own_{tmp_path.name.replace('-', '_')}"
    (tmp_path / name).mkdir()
    (tmp_path / name / "halls.py").write_text(GENERATOR, encoding="utf-8")
    (tmp_path / name / "letters.py").write_text(READER, encoding="utf-8")
    monkeypatch.setattr("sys.path", list(__import__("sys").path))
    add_to_path(tmp_path)
    get_reusable_executor().shutdown()  # workers take over the path of the moment when they start
    return name


def config(folder: Path, workers: int, **section: object) -> DictConfig:
    counts = {"train": 2, "validation": 0, "test": 1}
    return OmegaConf.create({
        "seed": 3, "artifacts": str(folder), "execution": {"workers": workers, "progress": False},
        "plans": {"counts": counts} | section,
    })  # fmt: skip


def widths(folder: Path) -> dict[str, float]:
    return {plan.plan_id: plan.bounds.max_x for plan, _ in read_plans(folder / "plans" / "plans.parquet")}


def test_an_own_generator_draws_with_its_own_settings_in_every_worker(package: str, tmp_path: Path) -> None:
    section = {"source": f"{package}.halls:draw", "source_settings": {"width_m": 20, "spread_m": 1}}
    for workers in (1, 2):
        assert plans(config(tmp_path / str(workers), workers, **section)).metrics["plans"] == 3
    found = widths(tmp_path / "1")
    assert set(found) == {"halls-train-00000", "halls-train-00001", "halls-test-00000"}
    assert all(20 <= wide <= 21 for wide in found.values())
    assert len(set(found.values())) == 3
    assert found == widths(tmp_path / "2")


def test_an_own_reader_reads_with_its_own_settings(package: str, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for name in ("east", "west"):
        (tmp_path / "in" / f"{name}.letters").write_text("XXXXX\nX...X\nX.X.X\nXXXXX\n", encoding="utf-8")
    (tmp_path / "in" / "notes.md").write_text("nothing", encoding="utf-8")
    section = {"source": "files", "root": str(tmp_path / "in"), "read": {"metres_per_unit": 0.5}}
    own = {"reader": f"{package}.letters:Reader", "reader_settings": {"wall": "X"}}
    assert plans(config(tmp_path / "out", 2, **section, **own)).metrics["plans"] == 2
    (east, west) = (plan for plan, _ in read_plans(tmp_path / "out" / "plans" / "plans.parquet"))
    assert (east.plan_id, west.plan_id, east.resolution) == ("east", "west", 0.5)
    assert east.cells.tolist() == [[1, 1, 1, 1, 1], [1, 0, 1, 0, 1], [1, 0, 0, 0, 1], [1, 1, 1, 1, 1]]


REFUSED = [
    ({"source": "{}.halls:draw", "source_settings": {"widht_m": 3}}, "Did you mean plans.source_settings.width_m?"),
    (
        {"source": "{}.halls:draw", "source_settings": {"width_m": 0.5}},
        "plans.source_settings: width_m: expected at least 1 m",
    ),
    ({"source": "{}.halls:drw"}, "plans.source = {}.halls:drw: module {}.halls has no 'drw'. Did you mean draw?"),
    ({"source": "{}.halls:elsewhere"}, "drew plan 'halls-train-00000' for the split None, asked for"),
    ({"source": "{}.halls:nothing"}, "{}.halls:nothing drew no plan but a int: expected a FloorPlan"),
    ({"source": "{}.halls:broken"}, "{}.halls:broken failed: AttributeError"),
    ({"source": "guided_maze", "source_settings": {"a": 1}}, "plans.source_settings = {{'a': 1}}: expected nothing"),
    ({"source": "halls"}, "plans.source = halls: expected one of guided_maze"),
    ({"source": "files", "root": ".", "reader": "{}.letters:Settings"}, "made a Settings without accompanies and "),
    ({"source": "files", "root": ".", "reader_settings": {"wall": "X"}}, "plans.reader = None takes no settings"),
]


@pytest.mark.parametrize(("section", "expected"), REFUSED)
def test_a_wrong_part_is_one_sentence(section: dict[str, object], expected: str, package: str, tmp_path: Path) -> None:
    filled = {key: value.format(package) if isinstance(value, str) else value for key, value in section.items()}
    with pytest.raises(HinterlandError) as refusal:
        plans(config(tmp_path / "out", 1, **filled))
    assert expected.format(package, package) in str(refusal.value)
    assert not (tmp_path / "out").exists()
