"""Write docs/settings.md from the fields of Settings: python scripts/make_settings_table.py."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from scantruss.cli.options import option_of
from scantruss.settings import Settings

PLACE = Path(__file__).resolve().parents[1] / "docs" / "settings.md"
HEAD = """# Settings

Everything that can be set, in one record: `scantruss.Settings`. Each field is also an option of `scantruss grid`; the other
numbers of the method are named constants, explained in [choices](choices.md). This page is made from the fields by
`scripts/make_settings_table.py`.

| setting | option | symbol | unit | default | choices | what it is | source |
| --- | --- | --- | --- | --- | --- | --- | --- |
"""


def settings_table() -> str:
    """Return the page."""
    rows = []
    for spec in fields(Settings):
        about = spec.metadata
        default = "needed" if spec.name == "length" else "none" if spec.default in ("", (), None) else str(spec.default)
        cells = (
            f"`{spec.name}`",
            f"`{option_of(spec.name)}`",
            about["symbol"],
            about["unit"],
            default,
            ", ".join(about["choices"]),
            about["help"],
            about["source"],
        )
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n")
    return HEAD + "".join(rows)


if __name__ == "__main__":
    PLACE.write_text(settings_table(), encoding="utf-8", newline="\n")
    print(f"wrote {PLACE}")
