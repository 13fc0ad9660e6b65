"""Tests that do not apply everywhere."""

import numba
import pytest

from scantruss.runtime.cache import HANDS_OVER

needs_jit = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
compiled_only = pytest.mark.skipif(
    bool(numba.config.DISABLE_JIT), reason="takes minutes without compiling; others run the same kernels"
)
handed_over = pytest.mark.skipif(
    not HANDS_OVER or bool(numba.config.DISABLE_JIT), reason="every kernel compiles by itself"
)
