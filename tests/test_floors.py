"""A shell that stands on its floor, joined to it, is refused with the very crop that gives a grid."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from marks import compiled_only

from scantruss.cli.main import main
from scantruss.surface.supports import floor_below


def barrel_on_a_floor(rng: np.random.Generator) -> np.ndarray:
    turn, x = rng.uniform(0, np.pi, 9_000), rng.uniform(0, 30, 9_000)
    barrel = np.column_stack([x, 7 * np.cos(turn), 7 * np.sin(turn)])
    floor = np.column_stack([rng.uniform(-3, 33, 4800), rng.uniform(-10, 10, 4800), np.zeros(4800)])
    return np.concatenate([barrel, floor]) + rng.normal(0, 0.005, (13_800, 3))


@pytest.mark.parametrize("unit", ["m", ""])
def test_a_barrel_on_its_floor_is_refused_with_the_crop_that_passes(
    unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only "clean or crop the scan where it fails" was said, and to accept that two thirds are missing."""
    scan, out = tmp_path / "barrel.npy", tmp_path / "grid.json"
    np.save(scan, barrel_on_a_floor(np.random.default_rng(1)) + (500, 200, 80))
    words = ["grid", str(scan), str(out), "--length", "3", "--effort", "quick", "--quiet"]
    words += ["--unit", unit] if unit else []
    assert main(words) == 3 and not out.exists()
    said = capsys.readouterr().err
    crop = re.search(
        r"level floor at a height of ([0-9.]+)(?: m)?: without it, --crop (box:[-0-9.,]+), a grid passes", said
    )
    assert crop is not None and "--allow-missing" not in said
    assert float(crop[1]) == pytest.approx(80.0, abs=0.1)
    assert main([*words, "--crop", crop[2]]) == 0
    assert out.exists()


def test_a_roof_alone_and_one_over_a_slope_have_no_floor() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-10, 10, (2, 4000))
    roof, slope = np.column_stack([x, y, 6 - 0.03 * x * x]), np.column_stack([x, y, 0.3 * x])
    assert floor_below(roof, 1.5) is None
    assert floor_below(np.concatenate([roof, slope]), 1.5) is None
    found = floor_below(np.concatenate([roof, np.column_stack([x, y, 0.0 * x])]), 1.5)
    assert found == pytest.approx(0.0, abs=0.01)


@compiled_only
@pytest.mark.parametrize(("unit", "said"), [("m", "is taken for the floor"), ("mm", "as a floor does")])
def test_a_level_piece_under_a_roof_is_told_of_in_any_unit(
    unit: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-10, 10, (2, 9000))
    roof, floor = np.column_stack([x, y, 8 - 0.03 * x * x]), np.column_stack([x, y, 0.0 * x])
    np.save(tmp_path / "hall.npy", np.concatenate([roof, floor]))
    words = ["grid", str(tmp_path / "hall.npy"), str(tmp_path / "out.json"), "--length", "2", "--effort", "quick"]
    assert main([*words, "--unit", unit]) == 0
    told = capsys.readouterr().err
    assert said in told and told.count("a level, flat piece") == 1
