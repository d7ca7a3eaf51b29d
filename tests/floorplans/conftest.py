import os
from pathlib import Path

import pytest


@pytest.fixture
def mit_folder() -> Path:
    root = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
    folder = root / "mit_campus_grids" / "dev"
    if not folder.is_dir():
        pytest.skip(f"no MIT floors in {folder}: set HINTERLAND_DATA to the folder that holds mit_campus_grids")
    return folder
