"""Tests that do not apply everywhere."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import pytest

from scantruss.runtime.cache import HANDS_OVER

Test = TypeVar("Test", bound=Callable[..., Any])

needs_jit = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
handed_over = pytest.mark.skipif(
    not HANDS_OVER or bool(numba.config.DISABLE_JIT), reason="every kernel compiles by itself"
)


def compiled_only(test: Test) -> Test:
    """Mark a test of whole grids, which takes minutes without compiling; others run the same kernels."""
    slow = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="takes minutes without compiling")
    marked: Test = pytest.mark.compiled(slow(test))
    return marked
