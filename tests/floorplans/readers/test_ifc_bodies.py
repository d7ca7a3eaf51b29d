import numpy as np
import pytest

from pipeline.floorplans.readers.ifc_bodies import _section

CORNERS = np.array([[5.9, -0.1], [6.1, -0.1], [6.1, 4.1], [5.9, 4.1]])


def wall(low: float, high: float) -> np.ndarray:
    """The triangles of a wall of 0.2 x 4.2 m; where two of them meet, they list the edge in opposite directions."""
    foot, top = (np.hstack([CORNERS, np.full((4, 1), z)]) for z in (low, high))
    faces = []
    for k in range(4):
        n = (k + 1) % 4
        faces += [[foot[k], foot[n], top[n]], [top[k], foot[k], top[n]]]
    for face in (foot, top):
        faces += [[face[0], face[1], face[2]], [face[2], face[3], face[0]]]
    return np.array(faces)


@pytest.mark.parametrize("high", [2.5, 3.0, 7.0, 8.0])
def test_a_wall_is_cut_at_every_height(high):
    """Points on the diagonals of its faces round to the same place from both sides, wherever they fall."""
    heights = np.arange(0.05, high, 0.05)
    areas = [_section(wall(0.0, high), float(height)).area for height in heights]
    assert areas == pytest.approx([0.84] * len(heights))


def test_a_body_that_is_not_closed_has_no_area():
    assert _section(wall(0.0, 3.0)[2:], 1.1).is_empty
    assert _section(wall(0.0, 3.0), 3.5).is_empty
