import gzip
import inspect
import sys
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import PlanError
from pipeline.floorplans.readers import (
    BAD,
    COMPANION,
    PLAN,
    READERS,
    UNRECOGNISED,
    classify,
    find_plan_files,
    read_plan_file,
    read_plans,
)
from pipeline.floorplans.readers.mit_campus_grids import MitCampusGrids
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.sources import lone_file, open_source
from tests.floorplans.samples import write_map, write_npz

GREYS = np.array([[254, 254, 0], [205, 0, 254]], dtype=np.uint8)
MAP = "type octile\nheight 1\nwidth 3\nmap\n..@\n"
SCALE = ReadOptions(metres_per_unit=0.5)


def roles(folder: Path, reader: str | None = None) -> dict[str, tuple[str, str | None]]:
    """What each file of a source is, and of which format."""
    with open_source(folder) as files:
        found = classify(files, reader)
    return {entry.file.name: (entry.role, entry.reader.name if entry.reader else None) for entry in found}


def mixed_folder(folder: Path) -> Path:
    write_npz(folder / "a-1_2.npz")
    write_map(folder / "lab", GREYS)
    (folder / "ell.map").write_text(MAP)
    (folder / "ell.map.scen").write_text("version 1\n")
    (folder / "manifest_dev.csv").write_text("file,building\n")
    (folder / "notes.txt").write_text("nothing of interest\n")
    (folder / "broken.npz").write_text("no npz\n")
    return folder


def test_names_are_those_of_the_registry():
    assert all(reader.name == name and reader.patterns for name, reader in READERS.items())
    assert list(READERS)[-1] == "raster_picture"


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
def test_a_reader_declares_the_options_that_its_code_looks_at(reader):
    known = {field.name for field in fields(ReadOptions)}
    code = inspect.getsource(sys.modules[type(reader).__module__])
    looked_at = {name for name in known if f"options.{name}" in code}
    hints = {"door_width_m"} if reader.name == "resplan" else set()  # only in the text of an error
    assert looked_at - hints <= {*reader.uses} <= known


def test_every_file_of_a_folder_is_told_by_its_content(tmp_path):
    assert roles(mixed_folder(tmp_path)) == {
        "a-1_2.npz": (PLAN, "mit_campus_grids"),
        "broken.npz": (BAD, None),
        "ell.map": (PLAN, "moving_ai"),
        "ell.map.scen": (COMPANION, "moving_ai"),
        "lab/map.png": (COMPANION, "raster_picture"),
        "lab/map.yaml": (PLAN, "ros_map_server"),
        "manifest_dev.csv": (COMPANION, None),
        "notes.txt": (UNRECOGNISED, None),
    }


def test_a_named_reader_takes_the_files_that_fit_it(tmp_path):
    found = roles(mixed_folder(tmp_path), "mit_campus_grids")
    assert {name for name, (role, _) in found.items() if role == PLAN} == {"a-1_2.npz", "broken.npz"}
    assert {role for name, (role, _) in found.items() if not name.endswith(".npz")} == {COMPANION, UNRECOGNISED}


def test_a_file_alone_must_be_a_plan(tmp_path):
    (tmp_path / "notes.txt").write_text("nothing of interest\n")
    (entry,) = classify([lone_file(tmp_path / "notes.txt")])
    assert entry.role == BAD
    assert str(entry.problem).startswith(
        f"{tmp_path / 'notes.txt'}: text that begins with 'nothing of interest', which"
    )
    (entry,) = classify([lone_file(tmp_path / "notes.txt")], "svg")
    assert (entry.role, entry.reader) == (PLAN, READERS["svg"])


def test_find_lists_plans_and_what_should_be_one(tmp_path):
    folder = mixed_folder(tmp_path)
    names = [path.relative_to(folder).as_posix() for path in find_plan_files(folder)]
    assert names == ["a-1_2.npz", "broken.npz", "ell.map", "lab/map.yaml"]
    assert find_plan_files(folder / "ell.map") == [folder / "ell.map"]


def test_searching_says_where_nothing_was_found(tmp_path):
    with pytest.raises(PlanError, match="nowhere: no such folder or file"):
        find_plan_files(tmp_path / "nowhere")
    with pytest.raises(PlanError, match=r"no \*.npz in this folder"):
        find_plan_files(tmp_path, "mit_campus_grids")
    with pytest.raises(PlanError, match=r"plans.reader = dwg: no such reader. Choose one of mit_campus_grids"):
        find_plan_files(tmp_path, "dwg")


def test_a_missing_or_unknown_file_is_refused(tmp_path):
    with pytest.raises(PlanError, match=r"no.npz: no such file"):
        read_plan_file(tmp_path / "no.npz")
    (tmp_path / "doors.yaml").write_text("doors: [1, 2]\n")
    with pytest.raises(PlanError, match=r"doors.yaml: YAML with the keys doors, not those of a map.*image"):
        read_plan_file(tmp_path / "doors.yaml")


@dataclass(frozen=True)
class Failing(MitCampusGrids):
    """Fails in a way that no reader should, after a refused record."""

    def read(self, path, options):
        yield PlanError(f"{path}: record 1 is empty.")
        raise ZeroDivisionError("a" * 1000)


def test_the_fault_of_a_reader_is_told_as_such(tmp_path):
    path = write_npz(tmp_path / "a-1_2.npz")
    found = read_plans(lone_file(path), Failing())
    assert str(next(found)) == f"{path}: record 1 is empty."
    with pytest.raises(PlanError, match=r"a-1_2.npz: the reader mit_campus_grids failed \(ZeroDivisionError: a{200}\)"):
        next(found)


def test_plans_and_errors_of_an_unpacked_file_name_the_packed_one(tmp_path):
    path = tmp_path / "ell.map.gz"
    path.write_bytes(gzip.compress(MAP.encode()))
    with open_source(path) as files:
        (entry,) = classify(files)
        (plan,) = read_plans(entry.file, entry.reader, SCALE)
        with pytest.raises(PlanError) as refusal:
            list(read_plans(entry.file, entry.reader))
        refused = next(read_plans(entry.file, Failing()))
    assert (plan.plan_id, plan.source, plan.environment) == ("ell", "ell.map.gz", f"moving_ai_{tmp_path.name}")
    assert str(refusal.value).startswith(f"{path}: cells of such a map have no size")
    assert str(refused) == f"{path}: record 1 is empty."
