"""docs/numbers.md, section by section: each is written anew when its figures are, the others stay as they are."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from .ratios import machine

FILE = Path(__file__).resolve().parents[1] / "docs" / "numbers.md"
LOST = "What is lost"
ORDER = (
    LOST,
    "Against everyone",
    "Speed",
    "Structures",
    "Table 2: the examples of the paper",
    "Table 3: by way of a surface",
    "Simulated and real scans",
    "Random surfaces",
)
HEAD = """\
# Numbers

Written by `uv run --group benchmarks python -m benchmarks`, section by section: each says which command wrote it and on
which machine. The machine is shared with other work, so ratios count, not seconds. Our losses come first."""


@dataclass(frozen=True)
class Section:
    """One part of the page."""

    title: str
    command: str  #: what was called after `python -m benchmarks`
    finding: str  #: one sentence with a bold number
    text: str  #: notes and tables
    losses: tuple[str, ...]  #: where we lose, a sentence each
    packages: tuple[str, ...] = ()  #: whose versions are told besides ours

    def body(self) -> str:
        call = f"uv run --group benchmarks python -m benchmarks {self.command}".strip()
        return f"{self.finding}\n\n`{call}` on {machine(self.packages)}.\n\n{self.text.strip()}"


def parts(text: str, mark: str) -> dict[str, str]:
    """Return the bodies by their headings; what stands before the first one has the heading "" ."""
    pieces = re.split(rf"^{mark} (.+)$", text, flags=re.MULTILINE)
    return {title.strip(): body.strip() for title, body in zip(["", *pieces[1::2]], pieces[::2], strict=True)}


def _in_order(titles: Iterable[str]) -> list[str]:
    """Return titles in the order of the page, unknown ones last."""
    return sorted(titles, key=lambda title: (ORDER.index(title) if title in ORDER else len(ORDER), title))


def with_section(page: str, section: Section) -> str:
    """Return the page with a section and its losses put in or written anew."""
    sections = parts(page, "##")
    sections.pop("", None)
    lost = parts(sections.get(LOST, ""), "###")
    lost.pop("", None)
    lost[section.title] = "\n".join(f"- {loss}" for loss in section.losses) or "Nothing."
    sections[LOST] = "\n\n".join(f"### {title}\n\n{lost[title]}" for title in _in_order(lost))
    sections[section.title] = section.body()
    return "\n\n".join([HEAD, *(f"## {title}\n\n{sections[title]}" for title in _in_order(sections))]) + "\n"


def write(section: Section, file: Path = FILE) -> None:
    """Put a section on the page; a page half-written is never there."""
    page = file.read_text(encoding="utf-8") if file.exists() else ""
    beside = file.with_suffix(".part")
    beside.write_text(with_section(page, section), encoding="utf-8", newline="\n")
    beside.replace(file)
