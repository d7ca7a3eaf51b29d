import numpy as np

from pipeline.stages.plan_command import main
from tests.floorplans.samples import write_map
from tests.floorplans.test_statistics import on_cells


def test_floors_are_drawn_and_one_variant_of_each_real_one_is_read(tmp_path, capsys):
    values = on_cells("semantics", {"CORRIDOR": 3, "STAIRS": 3, "OFFICE": 4, "LAB": 4, "CLASSROOM": 4}, {})
    semantic = values.layers["semantics"].values.astype(np.uint8)[::-1]
    for name in ("7-1_1001", "7-1_1002", "7-2_1003"):
        np.savez(
            tmp_path / f"{name}.npz",
            occ_grid=(semantic == 0).astype(np.uint8),
            semantic_grid=semantic,
            semantic_labels=np.array(["background", "clutter", "door", "hallway", "room"]),
            resolution=np.float64(0.1),
        )
    assert main(["statistics", str(tmp_path), "--floors", "3"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"| statistic | campus | {tmp_path} |"
    assert lines[2] == "| floors | 3 | 2 |"
    assert lines[6].startswith("| room size [m2] | ") and lines[6].endswith(" | 20 / **20** / 29 |")


def test_plans_without_marked_rooms_are_refused(tmp_path, capsys):
    write_map(tmp_path, np.full((90, 90), 254, np.uint8))
    assert main(["statistics", str(tmp_path), "--floors", "1"]) == 1
    assert "no layer says which cells are rooms" in capsys.readouterr().err
