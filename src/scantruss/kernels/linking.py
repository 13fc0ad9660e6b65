"""Kernels that call kernels: only what Python calls becomes machine code, together with all that it calls.

numba optimizes each function it meets and writes machine code and two wrappers for it, then does the same again for its copy in
every caller: the time grows with the depth of the calls. Here a kernel that another kernel calls is handed over as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

try:
    from numba.core import compiler, dispatcher, sigutils
    from numba.core.codegen import JITCodeLibrary
    from numba.core.cpu import CPUTargetOptions
    from numba.core.event import trigger_event
    from numba.core.registry import CPUDispatcher

    Options = compiler.Flags
    HANDS_OVER = all(
        hasattr(owner, name)
        for owner, name in (
            (JITCodeLibrary, "_optimize_final_module"),
            (JITCodeLibrary, "_finalize_final_module"),
            (compiler.Flags, "no_compile"),
            (compiler.Flags, "no_cpython_wrapper"),
            (dispatcher, "_FunctionCompiler"),
            (CPUTargetOptions, "_nrt"),
            (CPUTargetOptions, "no_cfunc_wrapper"),
        )
    )
except ImportError:  # another numba: every kernel is compiled by itself, which only takes longer
    HANDS_OVER = False
    JITCodeLibrary = CPUDispatcher = Options = object

ALLOCATES = {"empty", "zeros", "ones", "full", "copy"}  # names of what makes an array in a kernel


class Flags(Options):  # type: ignore[misc, valid-type]
    """numba's options, compared at once: they are a part of the key of each of its look-ups, some 75,000 for a first grid."""

    def __hash__(self) -> int:
        """Return what numba does, which hashes the names of all options only."""
        return OF_NAMES

    def __eq__(self, other: object) -> bool:
        """Compare what was set, and what the rest defaults to only where that differs."""
        return self._values == getattr(other, "_values", None) or super().__eq__(other)


OF_NAMES = hash(Options()) if HANDS_OVER else 0


class Part(JITCodeLibrary):  # type: ignore[misc]
    """A compiled kernel on its way into another: neither optimized by itself nor machine code."""

    def _optimize_final_module(self) -> None:
        """Leave that to the kernel it becomes a part of."""

    def _finalize_final_module(self) -> None:
        """Be ready for linking."""
        self._finalized = True


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A kernel for both: Python gets its machine code (`alone`), a kernel that calls it a part."""

    alone: Callable[..., Any]

    def __call__(self, *arguments: Any) -> Any:
        """Run the machine code; compiled on the first call."""
        return self.alone(*arguments)

    def compile(self, sig: Any) -> Any:
        """Make the part for a kernel that calls this one with arguments of these types."""
        arguments = tuple(numba.types.unliteral(argument) for argument in sigutils.normalize_signature(sig)[0])
        if arguments not in self.overloads:
            flags = Flags()
            self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
            flags.no_cpython_wrapper = flags.no_compile = True
            part = Part(self.targetctx.codegen(), self.py_func.__qualname__)
            details = {"dispatcher": self, "args": arguments, "return_type": None}
            with trigger_event("numba:compile", data=details):
                result = compiler.compile_extra(
                    self.typingctx, self.targetctx, self.py_func, arguments, None, flags, {}, library=part
                )
            self.targetctx.insert_user_function(part, result.fndesc, [part])
            self.overloads[arguments] = result._replace(entry_point=part)
        return self.overloads[arguments].entry_point


def compiled(function: Callable[..., Any], *, cache: bool) -> Callable[..., Any]:
    """Return what `numba.njit` makes of a function, releasing the GIL; a `Kernel` where this numba lets us.

    It divides by zero as numpy does: a branch to an exception at every division costs a tenth of the time to compile.
    """
    options: dict[str, object] = {"nogil": True, "error_model": "numpy"}
    if HANDS_OVER:  # without arrays of its own a kernel need not count who uses its arguments
        allocates = not ALLOCATES.isdisjoint(function.__code__.co_names)
        options |= {"no_cfunc_wrapper": True, "_nrt": allocates}
    alone = numba.njit(cache=cache, **options)(function)
    if not HANDS_OVER or not isinstance(alone, CPUDispatcher):  # plain where NUMBA_DISABLE_JIT is set
        return alone
    alone._compiler._customize_flags = Flags
    kernel = Kernel(function, targetoptions=alone.targetoptions)
    kernel.alone = alone
    return kernel
