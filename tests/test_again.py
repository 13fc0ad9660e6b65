"""Where no grid passes, other settings are tried, and the grid says with which it was made."""

from types import SimpleNamespace

import numpy as np
import pytest
from small_clouds import cap

import scantruss as st
from scantruss import pipeline
from scantruss.errors import FrontError


def size_of(settings):
    return settings.box_size and round(settings.box_size, 3)


def others(sharp=False, smooth=False, **settings):
    boundary = SimpleNamespace(lines=SimpleNamespace(sharp=np.array([sharp])), sites=SimpleNamespace(smooth=smooth))
    return [
        (o.ridge_angle, size_of(o), o.method) for o in pipeline._others(boundary, st.Settings(length=1.0, **settings))
    ]


def test_what_is_tried_in_which_order():
    ridge = st.Settings(length=1.0).ridge_angle
    coarser = [0.22, 0.24, 0.26]
    assert others() == [(ridge, size, "default") for size in coarser] + [(ridge, None, "paper")]
    assert others(sharp=True) == [(0.0, size, "default") for size in (None, *coarser)] + [(0.0, None, "paper")]
    assert others(smooth=True) == [(ridge, size, "default") for size in (0.2, *coarser)] + [(ridge, None, "paper")]
    assert others(box_size=0.5) == [(ridge, 0.5, "paper")]
    assert others(method="paper") == []


@pytest.mark.parametrize(("size", "method"), [(0.22, "default"), (0.26, "default"), (None, "paper")])
def test_the_first_that_passes_is_the_grid_and_its_settings_say_so(monkeypatch, size, method):
    whole = pipeline._checked_grid

    def refuse_others(cloud, boundary, settings, *rest):
        if (size_of(settings), settings.method) != (size, method):
            raise FrontError("not these")
        return whole(cloud, boundary, settings, *rest)

    monkeypatch.setattr(pipeline, "_checked_grid", refuse_others)
    grid = st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0))
    assert (size_of(grid.settings), grid.settings.method) == (size, method)
    assert grid.certificate.passed


def test_where_none_passes_the_first_fault_is_told(monkeypatch):
    asked = []

    def refuse(cloud, boundary, settings, *rest):
        asked.append(settings.box_size)
        raise FrontError(f"fault {len(asked)}")

    monkeypatch.setattr(pipeline, "_checked_grid", refuse)
    with pytest.raises(FrontError, match="fault 1"):
        st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0))
    assert len(asked) == 5
