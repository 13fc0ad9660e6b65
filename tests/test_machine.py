"""Work in parts: all of it is done once, side by side, and what goes wrong comes out."""

import gc
import subprocess
import sys
import threading
import weakref

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


@pytest.mark.parametrize("each", [1, 2, 5])
def test_a_processor_may_have_several_parts(monkeypatch, each):
    monkeypatch.setattr(machine, "processors", lambda: 3)
    done = np.zeros(100, int)

    def work(part, begin, end):
        done[begin:end] += 1 + part

    machine.in_parts(100, 10, work, each)
    assert len(set(done.tolist())) == min(3 * each, 10) and done.min() == 1


def test_parts_that_no_thread_comes_to_are_done_by_who_asked(monkeypatch):
    monkeypatch.setattr(machine, "processors", lambda: 2)
    go_on, threads = threading.Event(), []
    busy = machine.alongside(lambda: go_on.wait(20))
    machine.in_parts(30, 10, lambda *_: threads.append(threading.current_thread()))
    assert threads == 2 * [threading.current_thread()]
    go_on.set()
    assert busy()


@pytest.mark.parametrize("processors", [1, 2, 4])
@pytest.mark.parametrize("count", range(5))
def test_two_shares_are_done_at_once_and_the_rest_after_them(monkeypatch, processors, count):
    monkeypatch.setattr(machine, "processors", lambda: processors)
    begun, both = [], threading.Barrier(2 if processors > 1 and count > 1 else 1, timeout=20)

    def work(share):
        begun.append(share)
        if share < 20:
            both.wait()  # passes only when both wait at once
        return 10 * share

    shares = [10 + 5 * k for k in range(count)]
    assert machine.two_at_once(work, shares) == [10 * share for share in shares]
    assert sorted(begun) == shares and begun[2:] == shares[2:]


@pytest.mark.parametrize("processors", [1, 2, 4])
def test_work_alongside_is_done_once_and_its_result_kept(monkeypatch, processors):
    monkeypatch.setattr(machine, "processors", lambda: processors)
    done = []
    results = [machine.alongside(lambda i=i: done.append(i) or 10 * i) for i in range(5)]
    assert [result() for result in results] == [result() for result in results] == [0, 10, 20, 30, 40]
    assert sorted(done) == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("processors", [1, 2, 4])
def test_work_alongside_may_have_parts_and_work_alongside_of_its_own(monkeypatch, processors):
    monkeypatch.setattr(machine, "processors", lambda: processors)

    def work(depth):
        done = np.zeros(40, int)
        inner = machine.alongside(lambda: work(depth - 1)) if depth else lambda: 0
        machine.in_parts(40, 10, lambda part, begin, end: done.__setitem__(slice(begin, end), 1))
        return done.sum() + inner()

    assert machine.alongside(lambda: work(6))() == 7 * 40


@pytest.mark.parametrize("processors", [1, 3])
def test_what_goes_wrong_alongside_comes_out_when_it_is_asked_for(monkeypatch, processors):
    monkeypatch.setattr(machine, "processors", lambda: processors)
    result = machine.alongside(lambda: 1 // 0)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            result()


def test_parts_run_side_by_side(monkeypatch):
    monkeypatch.setattr(machine, "processors", lambda: 3)
    all_there = threading.Barrier(3, timeout=20)
    machine.in_parts(30, 10, lambda *_: all_there.wait())  # passes only when three wait at once


@pytest.mark.parametrize("processors", [1, 2])
def test_what_keeps_a_result_goes_with_its_last_name(monkeypatch, processors):
    monkeypatch.setattr(machine, "processors", lambda: processors)

    class Sites:
        points = range(10)

    sites = Sites()
    sites.count = machine.alongside(lambda sites=sites: len(sites.points))
    assert sites.count() == 10
    last = weakref.ref(sites)
    gc.disable()  # a cycle would stay, and all the memory with it, until Python comes to look for some
    try:
        del sites
        assert last() is None
    finally:
        gc.enable()


@pytest.mark.parametrize("processors", [1, 4])
def test_what_goes_wrong_in_a_part_comes_out(monkeypatch, processors):
    monkeypatch.setattr(machine, "processors", lambda: processors)

    def work(part, begin, end):
        if end == 40:
            raise ValueError("in the last part")

    with pytest.raises(ValueError, match="in the last part"):
        machine.in_parts(40, 10, work)


def test_parts_that_nobody_has_begun_are_left_when_one_goes_wrong(monkeypatch):
    monkeypatch.setattr(machine, "processors", lambda: 2)
    go_on, done = threading.Event(), []
    busy = machine.alongside(lambda: go_on.wait(20))

    def work(part, begin, end):
        done.append(part)
        raise ValueError("in the first part")

    with pytest.raises(ValueError, match="in the first part"):
        machine.in_parts(40, 10, work, each=2)
    go_on.set()
    assert busy() and done == [0]


def test_who_waits_together_gets_one_result(monkeypatch):
    monkeypatch.setattr(machine, "processors", lambda: 2)
    go_on, done, found = threading.Event(), [], []

    def work():
        go_on.wait(20)
        done.append(1)
        return done

    result = machine.alongside(work)
    waiting = [threading.Thread(target=lambda: found.append(result())) for _ in range(3)]
    for thread in waiting:
        thread.start()
    go_on.set()
    for thread in waiting:
        thread.join(20)
    assert len(found) == 3 and all(each is done for each in found) and done == [1]


def test_the_threads_end_with_the_program():
    """Also where work is still on its way that nobody has asked for."""
    program = (
        "import time; from scantruss import machine; machine.processors = lambda: 2\n"
        "machine.in_parts(10, 1, lambda *_: None); machine.alongside(lambda: time.sleep(0.2) or print('done'))"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert (ended.stdout, ended.stderr) in (("done\n", ""), ("", ""))


def test_there_is_a_processor():
    assert machine.processors() >= 1
