import numpy as np
import shapely

from pipeline.floorplans.plan import Layer, Location, without_margins
from tests.floorplans.samples import KNOWN, cells_of, floor_plan, grid_plan


def test_margins_are_cut_and_everything_else_stays_where_it_is():
    cells = cells_of(KNOWN)
    numbers = np.arange(cells.size, dtype=np.uint16).reshape(cells.shape)
    plan = grid_plan(KNOWN, resolution=0.5, origin=Location(3.0, -1.0), layers={"rooms": Layer(numbers, {1: "hall"})})
    cut = without_margins(plan)
    assert cut.cells.tolist() == cells[:5, 1:7].tolist()
    assert (cut.origin, cut.resolution) == (Location(3.5, -1.0), 0.5)
    assert cut.layers["rooms"].values.tolist() == numbers[:5, 1:7].tolist()
    assert cut.layers["rooms"].labels == {1: "hall"}


def test_what_has_no_margins_is_the_same():
    for plan in (floor_plan(shapely.box(0, 0, 3, 4)), grid_plan(("?????", "?????"))):
        assert without_margins(plan) is plan
    whole = grid_plan(("##", ".#"))
    assert np.array_equal(without_margins(whole).cells, whole.cells)
