import inspect
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.floorplans.readers import READERS
from pipeline.floorplans.writers import WRITERS
from pipeline.stages import plan_formats
from pipeline.stages.plan_command import build_parser, main
from tests.floorplans.samples import write_map, write_npz
from tests.stages.plan_samples import SQUARE, files_in, run, write_home, write_houses

# --- info


def test_info_prints_what_is_in_a_grid(tmp_path, capsys):
    code, out, err = run(capsys, "info", write_npz(tmp_path / "7-1_3.npz"))
    assert (code, err) == (0, "")
    lines = {line[2:13].strip(): line[14:] for line in out.splitlines()[1:]}
    assert out.startswith("plan 7-1_3\n")
    assert lines["format"] == "mit_campus_grids, from 7-1_3.npz"
    assert lines["size"] == "6.50 x 4.00 m"
    assert lines["scale"] == "0.5 m per cell, 8 rows x 13 columns"
    assert lines["building"] == "MIT-7, floor 7-1, environment mit_floors"
    assert lines["doors"] == "1, 1.50 m wide"
    assert lines["free floor"] == f"{(22 + 3 + 3 + 2 + 3) * 0.25:.1f} m2 in 1 part"
    assert lines["narrowest"] == "1.50 m (door)"


def test_info_counts_rooms_and_doors_of_a_drawing(tmp_path, capsys):
    code, out, _ = run(capsys, "info", write_home(tmp_path / "home.svg"), "--scale", "0.01", "--json")
    (record,) = json.loads(out)
    assert code == 0
    assert record["rooms"] == {"Bedroom": 1, "Kitchen": 1}
    assert (record["format"], record["kind"], record["doors"]) == ("svg", "geometry", 1)
    assert record["door_widths_m"] == [1.0, 1.0]
    assert (record["width_m"], record["height_m"]) == pytest.approx((10.6, 4.4), abs=0.01)
    assert record["free_m2"] == pytest.approx(2 * 5 * 4 + 1 * 0.2, abs=0.3)
    assert (record["free_components"], record["narrowest_m"], record["narrowest_is"]) == (1, 1.0, "door")


def test_info_says_how_much_of_a_laser_map_is_known(tmp_path, capsys):
    grey = np.full((40, 60), 205, dtype=np.uint8)
    grey[10:20, 5:30], grey[12:18, 7:28] = 0, 254
    code, out, _ = run(capsys, "info", write_map(tmp_path / "lab", grey))
    assert code == 0
    assert "size        30.00 x 20.00 m, of which 12.50 x 5.00 m are known\n" in out


def test_info_tells_of_paper_and_takes_it_away_when_told(tmp_path, capsys):
    grey = np.full((40, 60), 255, dtype=np.uint8)
    grey[10:30, 15:45], grey[12:28, 17:43] = 0, 255
    Image.fromarray(grey).save(tmp_path / "house.png")
    _, before, _ = run(capsys, "info", tmp_path / "house.png", "--scale", "0.2")
    assert "warnings    only 81% of the free floor is one connected part" in before
    assert "100% of the border is free: if that is paper around the house and no floor, say --paper\n" in before
    _, after, _ = run(capsys, "info", tmp_path / "house.png", "--scale", "0.2", "--paper")
    assert f"free floor  {16 * 26 * 0.04:.1f} m2 in 1 part\n" in after
    assert "warnings    none\n" in after
    assert f"remarks     {(40 * 60 - 20 * 30) * 0.04:.1f} m2 of free space that reaches the border count as" in after


def test_info_of_a_folder_goes_on_after_a_bad_file_and_ends_with_1(tmp_path, capsys):
    for name in ("7-1_1.npz", "7-1_2.npz"):
        write_npz(tmp_path / name)
    (tmp_path / "7-2_1.npz").write_bytes(b"PK\x03\x04 and nothing more")
    code, out, err = run(capsys, "info", tmp_path)
    assert code == 1
    assert [line for line in out.splitlines() if line.startswith("plan ")] == ["plan 7-1_1", "plan 7-1_2"]
    assert out.splitlines()[-1] == "2 plans, 0 with warnings, 1 refused"
    assert err.count("\n") == 1
    assert err.startswith("error: ")
    assert "7-2_1.npz" in err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["info", "nowhere.dxf"], "error: nowhere.dxf: no such folder or file"),
        (["info", "note.txt"], "error: note.txt: text that begins with 'a note', which is not read. Save the plan as"),
        (["info", "home.svg"], "Set --scale."),
        (["info", "grey.png"], "Give it: --scale 0.05\n"),
        (["info", "home.svg", "--scale", "0.01", "--reader", "sgv"], "--reader sgv: no such reader"),
        (["info", "home.svg", "--free-thresh", "0.9"], "free_thresh = 0.9 is above occupied_thresh = 0.65"),
        (["info", "map.pgm"], "error: map.pgm: a part of a plan, not a plan itself"),
        (["convert", "home.svg", "home.dwg", "--scale", "0.01"], "error: home.dwg: its ending names no format"),
        (["convert", "home.svg", "x", "--to", "dwg", "--scale", "0.01"], "error: --to dwg: no such format"),
        (["convert", "map.yaml", "x.yaml", "--resolution", "0.7"], "error: --resolution 0.7: plan"),
        (["sheet", "home.svg", "sheet.jpg", "--scale", "0.01"], "error: sheet.jpg: a contact sheet is a PNG"),
        (["survey", ".", "--options", "no.yaml"], "error: no.yaml: not a readable YAML file"),
    ],
)
def test_what_is_refused_is_one_clear_line(arguments, expected, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_home(tmp_path / "home.svg")
    (tmp_path / "note.txt").write_text("a note")
    grey = np.pad(np.full((20, 30), 254, dtype=np.uint8), 2)
    Image.fromarray(grey).save(tmp_path / "grey.png")
    write_map(tmp_path, grey, picture="map.pgm")
    before = files_in(tmp_path)
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (1, "")
    assert expected in err
    assert err.count("\n") == 1
    assert err.startswith("error: ")
    assert "plans.re" not in err
    assert files_in(tmp_path) == before


@pytest.mark.parametrize("flags", [["--scale", "0"], ["--scale", "wide"], ["--wall", "nan"], ["--free-thresh", "2"]])
def test_an_impossible_number_names_its_flag(flags, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["info", "x", *flags])
    assert stop.value.code == 2
    assert f"argument {flags[0]}: expected a number from" in capsys.readouterr().err


# --- info --draw


def test_info_draws_one_plan_to_a_png_and_keeps_what_is_there(tmp_path, capsys):
    home, target = write_home(tmp_path / "home.svg"), tmp_path / "home.png"
    assert run(capsys, "info", home, "--scale", "0.01", "--draw", target)[0] == 0
    assert Image.open(target).format == "PNG"
    assert np.asarray(Image.open(target).convert("RGB")).std() > 20
    before = target.read_bytes()
    code, _, err = run(capsys, "info", home, "--scale", "0.02", "--draw", target)
    assert (code, target.read_bytes()) == (1, before)
    assert "exists. Give another name, or --force" in err
    assert run(capsys, "info", home, "--scale", "0.02", "--draw", target, "--force")[0] == 0
    assert target.read_bytes() != before


def test_several_plans_are_drawn_into_a_folder_and_not_to_one_png(tmp_path, capsys):
    houses = write_houses(tmp_path / "houses.jsonl", SQUARE, SQUARE, names=("a", "../../b"))
    code, out, err = run(capsys, "info", houses, "--draw", tmp_path / "all.png")
    assert (code, out) == (1, "")
    assert "several plans" in err
    assert run(capsys, "info", houses, "--draw", tmp_path / "drawn")[0] == 0
    drawn = files_in(tmp_path)
    assert len(drawn) == 3
    assert all(name == "houses.jsonl" or (name.startswith("drawn/") and name.count("/") == 1) for name in drawn)


# --- sheet


def test_a_sheet_does_not_depend_on_the_number_of_workers(tmp_path, capsys):
    folder = tmp_path / "floors"
    for number in range(4):
        write_npz(folder / f"7-{number}_1.npz")
    (folder / "7-9_1.npz").write_bytes(b"PK\x03\x04 and nothing more")
    for workers in (1, 2):
        code, out, err = run(capsys, "sheet", folder, tmp_path / f"{workers}.png", "--workers", workers, "--quiet")
        assert code == 0
        assert out == f"{tmp_path / f'{workers}.png'}: 4 plans, 1 plan left out\n"
        assert err.startswith("left out: ")
    assert (tmp_path / "1.png").read_bytes() == (tmp_path / "2.png").read_bytes()


def test_a_limited_sheet_has_the_first_plans_however_they_lie_in_files(tmp_path, capsys):
    folder = tmp_path / "houses"
    folder.mkdir()
    write_houses(folder / "a.jsonl", SQUARE, [[0, 0], [0.1, 0], [0, 0.1]], SQUARE)
    write_houses(folder / "b.jsonl", SQUARE, SQUARE, names=("b0", "b1"))
    code, out, _ = run(capsys, "sheet", folder, tmp_path / "3.png", "--limit", "3", "--workers", "1", "--quiet")
    assert (code, out) == (0, f"{tmp_path / '3.png'}: 3 plans, 1 plan left out\n")


def test_a_sheet_for_each_data_set_with_its_own_scale(tmp_path, capsys):
    write_npz(tmp_path / "data" / "campus" / "7-1_1.npz")
    write_home(tmp_path / "data" / "homes" / "home.svg")
    (tmp_path / "data" / "notes").mkdir()
    (tmp_path / "data" / "notes" / "note.txt").write_text("a note")
    (tmp_path / "scales.yaml").write_text("homes: {metres_per_unit: 0.01}\n")
    code, out, err = run(
        capsys, "sheet", tmp_path / "data", tmp_path / "sheets", "--data-sets", "--options",
        tmp_path / "scales.yaml", "--workers", "1", "--quiet",
    )  # fmt: skip
    assert code == 0
    assert files_in(tmp_path / "sheets") == ["campus.png", "homes.png"]
    assert "notes" in err
    assert out.count(": 1 plan\n") == 2


# --- survey


def test_a_survey_counts_with_the_options_of_each_data_set(tmp_path, capsys):
    write_npz(tmp_path / "data" / "campus" / "7-1_1.npz")
    write_home(tmp_path / "data" / "homes" / "home.svg")
    (tmp_path / "scales.yaml").write_text("homes: {metres_per_unit: 0.01, levels: [1, 2], reader: svg}\n")
    tables = []
    for workers in (1, 2):
        code, out, _ = run(
            capsys, "survey", tmp_path / "data", "--options", tmp_path / "scales.yaml", "--workers", workers, "--quiet"
        )
        assert code == 0
        tables.append([line.split()[:-1] for line in out.splitlines()])
    assert tables[0] == tables[1]
    assert tables[0][1][:3] == ["campus", "1", "1"]
    assert tables[0][2][:2] == ["homes", "1"]
    assert run(capsys, "survey", tmp_path / "data", "--workers", "1", "--quiet")[1].count("homes: ") == 1  # no scale


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("campus: {scale: 0.05}", "unknown key campus.scale"),
        ("campus: {metre_per_unit: 0.05}", "Did you mean metres_per_unit?"),
        ("campus: {metres_per_unit: -1}", "campus.metres_per_unit: expected a number from 1e-06 to 1000, got -1"),
        ("campus: {invert: 1}", "campus.invert: expected true or false, got 1"),
        ("campus: {reader: png}", "campus.reader = png: no such reader"),
        ("campuss: {invert: true}", "no data set is named campuss; there are campus"),
        ("[1, 2]", "expected a mapping of folder names to options"),
        ("!!python/object:os.system {}", "not a readable YAML file"),
    ],
)
def test_wrong_options_of_data_sets_are_named(text, expected, tmp_path, capsys):
    write_npz(tmp_path / "data" / "campus" / "dev" / "7-1_1.npz")
    (tmp_path / "options.yaml").write_text(text)
    code, out, err = run(capsys, "survey", tmp_path / "data", "--options", tmp_path / "options.yaml", "--quiet")
    assert (code, out) == (1, "")
    assert expected in err
    assert err.count("\n") == 1


# --- formats


def test_all_formats_are_listed_with_a_description(capsys):
    code, out, _ = run(capsys, "formats")
    assert code == 0
    named = {line.split()[0]: line for line in out.splitlines() if line and not line[0].isspace()}
    assert {*READERS} | {*WRITERS} <= {*named}
    assert "hinterland[ifc]" in named["ifc"]
    assert "needed" in named["svg"]
    assert all(len(plan_formats.describe(reader)) > 15 for reader in READERS.values())


def test_the_scale_column_knows_which_readers_use_the_option():
    using = {
        name
        for name, reader in READERS.items()
        if "options.metres_per_unit" in (text := inspect.getsource(sys.modules[type(reader).__module__]))
        or "scale_of(" in text
    }
    assert using == {*plan_formats.SCALE}


# --- the command itself


def test_the_installed_command_runs_and_starts_without_the_heavy_packages(tmp_path):
    floor = write_npz(tmp_path / "7-1_3.npz")
    command = [str(Path(sys.executable).with_name("hinterland")), "plan"]
    done = subprocess.run([*command, "info", str(floor)], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "size        6.50 x 4.00 m" in done.stdout
    failed = subprocess.run([*command, "info", "nothing.npz"], capture_output=True, text=True, cwd=tmp_path)
    assert (failed.returncode, failed.stdout) == (1, "")
    assert failed.stderr == "error: nothing.npz: no such folder or file. Give the folder that holds the plans.\n"
    code = (
        "import sys; from pipeline.stages.plan_command import main; "
        f"main(['info', {str(floor)!r}]); "
        "print(*sorted({'torch', 'mlflow', 'dvc', 'lightning', 'pandas', 'matplotlib'} & {*sys.modules}), 'end')"
    )
    heavy = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert heavy.stdout.splitlines()[-1].strip() == "end"


def test_help_names_every_command(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    out = capsys.readouterr().out
    assert all(f"    {name} " in out for name in ("info", "convert", "sheet", "survey", "formats"))


def test_the_page_shows_commands_that_exist_and_pictures_that_are_there():
    page = Path(__file__).parents[2] / "docs" / "bring-your-own-floor-plan.md"
    text = page.read_text(encoding="utf-8")
    commands = [
        shlex.split(line, comments=True)[2:] for line in re.findall(r"^hinterland plan .*$", text, re.MULTILINE)
    ]
    bodies = {build_parser().parse_args(command).body[1] for command in commands}
    assert bodies == {"info", "convert", "sheet"}
    pictures = [page.parent / name for name in re.findall(r"\]\((images/[^)]+)\)", text)]
    assert len(pictures) == 6
    assert all(0 < picture.stat().st_size < 150_000 for picture in pictures)
    assert all(f"`{name}`" in text for name in READERS if name in plan_formats.SCALE and name != "luperto")
