from itertools import islice
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, GridPlan, Location
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers.moving_ai import MovingAi, Scenario, read_scenarios
from pipeline.floorplans.readers.reader import ReadOptions
from tests.floorplans.real_data import plan_files, read_entry
from tests.floorplans.samples import ELL, cells_of
from tests.floorplans.scenario_lengths import lengths_on

SCALE = ReadOptions(metres_per_unit=0.5)

# An L: (column, row from the top) of the three ends.
MAP = ("..@@", "..@@", "...T", "....")
LETTERS = (".G", "S@", "OT", "W.")


def write(folder: Path, lines: tuple[str, ...] = MAP, *, name: str = "ell.map", head: str | None = None) -> Path:
    folder.mkdir(exist_ok=True)
    head = f"type octile\nheight {len(lines)}\nwidth {len(lines[0])}\nmap\n" if head is None else head
    (folder / name).write_text(head + "\n".join(lines) + "\n")
    return folder / name


def read(path: Path) -> GridPlan:
    (plan,) = MovingAi().read(path, SCALE)
    return plan


def test_a_map_is_turned_over_not_mirrored(tmp_path):
    lines = tuple(line.replace("#", "@").replace("d", ".").replace("c", "T") for line in ELL)
    plan = read(write(tmp_path / "dao", lines))
    assert np.array_equal(plan.cells, np.minimum(cells_of(tuple(line.replace("d", ".") for line in ELL)), 1))
    assert (plan.plan_id, plan.building, plan.environment, plan.source) == (
        "ell",
        "ell",
        "moving_ai_dao",
        "dao/ell.map",
    )
    assert (plan.resolution, plan.origin) == (0.5, Location(0.0, 0.0))


def test_letters_are_terrain_and_swamp_is_passable(tmp_path):
    plan = read(write(tmp_path / "dao", LETTERS))
    assert plan.cells.tolist() == [[1, 0], [1, 1], [0, 1], [0, 0]]
    layer = plan.layers["terrain"]
    names = [[layer.labels[value] for value in row] for row in layer.values.tolist()]
    assert names == [["water", "ground"], ["out of bounds", "trees"], ["swamp", "out of bounds"], ["ground", "ground"]]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_line_ends_and_space_behind_the_rows_do_not_matter(tmp_path, end):
    path = tmp_path / "a.map"
    path.write_bytes(f"type octile{end}height 1{end}width 3{end}map{end}.@. {end}{end}".encode())
    assert read(path).cells.tolist() == [[0, 1, 0]]


def test_a_map_read_by_a_bare_name_still_has_its_folder(tmp_path, monkeypatch):
    write(tmp_path / "dao")
    monkeypatch.chdir(tmp_path / "dao")
    assert read(Path("ell.map")).environment == "moving_ai_dao"


def test_a_missing_scale_is_refused_with_the_key_to_set(tmp_path):
    path = write(tmp_path)
    with pytest.raises(PlanError, match=r"ell.map: cells of such a map have no size.*plans.read.metres_per_unit=0.5"):
        read_plan_file(path)


@pytest.mark.parametrize(
    ("head", "lines", "message"),
    [
        ("type octile\nheight 2\nwidth 3\nmap\n", ("...", ".."), "row 2 has 2 letters, expected 2 rows of 3"),
        ("type octile\nheight 2\nwidth 3\nmap\n", ("...",), "1 rows, expected 2 rows of 3"),
        ("type octile\nheight 1\nwidth 3\nmap\n", ("...", "..."), "2 rows, expected 1 rows of 3"),
        (None, ("..x",), "the letter 'x' is no terrain"),
        ("type octile\nheight 0\nwidth 3\nmap\n", ("",), "0 x 3 cells, expected 1 to 36,000,000"),
        ("type octile\nheight 999999\nwidth 999999\nmap\n", ("...",), "999999 x 999999 cells"),
        ("type octile\nmap\n", ("...",), "expected the lines type, height, width and map at its head"),
    ],
)
def test_a_bad_map_gives_one_clear_error(tmp_path, head, lines, message):
    path = write(tmp_path, lines, head=head)
    with pytest.raises(PlanError) as refusal:
        read(path)
    assert str(refusal.value).startswith(f"{path}: ")
    assert message in str(refusal.value)


def test_bytes_that_are_no_letters_give_one_clear_error(tmp_path):
    path = write(tmp_path)
    path.write_bytes(path.read_bytes() + b"\xff")
    with pytest.raises(PlanError, match=r"ell.map: byte \d+ is no letter"):
        read(path)


def scen(folder: Path, *lines: str, head: str = "version 1") -> Path:
    path = folder / "ell.map.scen"
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


def test_scenarios_are_read_and_their_lengths_are_ours(tmp_path):
    path = scen(
        tmp_path,
        "0\tell.map\t4\t4\t0\t0\t1\t1\t1.41421356",
        "1\tell.map\t4\t4\t0\t0\t3\t3\t4.82842712",
        "1 ell.map 4 4 1 0 3 3 4.41421356",
        "",
    )
    scenarios = read_scenarios(path)
    assert [scenario.bucket for scenario in scenarios] == [0, 1, 1]
    assert scenarios[1] == Scenario(1, (0, 0), (3, 3), 4.82842712)
    # The corner at column 2, row 1 is not cut, or the second would be three diagonal moves.
    ours = lengths_on(read(write(tmp_path)), scenarios)
    assert ours == pytest.approx([sqrt(2), 2 + 2 * sqrt(2), 3 + sqrt(2)])
    assert ours == pytest.approx([scenario.octile for scenario in scenarios], abs=1e-7)


@pytest.mark.parametrize(
    "line",
    [
        "1\tell.map\t4\t4\t0\t0\t3",
        "one\tell.map\t4\t4\t0\t0\t3\t3\t5",
        "1\tell.map\t4\t4\t0\t0\t3\t3.5\t5",
        "1\tell.map\t4\t4\t0\t-1\t3\t3\t5",
        "1\tell.map\t4\t4\t0\t0\t3\t3\tnan",
        "1\tell.map\t4\t4\t0\t0\t3\t3\t-1",
        "1\tell.map\t4\t4\t0\t0\t" + "9" * 5000 + "\t3\t1",
    ],
)
def test_a_bad_scenario_is_named_by_its_line(tmp_path, line):
    path = scen(tmp_path, "0\tell.map\t4\t4\t0\t0\t1\t1\t1.41421356", line)
    with pytest.raises(PlanError) as refusal:
        read_scenarios(path)
    assert str(refusal.value).startswith(f"{path}, line 3: ")


def test_a_file_that_is_no_list_of_scenarios_is_refused(tmp_path):
    with pytest.raises(PlanError, match=r"begins with 'type octile', expected 'version 1'"):
        read_scenarios(write(tmp_path))
    (tmp_path / "empty.scen").write_text("")
    with pytest.raises(PlanError, match=r"empty.scen: begins with ''"):
        read_scenarios(tmp_path / "empty.scen")
    with pytest.raises(PlanError, match=r"none.scen: cannot be read"):
        read_scenarios(tmp_path / "none.scen")


def test_scenarios_accompany_maps(tmp_path):
    path, listed = write(tmp_path), scen(tmp_path)
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["moving_ai"]
    assert [name for name, reader in READERS.items() if reader.accompanies(listed)] == ["moving_ai"]
    assert not MovingAi().accompanies(path)


def test_real_lengths_are_ours():
    with plan_files("movingai") as entries:
        small = [entry for entry in entries if entry.file.path.stat().st_size < 20_000]
        listed = [entry for entry in small if entry.file.path.with_name(f"{entry.file.path.name}.scen").is_file()]
        assert len(listed) >= 3
        for entry in islice(listed, 4):
            (plan,) = read_entry(entry, SCALE)
            scenarios = read_scenarios(entry.file.path.with_name(f"{entry.file.path.name}.scen"))
            some = scenarios[:: max(1, len(scenarios) // 15)]
            rows = plan.cells.shape[0]
            assert all(plan.cells[rows - 1 - s.start[1], s.start[0]] == FREE for s in some)
            assert lengths_on(plan, some) == pytest.approx(
                [s.octile for s in some], rel=1e-5
            )  # the files have 6 digits
