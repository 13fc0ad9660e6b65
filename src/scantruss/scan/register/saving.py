"""What a splice writes beside its cloud: poses and how well every two scans agree."""

from __future__ import annotations

from typing import Any

from .pose_file import pose_values
from .run import Splice


def splice_values(splice: Splice) -> dict[str, Any]:
    """Return the poses and the agreement of the pairs as plain values; `read_poses` takes them back."""
    scans = {}
    for name, pose in splice.poses.items():
        scans[name] = pose_values(pose) | {"kept": splice.kept[name]}
    return {
        "format": "scantruss poses",
        "convention": "common = matrix @ (x, y, z, 1) of the scan's own frame; quaternion x, y, z, w",
        "frame": splice.frame,
        "unit": splice.unit,
        "spacing": splice.spacing,
        "scans": scans,
        "pairs": [
            {
                "scans": [pair.first, pair.second],
                "overlap": pair.overlap,
                "agreement": pair.agreement,
                "residual": pair.residual,
                "residual_spacings": None if pair.residual is None else pair.residual / splice.spacing,
            }
            for pair in splice.pairs
        ],
        "left_out": list(splice.left_out),
        "doubtful": list(splice.doubtful),
    }
