"""The public face: every name has its type for whoever writes against it, and is imported when it is first used."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from steps import lines_of_readme

import scantruss as st

ROOT = Path(__file__).resolve().parents[1]
STEPS = f"""{lines_of_readme()}
reveal_type(st.Settings)
reveal_type(grid)
reveal_type(grid.quality.length_mean)
reveal_type(grid.certificate)
"""


def typed_names() -> set[str]:
    """Names that type checkers find in the package."""
    tree = ast.parse((ROOT / "src" / "scantruss" / "__init__.py").read_text(encoding="utf-8"))
    guarded = [node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    imports = [node for node in ast.walk(guarded[0]) if isinstance(node, ast.ImportFrom)]
    return {alias.asname for node in imports for alias in node.names if alias.asname}


def test_each_public_name_is_there_and_has_a_type() -> None:
    assert typed_names() == set(st.__all__) - {"__version__"}
    for name in st.__all__:
        value = getattr(st, name)
        assert isinstance(value, str) or value.__doc__, f"{name} has no docstring"
    assert dir(st) == st.__all__


def test_other_names_are_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'no_such_name'"):
        st.no_such_name  # noqa: B018


def test_what_is_given_in_the_wrong_place_is_refused_in_one_line() -> None:
    grid = st.Grid(np.zeros((3, 3)), np.array([[0, 1, 2]]), np.zeros(3, bool), np.zeros(3))
    with pytest.raises(st.FormatError, match="write needs a grid or structure, then a file name, got Grid as the file"):
        st.write("a.obj", grid)  # type: ignore[arg-type]
    with pytest.raises(st.InputError, match="a grid, a structure or its solution is needed, got str"):
        st.write("a.obj", "b.obj")  # type: ignore[arg-type]
    for make in (st.grid_from_points, st.grid_from_scan):
        with pytest.raises(st.InputError, match=r"settings must be Settings, as in .*, got float 1\.5"):
            make(np.zeros((9, 3)), 1.5)  # type: ignore[arg-type]


def test_what_a_user_writes_is_checked_strictly(tmp_path: Path) -> None:
    """The steps of the README, and the examples: no Any comes out of the package."""
    pytest.importorskip("mypy")
    path = tmp_path / "user.py"
    path.write_text(STEPS)
    files = [str(path), *map(str, sorted((ROOT / "examples").glob("0*.py")))]
    words = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), "--no-incremental"]
    words += ["--follow-imports=silent", "--config-file", str(ROOT / "pyproject.toml")]
    found = subprocess.run([*words, *files], capture_output=True, text=True, cwd=ROOT / "examples")
    assert found.returncode == 0, found.stdout
    revealed = [line.split("Revealed type is ")[1] for line in found.stdout.splitlines() if "Revealed type" in line]
    assert len(revealed) == 4 and not any("Any" in line and "Grid" not in line for line in revealed), revealed
    assert "scantruss.grid.grid.Grid" in revealed[1] and "float" in revealed[2]
