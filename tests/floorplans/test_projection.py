import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod
from shapely.geometry import LineString, Point, Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans.projection import LocalFrame, frame_around

WGS84 = Geod(ellps="WGS84")
PLACES = [(13.7232, 51.0254), (-71.09, 42.36), (120.13, 30.3), (-70.6, -33.4), (25.0, 69.9), (0.0, 0.0), (179.9, 5.0)]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("azimuth", [0.0, 37.0, 90.0, 180.0, 285.0])
@pytest.mark.parametrize("length", [1.0, 300.0, 2000.0])
def test_lengths_and_directions_are_those_of_geodesics(place, azimuth, length):
    start = (place[0] + 0.001, place[1] - 0.002)
    east, north, _ = WGS84.fwd(*start, azimuth, length)
    line = LocalFrame(*place).to_metres(LineString([start, (east, north)]))
    assert line.length == pytest.approx(length, rel=1e-5)
    x, y = np.diff(shapely.get_coordinates(line), axis=0)[0]
    assert abs((np.degrees(np.arctan2(x, y)) - azimuth + 180) % 360 - 180) < 0.05


def test_east_is_x_and_north_is_y():
    frame = LocalFrame(13.7, 51.0)
    east, north = (frame.to_metres(Point(*spot)) for spot in ((13.701, 51.0), (13.7, 51.001)))
    assert east.x > 60
    assert abs(east.y) < 0.01
    assert north.y > 100
    assert abs(north.x) < 0.01
    assert frame.to_metres(Point(13.7, 51.0)).equals_exact(Point(0, 0), 1e-9)


@pytest.mark.parametrize("place", PLACES)
def test_areas_are_those_of_geodesics_and_keep_their_turn(place):
    ring = Polygon(np.add(place, [(0, 0), (0.002, 0), (0.002, 0.001), (0.001, 0.001), (0.001, 0.002), (0, 0.002)]))
    area, _ = WGS84.geometry_area_perimeter(ring)
    plan = LocalFrame(*place).to_metres(ring)
    assert plan.area == pytest.approx(area, rel=1e-5)
    assert plan.exterior.is_ccw == ring.exterior.is_ccw


@settings(max_examples=50, deadline=None)
@given(st.floats(-179, 179), st.floats(-84, 84), st.floats(-2000, 2000), st.floats(-2000, 2000))
def test_there_and_back_again(longitude, latitude, x, y):
    frame = LocalFrame(longitude, latitude)
    back = frame.to_metres(frame.to_degrees(Point(x, y)))
    assert (back.x, back.y) == pytest.approx((x, y), abs=1e-5)


def test_the_frame_stands_in_the_middle():
    frame = frame_around([box(10, 50, 10.01, 50.02), Point(10.03, 50.01)])
    assert (frame.longitude, frame.latitude) == pytest.approx((10.015, 50.01))


@pytest.mark.parametrize(
    ("shapes", "longitude"),
    [
        (
            [box(179.99, -16.8, 180, -16.77), box(-180, -16.8, -179.98, -16.77)],
            -179.995,
        ),  # cut in two, as RFC 7946 wants
        ([box(179.99, -16.8, 180.02, -16.77)], -179.995),  # on beyond 180
        ([box(-180.04, -16.8, -179.99, -16.77)], 179.985),
        ([box(190.25, -16.8, 190.27, -16.77)], -169.74),  # from 0 to 360
        ([LineString([(179.97, 5), (-179.99, 5.03)])], 179.99),
    ],
)
def test_a_frame_on_the_180th_meridian_stands_among_its_shapes(shapes, longitude):
    frame = frame_around(shapes)
    assert frame.longitude == pytest.approx(longitude)
    west, _, east, _ = shapely.total_bounds([frame.to_metres(shape) for shape in shapes])
    middle, across = (west + east) / 2, east - west
    assert middle == pytest.approx(0, abs=2)
    assert 1_900 < across < 6_000


@pytest.mark.parametrize(("west", "east"), [(179.9995, -179.9995), (-179.9995, 179.9995), (180.0005, 179.9995)])
def test_lengths_across_the_180th_meridian_are_those_of_geodesics(west, east):
    _, _, length = WGS84.inv(west, -16.8, east, -16.8)
    line = LocalFrame(180.0, -16.8).to_metres(LineString([(west, -16.8), (east, -16.8)]))
    assert line.length == pytest.approx(length, rel=1e-5)
    assert length == pytest.approx(106.6, rel=0.01)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (box(413000, 5654000, 413100, 5654100), "413000.*expected degrees of longitude and latitude"),
        (Point(30.3, 120.1), "expected degrees"),  # a Chinese latitude and longitude in the wrong order
        (Point(10, 89), "expected degrees"),
        (Polygon(), "nothing with coordinates"),
    ],
)
def test_what_cannot_be_degrees_is_refused(shape, said):
    with pytest.raises(PlanError, match=said):
        frame_around([shape])


def test_nothing_to_project_is_refused():
    with pytest.raises(PlanError, match="nothing with coordinates"):
        frame_around([])


@pytest.mark.parametrize("far", [(13.9, 51.0), (13.7, 51.06), (np.nan, 51.0), (np.inf, 51.0)])
def test_what_lies_too_far_is_refused(far):
    with pytest.raises(PlanError, match=r"more than 0\.05 degrees from \(13\.7, 51\).*Remove"):
        LocalFrame(13.7, 51.0).to_metres(Point(far))
