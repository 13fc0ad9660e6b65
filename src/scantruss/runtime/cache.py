"""Kernels that call kernels: only what Python calls becomes machine code, together with all that it calls.

numba optimizes each function it meets and writes machine code and two wrappers for it, then does the same again for its copy in
every caller: the time grows with the depth of the calls. Here a kernel that another kernel calls is handed over as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import RLock
from typing import Any

import numba

try:
    import llvmlite.binding
    from numba.core import compiler, dispatcher, sigutils
    from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
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
            (FunctionCache, "_impl_class"),
            (IndexDataCacheFile, "load"),
            (CompileResultCacheImpl, "reduce"),
        )
    )
except ImportError:  # another numba: every kernel is compiled by itself, which only takes longer
    HANDS_OVER = False
    JITCodeLibrary = CPUDispatcher = Options = CompileResultCacheImpl = FunctionCache = IndexDataCacheFile = object

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


class KernelPart(JITCodeLibrary):  # type: ignore[misc]
    """A compiled kernel on its way into another: neither optimized by itself nor machine code."""

    def _optimize_final_module(self) -> None:
        """Leave that to the kernel it becomes a part of."""

    def _finalize_final_module(self) -> None:
        """Be ready for linking."""
        self._finalized = True


class Machine(CompileResultCacheImpl):  # type: ignore[misc]
    """What is stored of a kernel: its machine code, and names instead of all that numba would need to build it into another.

    A part is compiled for that, so nobody asks; reading it was a third of the time to find a kernel again.
    """

    def reduce(self, result: Any) -> Any:
        """Return what is written to the file of a kernel."""
        (name, kind, content), *rest = super().reduce(result)
        if kind == "object":
            names = result.fndesc.llvm_func_name, result.fndesc.llvm_cpython_wrapper_name
            empty = "\n".join(f'define void @"{name}"() {{ ret void }}' for name in names)
            content = content[0], llvmlite.binding.parse_assembly(empty).as_bitcode()
        return (name, kind, content), *rest


class Files(IndexDataCacheFile):  # type: ignore[misc]
    """The files with the machine code of a kernel; those that came with the package are looked at first and never written to."""

    def __init__(self, folder: str, name: str, stamp: object, installed: Path | None) -> None:
        super().__init__(folder, name, stamp)
        self._installed = None if installed is None else IndexDataCacheFile(str(installed), name, stamp)

    def load(self, key: object) -> Any:
        """Return what is stored under a key; None where nothing is."""
        found = None if self._installed is None else self._installed.load(key)
        return super().load(key) if found is None else found


class Store(FunctionCache):  # type: ignore[misc]
    """Where the machine code of a kernel is looked for and kept."""

    _impl_class = Machine

    def __init__(self, function: Callable[..., Any], installed: Path | None) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        if installed is not None:
            installed = installed / room_of(self.cache_path)
        self._cache_file = Files(self.cache_path, self._impl.filename_base, stamp, installed)


def room_of(folder: str | Path) -> str:
    """Return the name of the folder of sources whose machine code numba keeps in `folder`: it appends a hash of its path."""
    return Path(folder).name.rpartition("_")[0]


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A kernel for both: Python gets its machine code (`alone`), a kernel that calls it a part."""

    folder: Path | None = None  #: where machine code is kept
    installed: Path | None = None  #: where machine code lies that came with the package

    def __call__(self, *arguments: Any) -> Any:
        """Run the machine code; compiled on the first call."""
        return self.alone(*arguments)

    def __getattr__(self, name: str) -> Any:
        """Make what Python calls when it first does: of most kernels it never does."""
        if name != "alone":
            raise AttributeError(name)
        with MAKING_KERNELS:
            if name not in vars(self):
                alone = numba.jit(**self.targetoptions)(self.py_func)
                alone._compiler._customize_flags = Flags
                if self.folder is not None:
                    with stored_in(self.folder):
                        alone._cache = Store(self.py_func, self.installed)
                self.alone = alone
        return self.alone

    def compile(self, sig: Any) -> Any:
        """Make the part for a kernel that calls this one with arguments of these types."""
        arguments = tuple(numba.types.unliteral(argument) for argument in sigutils.normalize_signature(sig)[0])
        if arguments not in self.overloads:
            flags = Flags()
            self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
            flags.no_cpython_wrapper = flags.no_compile = True
            part = KernelPart(self.targetctx.codegen(), self.py_func.__qualname__)
            details = {"dispatcher": self, "args": arguments, "return_type": None}
            with trigger_event("numba:compile", data=details):
                result = compiler.compile_extra(
                    self.typingctx, self.targetctx, self.py_func, arguments, None, flags, {}, library=part
                )
            self.targetctx.insert_user_function(part, result.fndesc, [part])
            self.overloads[arguments] = result._replace(entry_point=part)
        return self.overloads[arguments].entry_point


MAKING_KERNELS = RLock()  # numba asks one name for the folder, and a kernel is made once


@contextmanager
def stored_in(folder: Path) -> Iterator[None]:
    """Say to numba where it keeps machine code, while a block asks it to, which is left where numba cannot."""
    with MAKING_KERNELS, suppress(RuntimeError):  # "cannot cache function"
        kept, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
        try:
            yield
        finally:
            numba.config.CACHE_DIR = kept


def compiled(function: Callable[..., Any], folder: Path | None, installed: Path | None) -> Callable[..., Any]:
    """Return what `numba.njit` makes of a function, releasing the GIL; a `Kernel` where this numba lets us.

    It divides by zero as numpy does: a branch to an exception at every division costs a tenth of the time to compile.
    """
    options: dict[str, object] = {"nogil": True, "error_model": "numpy"}
    if numba.config.DISABLE_JIT:
        return function
    if HANDS_OVER:  # without arrays of its own a kernel need not count who uses its arguments
        allocates = not ALLOCATES.isdisjoint(function.__code__.co_names)
        options |= {"nopython": True, "boundscheck": None, "no_cfunc_wrapper": True, "_nrt": allocates}
        kernel = Kernel(function, targetoptions=options)
        kernel.folder, kernel.installed = folder, installed
        return kernel
    alone = numba.njit(**options)(function)
    if folder is not None:
        with stored_in(folder):
            alone.enable_caching()
    return alone
