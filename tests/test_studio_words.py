"""What the studio refuses is said in words of its page."""

import re
from pathlib import Path

import pytest
from studio_dome import session_of_dome

import scantruss
from scantruss.studio.page_words import OF_COMMAND_LINE, in_words_of_page
from scantruss.studio.session import Session

PATIENCE = 120.0


@pytest.fixture(scope="module")
def dome(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Open a dome with its grid."""
    return session_of_dome(tmp_path_factory.mktemp("dome"), 6.0)


@pytest.mark.parametrize(
    ("supports", "said"),
    [
        ("", "no supports; name some in supports: corners, boundary"),
        ("fixed", "the grid has no fixed nodes; place some in Constraints, Fixed nodes, or name others in supports: "),
        ("cornets", "no supports 'cornets' (did you mean corners?); name some in supports"),
        ("ends", "no supports"),
        ("N900", "the nodes are marked N001 to"),
    ],
)
def test_supports_that_are_refused_name_fields_of_the_page(dome: Session, supports: str, said: str) -> None:
    dome.set_structure(supports=supports)
    dome.run_structure()
    assert dome.worker.wait(PATIENCE)
    assert said in dome.message and "--" not in dome.message and " file" not in dome.message
    assert not re.search(r"scantruss \w", dome.message)


@pytest.mark.parametrize(
    ("said", "on_page"),
    [
        ("no grid lies there; leave --symmetry out", "no grid lies there; choose no symmetry in Constraints"),
        ("not known; give it with --unit mm|cm|m|inch|foot", "not known; choose it in Scan, unit"),
        ("the unit of the grid is not known, and a schedule needs it; give --unit mm, cm, m, inch or foot",
         "the unit of the grid is not known, and a schedule needs it; choose it in Scan, unit"),
        ("choose the part that is wanted with --crop or --piece; --keep-failed gives it all the same",
         "choose the part that is wanted with Scan, Crop"),
        ("in two; --keep-failed gives it all the same", "in two"),
        ("use another length, or --ridge-angle 0", "use another length, or follow no ridge (Design, Holes and ridges)"),
        ("use --joints pinned", f"use --joints pinned ({OF_COMMAND_LINE})"),
        ("a length of 3 -- or 4", "a length of 3 -- or 4"),
    ],
)  # fmt: skip
def test_options_of_the_command_line_are_named_as_on_the_page(said: str, on_page: str) -> None:
    assert in_words_of_page(said) == on_page


def test_no_message_of_supports_keeps_an_option() -> None:
    source = Path(scantruss.__file__).parent / "structure" / "supports.py"
    for said in re.findall(r'"([^"\n]*--[a-z][^"\n]*)"', source.read_text()):
        assert "--" not in in_words_of_page(said), said
