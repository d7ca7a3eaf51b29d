"""Small plans for the tests of `hinterland plan`, and a run of it."""

import json
from pathlib import Path

import numpy as np

from pipeline.floorplans.readers import read_plan_file
from pipeline.stages.plan_command import main

SQUARE = [[0, 0], [6, 0], [6, 4], [0, 4]]
# Two rooms of 5 x 4 m with a door of 1 m between them, walls of 20 cm, drawn in centimetres with y down.
HOME = """<svg xmlns="http://www.w3.org/2000/svg" width="1060" height="440">
  <g class="Wall"><polygon points="0,0 1060,0 1060,20 0,20"/></g>
  <g class="Wall"><polygon points="0,420 1060,420 1060,440 0,440"/></g>
  <g class="Wall"><polygon points="0,0 20,0 20,440 0,440"/></g>
  <g class="Wall"><polygon points="1040,0 1060,0 1060,440 1040,440"/></g>
  <g class="Wall"><polygon points="520,0 540,0 540,440 520,440"/>
    <g class="Door"><polygon points="520,100 540,100 540,200 520,200"/></g></g>
  <g class="Space Kitchen"><polygon points="20,20 520,20 520,420 20,420"/></g>
  <g class="Space Bedroom"><polygon points="540,20 1040,20 1040,420 540,420"/></g>
</svg>
"""


def write_home(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(HOME)
    return path


def write_houses(path: Path, *outlines: list, names: tuple[str, ...] = ()) -> Path:
    """One HouseExpo house a line."""
    houses = [
        {
            "id": names[k] if names else f"house-{k}",
            "verts": verts,
            "bbox": {"min": [0, 0], "max": [6, 4]},
            "room_num": 1,
        }
        for k, verts in enumerate(outlines)
    ]
    path.write_text("".join(json.dumps(house) + "\n" for house in houses))
    return path


def cells_in(path: Path) -> np.ndarray:
    (plan,) = read_plan_file(path)
    return plan.cells


def files_in(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def run(capsys, *arguments: object) -> tuple[int, str, str]:
    code = main([str(argument) for argument in arguments])
    told = capsys.readouterr()
    return code, told.out, told.err
