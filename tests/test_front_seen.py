"""A front is seen while it advances, and comes out the same as unseen."""

import numpy as np

import scantruss as st
from scantruss.runtime.progress import WatchedProgress, seer_of


def test_a_front_that_is_seen_is_the_same() -> None:
    points = np.random.default_rng(2).uniform(0, 12, (6000, 2))
    cloud = np.column_stack([points, 0.3 * np.sin(points[:, 0] / 3)]) + [4.5e5, 5.3e6, 0.0]
    settings = st.Settings(length=0.9, effort="quick")
    looks: list[tuple[np.ndarray, np.ndarray]] = []
    stages: list[str] = []
    progress = WatchedProgress(
        lambda stage, share: stages.append(stage), lambda nodes, triangles: looks.append((nodes, triangles))
    )
    seen = st.grid_from_points(cloud, settings, progress=progress)
    plain = st.grid_from_points(cloud, settings)
    assert np.array_equal(seen.nodes, plain.nodes) and np.array_equal(seen.triangles, plain.triangles)
    counts = [len(triangles) for _, triangles in looks]
    assert len(looks) > 3 and counts == sorted(counts) and 0 < counts[0] < counts[-1] and "front" in stages
    for nodes, triangles in looks:
        assert triangles.max() < len(nodes)
        assert np.abs(nodes[triangles].mean(axis=(0, 1)) - cloud.mean(axis=0)).max() < 12
    assert seer_of(None) is None and seer_of(lambda stage, share: None) is None
