"""The documentation: what it names exists, and its commands are understood."""

import importlib
import inspect
import re
from pathlib import Path
from typing import Any

import pytest
from marks import compiled_only

import scantruss as st
from scantruss.cli.commands import COMMANDS
from scantruss.grid.certificate import KINDS_LEFT_OUT
from scantruss.pipeline import grid_from_cloud

DOCS = Path(__file__).resolve().parents[1] / "docs"
SOURCE = DOCS.parent / "src" / "scantruss"


def exists(name: str) -> bool:
    """Whether a dotted name of the package is there: a module, or a name in one."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        if (SOURCE.joinpath(*parts[:end])).with_suffix(".py").exists() or (
            SOURCE.joinpath(*parts[:end]) / "__init__.py"
        ).exists():
            found: Any = importlib.import_module(".".join(["scantruss", *parts[:end]]))
            for part in parts[end:]:
                found = getattr(found, part, None)
            return found is not None
    return False


@pytest.mark.parametrize("page", ["paper-to-code.md", "api.md", "architecture.md", "choices.md", "limits.md"])
def test_what_a_page_names_exists(page: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    packages = "|".join(path.stem for path in SOURCE.iterdir() if path.suffix in ("", ".py") and path.stem[0] != "_")
    names = set(re.findall(rf"`((?:{packages})\.[\w.]+)`", text)) - {
        "pipeline.py",
        "attempts.py",
        "candidates.py",
        "settings.py",
    }
    names |= {name.removeprefix("scantruss.") for name in re.findall(r"^::: (\S+)", text, re.MULTILINE)}
    assert [name for name in sorted(names) if not exists(name)] == []
    for path in re.findall(r"`((?:\w+/)+\w+\.py)`", text):
        assert (SOURCE / path).exists() or (DOCS.parent / path).exists(), path


def test_what_computes_an_equation_says_its_number() -> None:
    """For each equation, case of Table 1, stop and for Fig. 4 one of the names in its row has the number in its source."""
    page = (DOCS / "paper-to-code.md").read_text(encoding="utf-8")
    said: dict[str, set[str]] = {}
    for _, paper, code, *_ in (row.split("|") for row in page.splitlines() if row.startswith("| ")):
        names = [name for name in re.findall(r"`([a-z][\w.]+)`", code) if exists(name)]
        numbers = set().union(*(numbers_in(source_of(name)) for name in names))
        said |= {number: said.get(number, set()) | numbers for number in numbers_in(paper)}
    wanted = [f"eq {n}" for n in range(1, 11)] + [f"case {n}" for n in range(1, 7)] + [f"stop {n}" for n in "abc"]
    assert [number for number in [*wanted, "fig 4"] if number not in said.get(number, ())] == []


def numbers_in(text: str) -> set[str]:
    """Return all that a text mentions as "Eqs. 5-7", "cases 1, 2" or "Stop (a)", one by one: "eq 5", "eq 6" and so on."""
    found = set()
    for kind, numbers in re.findall(r"\b(eq|case|stop|fig)s?\.? ([\d(][\d()a-d, n-]*)", text.lower()):
        found |= {f"{kind} {n}" for n in re.findall(r"\d+|(?<=\()[a-c]", numbers)}
        for first, last in re.findall(r"(\d+)-(\d+)", numbers):
            found |= {f"{kind} {n}" for n in range(int(first), int(last) + 1)}
    return found


def source_of(name: str) -> str:
    """Return the source of a dotted name of the package, none of a constant."""
    found: Any = importlib.import_module("scantruss")
    for part in name.split("."):
        found = getattr(found, part, None) or importlib.import_module(f"{found.__name__}.{part}")
    found = getattr(found, "py_func", found)
    return inspect.getsource(found) if callable(found) or inspect.ismodule(found) else ""


@pytest.mark.parametrize("page", sorted(str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md")))
def test_the_options_of_each_command_that_is_shown_exist(page: str) -> None:
    for line in re.findall(r"^ +(scantruss \w+ .*)$", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE):
        words = line.split("#")[0].split()
        if words[1] in COMMANDS:
            known = COMMANDS[words[1]][0]().format_help()
            for option in (word.partition("=")[0] for word in words if re.match("--?[a-z]", word)):
                assert re.search(rf"(^|[\s,]){re.escape(option)}\b", known), f"{page}: {line}: {option}"


def test_each_message_in_the_page_on_troubles_is_one_of_ours() -> None:
    said = " ".join(re.sub(r'"\s*\n\s*f?"', "", path.read_text(encoding="utf-8")) for path in SOURCE.rglob("*.py"))
    heads = re.findall(r'\*\*"([^"]+)"\*\*', (DOCS / "troubleshooting.md").read_text(encoding="utf-8"))
    assert len(heads) > 20
    assert [head for head in heads if head not in said] == []


def test_every_page_is_in_the_navigation() -> None:
    named = set(re.findall(r"([\w/-]+\.md)", (DOCS.parent / "mkdocs.yml").read_text(encoding="utf-8")))
    assert {str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md")} == named


def test_every_line_of_a_result_is_explained() -> None:
    """Each name of a figure, each kind of what is left out, each kind of fault and warning is on a page."""
    page = (DOCS / "result.md").read_text(encoding="utf-8").lower()
    figures = "".join(
        (SOURCE / name).read_text(encoding="utf-8") for name in ("report/figures.py", "grid/certificate.py")
    )
    names = re.findall(r'^ {8,12}\("([a-z][a-z, /]+)", (?:"|self\.|_largest)', figures, re.MULTILINE)
    assert len(names) > 15
    names = [name.split(",")[0] for name in names]  # mean, std and smallest share a row
    names += [words.split(",")[0] for words in KINDS_LEFT_OUT.values()]
    names += [
        "points to grid",
        "triangles to scan",
        "nodes to scan",
        "warning: the grid",
        "certificate:",
        "left out",
        "seconds",
        "wrote",
    ]
    assert [name for name in names if name.lower() not in page] == []


@compiled_only
def test_the_readme_says_how_much_the_members_of_its_examples_vary() -> None:
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    cloud = st.read_points(SOURCE / "data" / "shell.ply")
    varies = {
        length: 100.0 * grid_from_cloud(cloud, st.Settings(length=length)).quality.length_cv for length in (0.8, 1.5)
    }
    said = f"{varies[0.8]:.1f} to {varies[1.5]:.1f} %"
    assert text.count(said) == 2 and said in (DOCS / "index.md").read_text(encoding="utf-8"), said
