"""Imports go one way, in the order of the tree, and nowhere in a circle; a name stands for one thing, and for something used."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "scantruss"
LAYERS = (  # lowest first; a module imports from its own row and from rows above
    ("__init__", "errors", "runtime"),  # __init__: the version
    ("kernels",),
    ("selection", "settings"),
    ("scan",),
    ("surface", "scan.register"),
    ("boundary", "constraints"),
    ("grid",),  # the record, which front, improve and check share
    ("front",),
    ("improve", "check", "cells"),
    ("pipeline", "candidates", "attempts"),
    ("structure", "layouts", "schedules", "setout", "export", "sweep"),
    ("report", "studio", "cli", "__main__"),
)
MODULES = {
    ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(SOURCE.rglob("*.py"))
}
ROOT = 8  # modules that lie on the root at most


def package_of(name: str) -> str:
    """Return the package that a module lies in; a module of the root stands for itself."""
    return name if MODULES[name].name == "__init__.py" else name.rpartition(".")[0] or name


def layer_of(name: str) -> int:
    """Return the layer of a module by its longest name in the table."""
    words = name.split(".")
    for end in range(len(words), 0, -1):
        for layer, names in enumerate(LAYERS):
            if ".".join(words[:end]) in names:
                return layer
    raise AssertionError(f"{name} has no place in the layers")


@cache
def imports_of(name: str, with_types: bool = False) -> frozenset[str]:
    """Return the modules of the package that a module imports, wherever it does; `with_types`: also for type checkers only."""
    path = MODULES[name]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = {
        inner for node in ast.walk(tree) if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        for inner in ast.walk(node) if not with_types
    }  # fmt: skip
    found = set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or node in skipped:
            continue
        if node.level:
            base = list(path.relative_to(SOURCE).parts[: -node.level])
        elif (node.module or "").split(".")[0] == "scantruss":
            base = []
        else:
            continue
        base += [word for word in (node.module or "").split(".") if word and word != "scantruss"]
        for alias in node.names:
            inner = ".".join([*base, alias.name])
            found.add(inner if inner in MODULES else ".".join(base) or "__init__")
    return frozenset(found) - {name}


@pytest.mark.parametrize("name", sorted(MODULES.keys() - {"__init__"}))
def test_a_module_imports_only_from_its_own_layer_and_below(name: str) -> None:
    for found in imports_of(name):
        assert layer_of(found) <= layer_of(name), f"{name} imports {found}"


def test_kernels_import_kernels_and_runtime_only() -> None:
    for name in MODULES:
        if name.startswith("kernels."):
            assert {found.split(".")[0] for found in imports_of(name)} <= {"kernels", "runtime"}, name


def test_no_modules_import_each_other_in_a_circle() -> None:
    tuple(
        TopologicalSorter({name: imports_of(name) for name in MODULES}).static_order()
    )  # else a CycleError names them


def test_no_packages_import_each_other_in_a_circle_for_types_neither() -> None:
    packages: dict[str, set[str]] = {package_of(name): set() for name in MODULES}
    for name in MODULES.keys() - {"__init__"}:
        found = {package_of(found) for found in imports_of(name, with_types=True) if found != "__init__"}
        packages[package_of(name)] |= found - {package_of(name)}
    tuple(TopologicalSorter(packages).static_order())


def test_few_modules_lie_on_the_root() -> None:
    assert len(list(SOURCE.glob("*.py"))) <= ROOT


def defined_in(name: str) -> Iterator[tuple[str, ast.stmt]]:
    """Yield what a module defines: functions, types and constants, with the statement."""
    for node in ast.parse(MODULES[name].read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name, node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                yield from ((inner.id, node) for inner in ast.walk(target) if isinstance(inner, ast.Name))


def test_constants_and_types_of_two_modules_have_different_names() -> None:
    found = Counter(
        word
        for name in MODULES
        for word, node in defined_in(name)
        if word[0].isupper() and "TypeVar" not in ast.dump(node)
    )
    assert [word for word, count in found.items() if count > 1] == []


def test_functions_of_two_modules_have_different_names() -> None:
    """Unless one is the kernel of the other, or its command."""
    found = Counter(
        (word, next((room for room in ("kernels", "cli") if name.startswith(room)), ""))
        for name in MODULES
        for word, node in defined_in(name)
        if isinstance(node, ast.FunctionDef) and word[0] != "_"
    )
    assert [word for (word, _), count in found.items() if count > 1] == []


def test_what_is_defined_is_used_outside_the_tests() -> None:
    """By the package, benchmarks and scripts, or it is named in the documentation."""
    root = SOURCE.parents[1]
    texts = [
        *MODULES.values(),
        *root.glob("*.*"),
        *(p for name in ("benchmarks", "scripts", "docs") for p in (root / name).rglob("*.*")),
    ]
    words = Counter(
        word
        for path in texts
        if path.suffix in (".py", ".md", ".toml")
        for word in re.findall(r"\w+", path.read_text(encoding="utf-8"))
    )
    assert [
        word for name in MODULES for word, _ in defined_in(name) if words[word] < 2 and not word.startswith("__")
    ] == []
