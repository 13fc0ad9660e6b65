"""Work in parts: all of it is done once, side by side, and what goes wrong comes out."""

import subprocess
import sys
import threading
from typing import Never

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from scantruss.runtime import parallel


@given(some.integers(0, 500), some.integers(1, 200), some.integers(1, 7))
def test_every_item_is_in_one_part_and_no_part_is_too_small(count: int, least: int, processors: int) -> None:
    done, parts = np.zeros(count, int), []

    def work(part: int, begin: int, end: int) -> None:
        done[begin:end] += 1
        parts.append((part, end - begin))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parallel, "processors", lambda: processors)
        parallel.in_parts(count, least, work)
    assert (done == 1).all()
    assert sorted(part for part, _ in parts) == list(range(len(parts))) and len(parts) <= processors
    assert len(parts) == 1 or min(size for _, size in parts) >= least
    assert len(parts) == max(1, min(processors, count // least))


@pytest.mark.parametrize("each", [1, 2, 5])
def test_a_processor_may_have_several_parts(monkeypatch: pytest.MonkeyPatch, each: int) -> None:
    monkeypatch.setattr(parallel, "processors", lambda: 3)
    done = np.zeros(100, int)

    def work(part: int, begin: int, end: int) -> None:
        done[begin:end] += 1 + part

    parallel.in_parts(100, 10, work, each)
    assert len(set(done.tolist())) == min(3 * each, 10) and done.min() == 1


def test_parts_that_no_thread_comes_to_are_done_by_who_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "processors", lambda: 2)
    go_on, threads = threading.Event(), []
    parallel._pool(1).put(lambda: go_on.wait(20))  # the only other thread is busy
    parallel.in_parts(30, 10, lambda *_: threads.append(threading.current_thread()))
    assert threads == 2 * [threading.current_thread()]
    go_on.set()


@pytest.mark.parametrize("processors", [1, 2, 4])
@pytest.mark.parametrize("count", range(5))
def test_two_shares_are_done_at_once_and_the_rest_after_them(
    monkeypatch: pytest.MonkeyPatch, processors: int, count: int
) -> None:
    monkeypatch.setattr(parallel, "processors", lambda: processors)
    begun, both = [], threading.Barrier(2 if processors > 1 and count > 1 else 1, timeout=20)

    def work(share: int) -> int:
        begun.append(share)
        if share < 20:
            both.wait()  # passes only when both wait at once
        return 10 * share

    shares = [10 + 5 * k for k in range(count)]
    assert parallel.two_at_once(work, shares) == [10 * share for share in shares]
    assert sorted(begun) == shares and begun[2:] == shares[2:]


def test_parts_run_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "processors", lambda: 3)
    all_there = threading.Barrier(3, timeout=20)
    parallel.in_parts(30, 10, lambda *_: all_there.wait())  # passes only when three wait at once


@pytest.mark.parametrize("processors", [1, 4])
def test_what_goes_wrong_in_a_part_comes_out(monkeypatch: pytest.MonkeyPatch, processors: int) -> None:
    monkeypatch.setattr(parallel, "processors", lambda: processors)

    def work(part: int, begin: int, end: int) -> None:
        if end == 40:
            raise ValueError("in the last part")

    with pytest.raises(ValueError, match="in the last part"):
        parallel.in_parts(40, 10, work)


def test_parts_that_nobody_has_begun_are_left_when_one_goes_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "processors", lambda: 2)
    go_on, done = threading.Event(), []
    parallel._pool(1).put(lambda: go_on.wait(20))  # the only other thread is busy

    def work(part: int, begin: int, end: int) -> Never:
        done.append(part)
        raise ValueError("in the first part")

    with pytest.raises(ValueError, match="in the first part"):
        parallel.in_parts(40, 10, work, each=2)
    go_on.set()
    assert done == [0]


def test_the_threads_end_with_the_program() -> None:
    program = (
        "import time; from scantruss.runtime import parallel as machine; machine.processors = lambda: 2\n"
        "machine.in_parts(10, 1, lambda *_: time.sleep(0.01)); print('done')"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert (ended.stdout, ended.stderr) == ("done\n", "")


@pytest.mark.parametrize("processors", [1, 2, 4])
def test_works_side_by_side_return_their_results_in_order_and_may_have_parts(
    monkeypatch: pytest.MonkeyPatch, processors: int
) -> None:
    monkeypatch.setattr(parallel, "processors", lambda: processors)

    def work(depth: int) -> int:
        done = np.zeros(40, int)
        parallel.in_parts(40, 10, lambda part, begin, end: done.__setitem__(slice(begin, end), 1))
        inner = parallel.side_by_side(lambda: work(depth - 1), lambda: 2) if depth else (0, 0)
        return done.sum() + sum(inner)

    assert parallel.side_by_side(lambda: work(3), lambda: "b", lambda: work(0)) == (40 * 4 + 2 * 3, "b", 40)
    with pytest.raises(ZeroDivisionError):
        parallel.side_by_side(lambda: 1, lambda: 1 // 0)
