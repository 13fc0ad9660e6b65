"""Parts of a scan that only links across a gap hold together are pieces of their own."""

import numpy as np
import pytest
from small_clouds import ring, samples_of, sheet

import scantruss as st
from scantruss.boundary.parts import parted
from scantruss.surface.samples import SurfaceSamples

GAP = 0.65  # between two sheets: less than a member, and than links reach


def outline(left: float, right: float, top: float) -> np.ndarray:
    """A closed curve around a rectangle, of small steps."""
    x, y = np.arange(left, right, 0.05), np.arange(-top, top, 0.05)
    sides = ((x, -top + 0 * x), (right + 0 * y, y), (x[::-1], top + 0 * x), (left + 0 * y, y[::-1]))
    return np.concatenate([np.stack([*side, np.zeros(len(side[0]))], axis=1) for side in sides])


def two_sheets() -> tuple[SurfaceSamples, list[np.ndarray]]:
    """Samples of two sheets side by side, and the curves around them relative to the origin of the samples."""
    one = sheet(8, 8, 0.1)
    samples = samples_of(np.concatenate([one - (4 + GAP / 2, 0, 0), one + (4 + GAP / 2, 0, 0)]))
    curves = [outline(-8 - GAP / 2, -GAP / 2, 4), outline(GAP / 2, 8 + GAP / 2, 4)]
    return samples, [curve - samples.origin for curve in curves]


def test_what_is_joined_across_a_gap_alone_is_parted() -> None:
    samples, curves = two_sheets()
    assert samples.pieces == (0,)
    parts = parted(samples, curves)
    assert parts.pieces == (0, 1)
    east = parts.surface.mean[:, 0] + parts.origin[0] > 0
    assert len({*parts.piece[east]}) == len({*parts.piece[~east]}) == 1
    for sample, beside in enumerate(parts.surface.neighbors):
        left = beside[beside >= 0]
        assert (east[left] == east[sample]).all() and (beside[: len(left)] >= 0).all()
        was = samples.surface.neighbors[sample]
        assert {*left} == {k for k in was[was >= 0] if east[k] == east[sample]}


def test_one_boundary_parts_nothing() -> None:
    samples, curves = two_sheets()
    assert parted(samples, curves[:1]) is samples
    assert parted(samples, []) is samples


@pytest.mark.parametrize("width", [0.5, 0.7, 1.2])
def test_a_narrow_ring_is_one_piece(width: float) -> None:
    """Its boundaries are as near each other as those on either side of a gap, but there are samples in between."""
    samples = samples_of(ring(6.0 - width, 6.0, 0.1))
    angle = np.linspace(0, 2 * np.pi, 900, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert parted(samples, [6.0 * circle - samples.origin, (6.0 - width) * circle - samples.origin]) is samples


def plate_under_flap(tilt: float, gap: float) -> np.ndarray:
    """Points of a plate with a round hole and of a dome over it, as a scan from above shows both: tilted, and `gap` away on one side."""
    rng = np.random.default_rng(3)
    plate = rng.uniform(-8, 8, (30_000, 2))
    plate = plate[np.hypot(*plate.T) > 3.0]
    around = rng.normal(size=(30_000, 3))
    around /= np.linalg.norm(around, axis=1)[:, None]
    radius, low = 3.0 - gap, 0.2
    dome = (around[around[:, 2] > low] - (0, 0, low)) * radius / np.sqrt(1 - low**2)
    dome = dome[: int(1.2 * 2 * np.pi * radius**2 / 256 * len(plate))]
    turn, hinge = np.radians(tilt), np.array([-radius, 0, 0])
    about = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
    return np.concatenate([np.column_stack([plate, 0 * plate[:, 0]]), (dome - hinge) @ about.T + hinge])


def test_a_part_behind_a_gap_gets_its_grid() -> None:
    """The front of the plate never reached it, as no boundary of it was taken for an outer one."""
    points = plate_under_flap(40.0, 0.7)
    grid = st.grid_from_points(points, st.Settings(length=1.0))
    assert grid.certificate is not None and grid.certificate.passed and grid.certificate.missing < 0.01
    assert len(grid.boundary_loops) == 3
