"""Imports go one way: scan -> boundary -> front -> grid -> files, kernels below, the command line above."""

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "scantruss"
LAYERS = (  # lowest first; a module imports from its own line and from lines above
    ("errors", "kernels", "vectors", "__init__"),  # __init__: the version
    ("selection", "settings", "machine", "workers"),
    ("scan", "clean"),
    ("splice",),
    ("grid.grid", "grid.quality"),  # the type that front, grid and export share
    ("curves",),
    ("rolls", "corners", "fill", "lines"),
    ("edge",),
    ("boundary",),
    ("lines.find",),
    ("rows", "slits"),
    ("front",),
    ("grid",),
    ("candidates",),
    ("pipeline",),
    ("structure",),
    ("export",),
    ("sweep",),
    ("report", "demo"),
    ("options", "studio", "commands"),
    ("cli", "__main__"),
)
MODULES = sorted(path.relative_to(SOURCE).with_suffix("").parts for path in SOURCE.rglob("*.py"))


def layer_of(parts):
    """Return the layer of a module by its longest name in the table."""
    for end in range(len(parts), 0, -1):
        for layer, names in enumerate(LAYERS):
            if ".".join(parts[:end]) in names:
                return layer
    raise AssertionError(f"{'.'.join(parts)} has no place in the layers")


def imports_of(tree, parts):
    """Yield the modules of the package that a module imports, wherever it does; not what only type checkers see."""
    skipped = {
        inner for node in ast.walk(tree) if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        for inner in ast.walk(node)
    }  # fmt: skip
    for node in (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node not in skipped):
        if node.level == 0 and (node.module or "").split(".")[0] != "scantruss":
            continue
        base = list(parts[: len(parts) - node.level]) if node.level else []
        base += [name for name in (node.module or "").split(".") if name and name != "scantruss"]
        for alias in node.names:
            inner = (*base, alias.name)
            yield inner if inner in MODULES or (*inner, "__init__") in MODULES else tuple(base) or ("__init__",)


@pytest.mark.parametrize("parts", [parts for parts in MODULES if parts != ("__init__",)], ids=".".join)
def test_a_module_imports_only_from_its_own_layer_and_below(parts):
    tree = ast.parse(SOURCE.joinpath(*parts).with_suffix(".py").read_text(encoding="utf-8"))
    for found in imports_of(tree, parts):
        assert layer_of(found) <= layer_of(parts), f"{'.'.join(parts)} imports {'.'.join(found)}"
        assert parts[0] != "kernels" or found[0] == "kernels", "kernels import nothing else of the package"
