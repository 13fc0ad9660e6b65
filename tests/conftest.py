"""What all tests share: Hypothesis without deadlines (kernels compile on their first call) and without chance.

A shell has what it starts in the background ignore interrupts, and so does all that this starts in turn; the tests that
interrupt a run would then wait for it to its end, and fail.
"""

import os
import signal

import pytest
from hypothesis import settings

settings.register_profile("scantruss", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("scantruss")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One process more than there are processors: tests of pages and of commands that are stopped mostly wait."""
    return len(os.sched_getaffinity(0)) + 1 if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1) + 1
