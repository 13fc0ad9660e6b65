"""Machine code is kept under the contents of all kernel files, and nothing fails for want of a folder."""

import importlib
import inspect
import os
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Never

import llvmlite.binding
import numba
import numpy as np
import pytest
from marks import compiled_only, handed_over

from scantruss.runtime import cache
from scantruss.runtime import jit as compiling

KERNELS = Path(compiling.__file__).parents[1] / "kernels"


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The kernel files, copied where they may be changed."""
    folder = tmp_path / "kernels"
    (tmp_path / "runtime").mkdir()
    shutil.copytree(KERNELS, folder, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(compiling, "__file__", str(tmp_path / "runtime" / "jit.py"))
    return folder


@pytest.fixture
def no_home(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither of the places that are tried is named by the environment."""
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)


def test_the_name_changes_when_any_kernel_file_changes(copied: Path) -> None:
    seen = {compiling._contents()}
    assert compiling._contents() in seen
    for path in sorted(copied.glob("*.py")):
        path.write_text(path.read_text() + "\n# a change\n")
        digest = compiling._contents()
        assert digest not in seen, path.name
        seen.add(digest)
    (copied / "another.py").write_text("")
    (copied / "another.py").write_text("x = 1\n")
    assert compiling._contents() not in seen


def test_a_copy_of_the_same_files_has_the_same_name(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copy = compiling._contents()
    monkeypatch.setattr(compiling, "__file__", str(KERNELS.parent / "runtime" / "jit.py"))
    assert compiling._contents() == copy


def test_bounds_checks_have_a_folder_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_BOUNDSCHECK", raising=False)
    plain = compiling._contents()
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert compiling._contents() != plain


def test_another_numba_has_a_folder_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = compiling._contents()
    monkeypatch.setattr(numba, "__version__", "0.0.1")
    assert compiling._contents() != plain


@pytest.mark.parametrize("setting", ["CPU_NAME", "CPU_FEATURES"])
def test_another_processor_has_a_folder_of_its_own(setting: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, setting, None)
    plain = compiling._contents()
    monkeypatch.setattr(numba.config, setting, "another")
    assert compiling._contents() != plain


def test_a_processor_that_llvm_does_not_know_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown() -> Never:
        raise RuntimeError("target not available")

    monkeypatch.setattr(llvmlite.binding, "get_host_cpu_features", unknown)
    assert compiling._contents()


@pytest.mark.parametrize("name", ["NUMBA_CACHE_DIR", "XDG_CACHE_HOME"])
def test_the_folder_is_where_the_environment_says(
    name: str, tmp_path: Path, no_home: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, str(tmp_path / "cache"))
    folder = compiling._folder()
    assert folder is not None and folder.is_dir()
    assert folder.is_relative_to(tmp_path / "cache")
    assert compiling._contents() in folder.name


def refuse(*allowed: Path) -> Callable[..., Any]:
    """Return a `TemporaryFile` that fails but in the folders below `allowed`, as on a disk that cannot be written."""
    real = tempfile.TemporaryFile

    def temporary_file(*args: Any, dir: Any = None, **others: Any) -> Any:
        if not any(Path(dir).is_relative_to(a) for a in allowed):
            raise PermissionError(13, "Permission denied", str(dir))
        return real(*args, dir=dir, **others)

    return temporary_file


def test_the_temporary_folder_serves_where_home_cannot_be_written(
    tmp_path: Path, no_home: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    monkeypatch.setattr(tempfile, "TemporaryFile", refuse(tmp_path / "temporary"))
    folder = compiling._folder()
    assert folder is not None and folder.is_relative_to(tmp_path / "temporary")


def test_no_folder_at_all_is_no_error(tmp_path: Path, no_home: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    monkeypatch.setattr(tempfile, "TemporaryFile", refuse())
    assert compiling._folder() is None


def test_no_home_is_no_error(tmp_path: Path, no_home: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home_folder() -> Never:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", no_home_folder)
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path))
    folder = compiling._folder()
    assert folder is not None and folder.is_relative_to(tmp_path)


def test_kernels_compile_in_memory_where_there_is_no_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "KERNEL_FOLDER", None)

    @compiling.kernel
    def twice(x: float) -> float:
        return 2.0 * x

    assert twice(21.0) == 42.0


def test_the_decorator_leaves_the_settings_of_numba_alone() -> None:
    kept = numba.config.CACHE_DIR

    @compiling.kernel
    def one() -> float:
        return 1.0

    assert one() == 1.0
    assert kept == numba.config.CACHE_DIR


CODE = """
import scantruss.kernels.geometry.vectors as v
from scantruss.runtime import jit as c
assert v.norm((3.0, 4.0, 0.0)) == 5.0
print(c.KERNEL_FOLDER, any(c.KERNEL_FOLDER.rglob("vectors.norm-*.nbc")) if c.KERNEL_FOLDER else False)
"""


def run(**environment: str) -> list[str]:
    """Run CODE in another process; return the words it prints."""
    kept = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    kept.pop("NUMBA_DISABLE_JIT", None)
    kept["SCANTRUSS_INSTALLED"] = "0"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", CODE], capture_output=True, text=True, env=kept | environment
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_fresh_process_keeps_its_machine_code_and_finds_it_again(tmp_path: Path) -> None:
    first, kept = run(NUMBA_CACHE_DIR=str(tmp_path))
    files = sorted(path for path in Path(first).rglob("*.nbc"))
    assert Path(first).is_relative_to(tmp_path) and kept == "True" and files
    stamps = [path.stat().st_mtime_ns for path in files]
    assert run(NUMBA_CACHE_DIR=str(tmp_path)) == [first, "True"]
    again = sorted(path for path in Path(first).rglob("*.nbc"))
    assert again == files and [path.stat().st_mtime_ns for path in again] == stamps  # nothing was compiled again


STORED = """
import scantruss.kernels.geometry.vectors as v
from scantruss.runtime import jit as c

assert v.norm((3.0, 4.0, 0.0)) == 5.0  # found, not compiled

@c.kernel
def twice(a: float) -> float:
    return v.norm((a, 0.0, 0.0)) + v.norm((0.0, a, 0.0))

assert twice(2.0) == 4.0
stats = v.norm.alone.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


@handed_over
def test_a_kernel_that_is_found_again_still_becomes_a_part_though_only_machine_code_is_stored(tmp_path: Path) -> None:
    folder = run(NUMBA_CACHE_DIR=str(tmp_path))[0]
    (file,) = Path(folder).rglob("vectors.norm-*.nbc")
    (_, kind, (code, names)), *_ = pickle.loads(file.read_bytes())
    assert kind == "object" and code and len(names) < 3000
    module = str(llvmlite.binding.parse_bitcode(names))
    assert module.count("define") == 2 and "norm" in module
    again = tmp_path / "again.py"  # numba reads the file of a kernel
    again.write_text(STORED)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "SCANTRUSS_INSTALLED": "0"}
    done = subprocess.run([sys.executable, str(again)], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["1", "0"]


FOUND = """
import scantruss.kernels.geometry.vectors as v
from scantruss.runtime import jit as c
assert v.norm((3.0, 4.0, 0.0)) == 5.0
stats = v.norm.alone.stats
print(sum(stats.cache_hits.values()), v.__file__)
"""


@handed_over
def test_machine_code_that_came_with_the_package_is_found_and_only_read(tmp_path: Path) -> None:
    made = Path(run(NUMBA_CACHE_DIR=str(tmp_path / "made"))[0])
    package = tmp_path / "elsewhere" / "scantruss"
    shutil.copytree(KERNELS.parent, package, ignore=shutil.ignore_patterns("__pycache__", "machine_code"))
    installed = package / "machine_code" / made.name
    for room in made.iterdir():
        shutil.copytree(room, installed / cache.room_of(room))
    stamps = {path: path.stat().st_mtime_ns for path in installed.rglob("*")}

    def find(name: str, **environment: str) -> tuple[int, int]:
        """Use a kernel of that package where nothing is stored yet; say whether it was found and what was stored."""
        words = {"NUMBA_CACHE_DIR": str(tmp_path / name), "PYTHONPATH": str(package.parent)} | environment
        kept = {key: value for key, value in os.environ.items() if key != "SCANTRUSS_INSTALLED"}
        done = subprocess.run([sys.executable, "-c", FOUND], capture_output=True, text=True, env=kept | words)
        assert done.returncode == 0, done.stderr
        hits, file = done.stdout.split()
        assert Path(file).is_relative_to(package)
        return int(hits), len(list((tmp_path / name).rglob("*.nbc")))

    assert find("fresh") == (1, 0)
    assert {path: path.stat().st_mtime_ns for path in installed.rglob("*")} == stamps
    assert find("left aside", SCANTRUSS_INSTALLED="0") == (0, 1)
    assert find("another processor", NUMBA_CPU_NAME="generic") == (0, 1)
    with (package / "kernels" / "boxes.py").open("a") as file:
        file.write("# a change\n")
    assert find("another kernel") == (0, 1)


def test_a_process_that_can_write_nowhere_works_all_the_same(tmp_path: Path) -> None:
    """The home of the cache and the temporary folder are files: no folder can be made in them, not even by root."""
    file = tmp_path / "file"
    file.write_text("")
    folder, _ = run(XDG_CACHE_HOME=str(file), HOME=str(file), TMPDIR=str(file), TEMP=str(file), TMP=str(file))
    assert not Path(folder).is_relative_to(file)


@compiling.kernel
def add(a: float, b: float) -> float:
    return a + b


@compiling.kernel
def share(values: np.ndarray, i: int, among: float) -> float:
    if among < 0.0:
        raise ValueError("fewer than none")
    return float(values[i]) / among


@compiling.kernel
def add_shares(values: np.ndarray, among: float) -> float:
    total = 0.0
    for i in range(len(values)):
        total = add(total, share(values, i, among))
    return total


@pytest.mark.kernels
def test_a_kernel_serves_python_and_other_kernels() -> None:
    values = np.array([1.0, 2.0, 6.0])
    assert add_shares(values, 3.0) == 3.0
    assert add(1.0, 2.0) == 3.0 and share(values, 2, 3.0) == 2.0
    with pytest.raises(ValueError, match="fewer than none"):  # what goes wrong in a part comes out of the whole
        add_shares(values, -1.0)


@compiled_only
def test_a_kernel_divides_by_zero_as_numpy_does() -> None:
    assert add_shares(np.array([1.0, 2.0]), 0.0) == np.inf and np.isnan(add_shares(np.array([0.0, 2.0]), 0.0))


@handed_over
def test_a_part_of_a_kernel_is_no_machine_code_of_its_own() -> None:
    def double(x: float) -> float:
        return 2.0 * x

    part: Any = compiling.kernel(double)  # a dispatcher

    @compiling.kernel
    def whole(x: float) -> float:
        return part(x) + 1.0

    assert whole(1.0) == 3.0
    assert not part.alone.signatures and isinstance(next(iter(part.overloads.values())).library, cache.KernelPart)
    assert part(2.0) == 4.0 and len(part.alone.signatures) == 1


def test_every_kernel_compiles_by_itself_where_numba_does_not_let_us(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "HANDS_OVER", False)

    @compiling.kernel
    def part(values: np.ndarray) -> float:
        return values[0]

    @compiling.kernel
    def whole(values: np.ndarray) -> float:
        return part(values) + np.zeros(1)[0]

    assert not isinstance(part, cache.Kernel)
    assert whole(np.ones(1)) == 1.0


def test_no_kernel_returns_an_array() -> None:
    """Those without arrays of their own do not count who uses one, so they must not hand one on."""
    holders = "ndarray|Surface|Net|Front|Curves|Boxes|Table|Tree|Nodes|Level|Area|Scratch"
    for path in KERNELS.rglob("*.py"):
        name = ".".join(path.relative_to(KERNELS.parent).with_suffix("").parts)
        module = importlib.import_module(f"scantruss.{name}")
        for function in vars(module).values():
            if isinstance(function, cache.Kernel):
                returned = inspect.signature(function.py_func).return_annotation
                assert not re.search(holders, str(returned)), function.__name__
