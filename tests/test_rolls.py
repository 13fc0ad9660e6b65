"""The disc that is rolled along the edge of a scan."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from small_clouds import sheet, sites_of

from scantruss.kernels.boundary import has_gap


@pytest.mark.kernels
@given(st.lists(st.tuples(st.floats(-180, 180), st.floats(0.2, 1.0)), max_size=9), st.floats(20, 85))
def test_a_site_has_a_gap_where_no_neighbour_lies_for_more_than_an_angle(others, widest):
    angles = np.radians([angle for angle, _ in others])
    turns = np.sort(angles % (2 * np.pi))
    gaps = np.diff(turns, append=turns[:1] + 2 * np.pi)
    assume(np.abs(gaps - np.radians(widest)).min(initial=1.0) > 1e-6)
    far = np.array([distance for _, distance in others])
    around = np.stack([far * np.cos(angles), far * np.sin(angles), 0.1 * far], axis=1)
    mean = np.concatenate([np.zeros((1, 3)), around])
    links = np.full((len(mean), 9), -1)
    links[0, : len(others)] = np.arange(1, len(mean))
    surface = sites_of(sheet(3, 3, 0.2)).surface._replace(mean=mean, neighbors=links)
    found = has_gap(surface, 0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), np.radians(widest), np.empty((9, 3)))
    assert found == bool((gaps > np.radians(widest)).any())
