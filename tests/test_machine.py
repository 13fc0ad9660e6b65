"""Work in parts: all of it is done once, side by side, and what goes wrong comes out."""

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from scantruss import machine


@given(some.integers(0, 500), some.integers(1, 200), some.integers(1, 7))
def test_every_item_is_in_one_part_and_no_part_is_too_small(count, least, processors):
    done, parts = np.zeros(count, int), []

    def work(part, begin, end):
        done[begin:end] += 1
        parts.append((part, end - begin))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(machine, "processors", lambda: processors)
        machine.in_parts(count, least, work)
    assert (done == 1).all()
    assert sorted(part for part, _ in parts) == list(range(len(parts))) and len(parts) <= processors
    assert len(parts) == 1 or min(size for _, size in parts) >= least
    assert len(parts) == max(1, min(processors, count // least))


def test_parts_run_side_by_side(monkeypatch):
    monkeypatch.setattr(machine, "processors", lambda: 3)
    all_there = threading.Barrier(3, timeout=20)
    machine.in_parts(30, 10, lambda *_: all_there.wait())  # passes only when three wait at once


@pytest.mark.parametrize("processors", [1, 4])
def test_what_goes_wrong_in_a_part_comes_out(monkeypatch, processors):
    monkeypatch.setattr(machine, "processors", lambda: processors)

    def work(part, begin, end):
        if end == 40:
            raise ValueError("in the last part")

    with pytest.raises(ValueError, match="in the last part"):
        machine.in_parts(40, 10, work)


def test_there_is_a_processor():
    assert machine.processors() >= 1
