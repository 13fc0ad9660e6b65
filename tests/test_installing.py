"""An installation compiles the kernels, and is none the worse where it cannot."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from marks import handed_over

ROOT = Path(__file__).resolve().parents[1]
# Compiles little, of two folders of kernels.
CLEAN = "clean shell.npy clean.ply --keep-outliers --keep-pieces --keep-layers --no-smooth --no-normals".split()
CODE = "import sys, hatchling.build as build; getattr(build, 'build_' + sys.argv[1])('out')"

pytest.importorskip("hatchling")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """What a build needs of the project, where a command compiles little."""
    folder = tmp_path / "project"
    nothing_made = shutil.ignore_patterns("__pycache__", "machine_code")
    shutil.copytree(ROOT / "src", folder / "src", ignore=nothing_made)
    for name in ("pyproject.toml", "README.md", "LICENSE", "hatch_build.py"):
        shutil.copy(ROOT / name, folder)
    with_commands(folder, " ".join(CLEAN))
    return folder


def with_commands(project: Path, *commands: str) -> None:
    """Let an installation run other commands."""
    hook = project / "hatch_build.py"
    text, count = re.subn(r"^COMMANDS = \(.*?\)$", f"COMMANDS = {commands!r}", hook.read_text(), flags=re.M | re.S)
    assert count == 1
    hook.write_text(text)


def build(project: Path, kind: str = "wheel", **environment: str) -> tuple[Path, str]:
    """Build a wheel; return it and what was said."""
    words = [sys.executable, "-c", CODE, kind]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", **environment}  # as when the tests run without compiling
    done = subprocess.run(words, cwd=project, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (wheel,) = (project / "out").glob("*.whl")
    return wheel, done.stdout + done.stderr


def machine_code_in(folder: Path) -> list[str]:
    return sorted(path.name for path in Path(folder).glob("scantruss/machine_code/kernels-*/*/*.nbc"))


def clean(package: Path, folder: Path) -> tuple[bool, list[str]]:
    """Run the command of a package where nothing is stored; say whether it compiled, and what it stored."""
    folder.mkdir()
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA_", "SCANTRUSS_"))}
    environment |= {"NUMBA_CACHE_DIR": str(folder / "cache"), "PYTHONPATH": str(package)}
    scan = "import numpy as np; np.save('shell.npy', np.random.default_rng(1).uniform(0.0, 10.0, (5000, 3)))"
    subprocess.run([sys.executable, "-c", scan], cwd=folder, check=True)
    words = [sys.executable, "-m", "scantruss", *CLEAN]
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return "compiling kernels" in done.stderr, sorted(path.name for path in (folder / "cache").rglob("*.nbc"))


@handed_over
def test_a_wheel_brings_machine_code_and_its_first_run_does_not_compile(project: Path, tmp_path: Path) -> None:
    wheel, _ = build(project)
    assert "none-any" not in wheel.name  # it is for this system
    sample = tmp_path / "site"
    with zipfile.ZipFile(wheel) as content:
        content.extractall(sample)
    assert machine_code_in(sample) and not (project / "out" / "machine_code").exists()
    assert clean(sample, tmp_path / "first") == (False, [])
    shutil.rmtree(sample / "scantruss" / "machine_code")
    assert clean(sample, tmp_path / "second") == (True, sorted(machine_code_in_wheel(wheel)))


def machine_code_in_wheel(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as content:
        return [name.rpartition("/")[2] for name in content.namelist() if name.endswith(".nbc")]


@handed_over
def test_an_editable_installation_compiles_into_the_source_in_place_of_what_is_there(
    project: Path, tmp_path: Path
) -> None:
    old = project / "src" / "scantruss" / "machine_code" / "kernels-old"
    old.mkdir(parents=True)
    wheel, _ = build(project, "editable")
    assert "none-any" in wheel.name and not machine_code_in_wheel(wheel)
    assert machine_code_in(project / "src") and not old.exists()
    assert clean(project / "src", tmp_path / "first") == (False, [])
    build(project, "editable")  # once more, where all of it could be found
    assert machine_code_in(project / "src")


def test_a_wheel_for_all_machines_brings_none(project: Path) -> None:
    wheel, _ = build(project, SCANTRUSS_COMPILE="0")
    assert wheel.name.endswith("py3-none-any.whl") and not machine_code_in_wheel(wheel)


@pytest.mark.parametrize("commands", [("clean missing.npy clean.ply",), ()])
def test_where_it_cannot_compile_it_says_so_and_the_first_run_does(project: Path, commands: tuple[str, ...]) -> None:
    with_commands(project, *commands)
    wheel, said = build(project)
    assert wheel.name.endswith("py3-none-any.whl") and not machine_code_in_wheel(wheel)
    assert "not compiled now but by the first run" in said
    with zipfile.ZipFile(wheel) as content:
        assert "scantruss/runtime/jit.py" in content.namelist()


def test_a_source_distribution_can_compile(project: Path) -> None:
    words = [sys.executable, "-c", CODE, "sdist"]
    subprocess.run(words, cwd=project, check=True, capture_output=True)
    (archive,) = (project / "out").glob("*.tar.gz")
    names = subprocess.run(["tar", "tzf", str(archive)], capture_output=True, text=True, check=True).stdout
    assert "/hatch_build.py" in names and "machine_code" not in names
