import numpy as np
import pytest
import shapely
from PIL import Image, ImageColor

from pipeline.floorplans.plan import Door
from pipeline.reports.contact_sheet import Tile, draw_tile, tile_size, write_contact_sheet
from pipeline.reports.plan_looks import DOOR, SPLINTER, TINTS, WALL
from pipeline.reports.style import INK
from tests.floorplans.samples import KNOWN, floor_plan, grid_plan

# A hall with an arm at its upper left: turned over or mirrored, the arm is elsewhere.
FLAG = shapely.union_all([shapely.box(0, 0, 20, 4), shapely.box(0, 4, 6, 10)])


def quarters(image: np.ndarray) -> dict[str, float]:
    """Mean brightness of the four corners of a picture; the top is row 0."""
    rows, cols = (length // 2 for length in image.shape[:2])
    grey = image.mean(axis=2)
    return {
        "upper left": grey[:rows, :cols].mean(),
        "upper right": grey[:rows, cols:].mean(),
        "lower left": grey[rows:, :cols].mean(),
        "lower right": grey[rows:, cols:].mean(),
    }


def near(image: np.ndarray, colour: str, tolerance: int = 60) -> np.ndarray:
    return np.abs(image.astype(int) - ImageColor.getrgb(colour)).sum(axis=2) < tolerance


def test_geometry_is_neither_mirrored_nor_upside_down():
    corners = quarters(draw_tile(floor_plan(FLAG), 200).image)
    assert min(corners, key=corners.get) == "upper right"
    assert corners["upper left"] > corners["upper right"] + 50


def test_cells_are_neither_mirrored_nor_upside_down():
    lines = ("####....", "####....", "########", "########")
    corners = quarters(draw_tile(grid_plan(lines), 80).image)
    assert max(corners, key=corners.get) == "upper right"
    assert corners["lower left"] == pytest.approx(np.mean(WALL), abs=1)


def test_a_tile_has_the_asked_side_and_says_its_scale():
    tile = draw_tile(floor_plan(FLAG), 200, name="flag")
    assert tile.image.shape == (100, 200, 3)
    assert tile.metres_per_pixel == pytest.approx(0.1)
    white = (tile.image > 250).all(axis=2).sum() * tile.metres_per_pixel**2
    assert white == pytest.approx(FLAG.area, rel=0.05)
    assert draw_tile(grid_plan(KNOWN), 100).name == "drawn"


def test_a_wall_thinner_than_a_pixel_stays_dark():
    wall = shapely.box(49.9, 0, 50.0, 100)
    image = draw_tile(floor_plan(shapely.box(0, 0, 100, 100).difference(wall)), 100).image
    assert image[50, 45:55].min() < 150
    lines = ("." * 200 + "#" + "." * 199,) * 400
    assert draw_tile(grid_plan(lines), 100).image[50, 45:55].min() < 150


def test_a_cut_off_room_is_tinted_and_the_hall_is_white():
    both = shapely.union_all([shapely.box(0, 0, 10, 10), shapely.box(11, 0, 15, 10)])
    tile = draw_tile(floor_plan(both), 150)
    assert tuple(tile.image[50, 50]) == (255, 255, 255)
    assert tuple(tile.image[50, 130]) == TINTS[0]
    cells = grid_plan(("##########", "#.....#..#", "##########"))
    assert tuple(draw_tile(cells, 100).image[15, 75]) == TINTS[0]


def test_unknown_margins_are_left_out():
    bare = ("####..", "#...?.", "######")
    wide = ("?" * 16, "?" * 16, *(f"???{line}{'?' * 7}" for line in bare), "?" * 16)
    expected, tile = draw_tile(grid_plan(bare), 120), draw_tile(grid_plan(wide), 120)
    assert np.array_equal(tile.image, expected.image)
    assert tile.metres_per_pixel == expected.metres_per_pixel
    assert draw_tile(grid_plan(("????", "????")), 100).image.shape == (50, 100, 3)


@pytest.mark.parametrize("plan", [floor_plan(shapely.box(0, 0, 20, 10)), grid_plan(("....", "...."))])
def test_a_line_runs_around_a_floor_that_reaches_the_edge(plan):
    image = draw_tile(plan, 100).image
    for side in (image[0], image[-1], image[:, 0], image[:, -1]):
        assert (side == WALL).all()
    assert (image[1:-1, 1:-1] == 255).all()


def test_doors_are_ringed_where_they_are_and_splinters_differ():
    plan = floor_plan(FLAG, doors=(Door(3.0, 4.0, 1.2), Door(15.0, 2.0, 0.2)))
    image = draw_tile(plan, 400).image
    rows, cols = np.nonzero(near(image, DOOR))
    assert (cols.mean() / 20, (200 - rows.mean()) / 20) == pytest.approx((3.0, 4.0), abs=0.1)
    rows, cols = np.nonzero(near(image, SPLINTER))
    assert (cols.mean() / 20, (200 - rows.mean()) / 20) == pytest.approx((15.0, 2.0), abs=0.1)


def test_the_bar_of_a_tile_is_as_long_as_it_says(tmp_path):
    tile = Tile("a", np.full((100, 200, 3), 255, dtype=np.uint8), metres_per_pixel=0.1)
    image = np.asarray(Image.open(write_contact_sheet([tile], tmp_path / "sheet.png")))
    below = (np.abs(image[115:125].astype(int) - ImageColor.getrgb(INK)).sum(axis=2) == 0).sum(axis=1).max()
    assert below * 0.1 == pytest.approx(5.0, abs=0.2)  # of 1, 2, 5, 10 m the longest below a third of the tile


def test_a_sheet_holds_every_tile_in_reading_order(tmp_path):
    greys = [10 * (k + 1) for k in range(7)]
    tiles = [Tile(f"t{grey}", np.full((60, 60, 3), grey, dtype=np.uint8), 0.1) for grey in greys]
    path = write_contact_sheet(tiles, tmp_path / "deep" / "sheet.png", title="seven", columns=3)
    image = np.asarray(Image.open(path)).astype(int)
    places = []
    for grey in greys:
        rows, cols = np.nonzero((image == grey).all(axis=2))
        assert len(rows) >= 60 * 60
        places.append((rows.min() // 80, cols.min() // 60))
    assert places == sorted(places)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["sheet.png"]


def test_a_sheet_of_nothing_is_refused(tmp_path):
    with pytest.raises(ValueError, match="at least one plan"):
        write_contact_sheet([], tmp_path / "sheet.png")


def test_the_more_plans_the_smaller_the_tiles():
    sizes = [tile_size(count) for count in (1, 40, 400, 4000)]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > 2 * sizes[-1] > 100
