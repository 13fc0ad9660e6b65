"""The mouth of a slot that a grid closes is said, though each place in it lies near points."""

import numpy as np
import pytest
from typed import known

import scantruss as st
from scantruss.check.mouths import mouths_closed
from scantruss.surface.samples import sample_surface

SETTINGS = st.Settings(length=1.0, effort="quick", fill_holes=0.0)
MOUTH = 1.4  # width of the slot


def plate(opened: bool) -> np.ndarray:
    """A plate of 10 by 8 with an opening two thirds of a member from its edge, or with a slot from there to the edge."""
    points = np.random.default_rng(5).uniform(0, [10, 8, 0.01], (16_000, 3))
    end = 8.0 if opened else 7.3
    return points[~((np.abs(points[:, 0] - 5.0) < 0.5 * MOUTH) & (points[:, 1] > 4.0) & (points[:, 1] < end))]


@pytest.mark.parametrize("opened", [False, True])
def test_the_mouth_of_a_slot_is_said_where_the_scan_has_no_strip_before_it(opened: bool) -> None:
    cloud = st.PointCloud.from_array(plate(opened))
    whole = st.grid_from_points(plate(opened=False), SETTINGS)
    assert len(whole.boundary_loops) == 2
    grid = whole.replace(nodes=whole.nodes + whole.origin - cloud.origin, origin=cloud.origin)
    samples = sample_surface(cloud, SETTINGS)
    found = mouths_closed(grid, samples, SETTINGS.length)
    assert len(found) == opened
    if opened:
        (warning,) = found
        assert np.linalg.norm(np.array(known(warning.where)) - [5.0, 7.65, 0.0]) < 0.5
        width = float(warning.words.split("the mouth, ")[1].split()[0])
        assert width == pytest.approx(MOUTH, abs=0.25)
        assert mouths_closed(grid, samples, SETTINGS.length, [warning]) == []
