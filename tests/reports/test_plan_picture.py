import numpy as np
import pytest
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from PIL import Image

from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import Door, FloorPlan, GridPlan, Location, Room
from pipeline.reports.plan_looks import DOOR, FURNITURE, TINTS, UNSEEN, WALL
from pipeline.reports.plan_picture import draw_plan, write_plan_picture
from tests.floorplans.samples import KNOWN, floor_plan, grid_plan

FLAG = shapely.union_all([shapely.box(0, 0, 20, 4), shapely.box(0, 4, 6, 10)])
PILLAR = shapely.box(10, 1, 12, 3)
WHITE = (255, 255, 255)


class Picture:
    """A drawn plan that is asked by places in its world frame."""

    def __init__(self, plan: FloorPlan | GridPlan) -> None:
        self.figure = draw_plan(plan, inspect(plan))
        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()
        self.pixels = np.asarray(canvas.buffer_rgba())[..., :3]

    def at(self, x: float, y: float) -> tuple[int, ...]:
        col, row = self.figure.axes[0].transData.transform((x, y))
        return tuple(self.pixels[self.pixels.shape[0] - 1 - int(row), int(col)].tolist())

    def words(self) -> list[str]:
        axes = self.figure.axes[0]
        legend = [text.get_text() for text in self.figure.legends[0].get_texts()]
        return [*legend, *(text.get_text() for text in axes.texts), axes.get_title(loc="left")]


def test_geometry_is_drawn_where_it_is():
    picture = Picture(floor_plan(FLAG.difference(PILLAR)))
    assert [picture.at(*spot) for spot in ((3, 9), (17, 1), (8, 2))] == [WHITE] * 3
    assert [picture.at(*spot) for spot in ((17, 9), (7, 9), (11, 2))] == [WALL] * 3  # beyond the flag, and the pillar


def test_the_axes_are_in_metres_and_equal():
    picture = Picture(floor_plan(FLAG))
    corners = picture.figure.axes[0].transData.transform([(0, 0), (20, 0), (0, 10)])
    across, up = np.hypot(*(corners[1] - corners[0])), np.hypot(*(corners[2] - corners[0]))
    assert across / up == pytest.approx(2.0, rel=1e-3)
    assert picture.words()[-1] == "drawn: 20.0 x 10.0 m"


def test_cells_are_drawn_where_they_are():
    picture = Picture(grid_plan(KNOWN, resolution=1.0, origin=Location(5.0, -2.0)))
    spots = {(x, y): picture.at(5 + x + 0.5, -2 + y + 0.5) for x, y in ((2, 1), (2, 3), (3, 2), (5, 0), (6, 0), (1, 4))}
    assert spots[2, 3] == WHITE
    assert spots[3, 2] == FURNITURE
    assert spots[5, 0] == spots[6, 0] == UNSEEN
    assert spots[2, 1] == WHITE
    assert spots[1, 4] == WALL
    assert {"unknown", "furniture"} <= {*picture.words()}


def test_unknown_margins_are_left_out_and_the_size_is_that_of_what_is_known():
    wide = tuple(f"????{line}" for line in ("?" * 40, *(f"{line:?<40}" for line in KNOWN), "?" * 40))
    picture = Picture(grid_plan(wide, resolution=1.0, origin=Location(5.0, -2.0)))
    assert picture.words()[-1] == "drawn: 6.0 x 5.0 m"
    assert picture.at(5 + 4 + 2.5, -2 + 1 + 3.5) == WHITE


def test_cut_off_parts_are_tinted_and_counted():
    both = shapely.union_all([shapely.box(0, 0, 10, 10), shapely.box(11, 0, 15, 10), shapely.box(11, 11, 12, 12)])
    picture = Picture(floor_plan(both))
    assert picture.at(5, 5) == WHITE
    assert picture.at(13, 5) == TINTS[0]
    assert picture.at(11.5, 11.5) == TINTS[1]
    assert "2 cut-off parts" in picture.words()
    assert not any("cut-off" in word for word in Picture(floor_plan(FLAG)).words())


def test_a_door_is_a_disc_as_wide_as_the_door():
    picture = Picture(floor_plan(FLAG, doors=(Door(15.0, 2.0, 2.0),)))
    on_white = tuple(round(255 * (0.65 * part + 0.35)) for part in to_rgb(DOOR))
    for spot in ((15.0, 2.0), (15.9, 2.0), (15.0, 1.1)):
        assert picture.at(*spot) == pytest.approx(on_white, abs=3)
    assert picture.at(16.2, 2.0) == WHITE
    assert "door" in picture.words()


def test_rooms_are_named_as_they_are_called_even_with_a_dollar():
    rooms = (Room(shapely.box(0, 0, 20, 4), "hall $x$"), Room(shapely.box(0, 4, 6, 10), ""))
    assert "hall $x$" in Picture(floor_plan(FLAG, rooms=rooms)).words()


def test_the_png_is_written_whole_and_the_same_each_time(tmp_path):
    plan = floor_plan(FLAG)
    for name in ("one.png", "two.png"):
        assert write_plan_picture(plan, inspect(plan), tmp_path / "seen" / name, dpi=40).name == name
    assert (tmp_path / "seen/one.png").read_bytes() == (tmp_path / "seen/two.png").read_bytes()
    assert Image.open(tmp_path / "seen/one.png").size[0] > 200
    assert sorted(path.name for path in (tmp_path / "seen").iterdir()) == ["one.png", "two.png"]
