"""Every loop of a kernel that is not counted ends by a law, which shows in its form or is said in a comment beside it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

KERNELS = Path(__file__).resolve().parents[1] / "src" / "scantruss" / "kernels"


def loops(path: Path) -> Iterator[tuple[ast.While, str]]:
    """The `while` loops of a file and their first lines."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    return ((node, lines[node.lineno - 1]) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.While))


def bounds(test: ast.expr) -> Iterator[tuple[str, int]]:
    """Names that a condition compares, one of which must rise (1) or fall (-1) for the loop to end."""
    tests = test.values if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.And) else [test]
    for each in tests:
        if isinstance(each, ast.Compare) and len(each.ops) == 1 and isinstance(each.left, ast.Name):
            way = {ast.Lt: 1, ast.LtE: 1, ast.Gt: -1, ast.GtE: -1}.get(type(each.ops[0]))
            if way:
                yield each.left.id, way


def is_counted(loop: ast.While) -> bool:
    """Whether each turn brings a compared number nearer to its bound by a whole step, and nothing takes it back.

    Lists that are walked through count as well: each turn goes on to the next item, and no item is in a list twice.
    """
    for name, way in bounds(loop.test):
        stores = [
            n for n in ast.walk(loop) if isinstance(n, ast.Name) and n.id == name and isinstance(n.ctx, ast.Store)
        ]
        steps = [
            n
            for n in loop.body
            if isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Name) and n.target.id == name
        ]
        if (
            len(stores) == 1
            and len(steps) == 1
            and isinstance(steps[0].value, ast.Constant)
            and steps[0].value.value == 1
        ):
            if isinstance(steps[0].op, ast.Add if way == 1 else ast.Sub):
                return True
        walks = [
            n for n in loop.body
            if isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name) and n.targets[0].id == name
        ]  # fmt: skip
        if len(stores) == 1 and len(walks) == 1 and isinstance(walks[0].value, ast.Subscript | ast.Name) and way == -1:
            return True
    return False


@pytest.mark.parametrize("path", sorted(KERNELS.rglob("*.py")), ids=lambda path: path.stem)
def test_each_loop_ends_by_a_law(path: Path) -> None:
    unsaid = [
        f"{path.name}:{loop.lineno}: {line.strip()}"
        for loop, line in loops(path)
        if not is_counted(loop) and "#" not in line
    ]
    assert unsaid == []


@pytest.mark.parametrize(
    ("code", "ends"),
    [
        ("while i < n:\n    i += 1", True),
        ("while at >= 0:\n    at = following[at]", True),
        ("while at > 0 and a[at - 1] > x:\n    a[at] = 0\n    at -= 1", True),
        ("while i < n:\n    if x:\n        i += 1", False),  # not in every turn
        ("while i < n:\n    i += 1\n    if x:\n        i = 0", False),  # taken back
        ("while i < n:\n    i -= 1", False),
        ("while True:\n    i += 1", False),
    ],
)
def test_the_form_of_a_law(code: str, ends: bool) -> None:
    loop = ast.parse(code).body[0]
    assert isinstance(loop, ast.While) and is_counted(loop) == ends
