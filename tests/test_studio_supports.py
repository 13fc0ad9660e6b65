"""Supports of the studio that are placed by clicks: kept where they are while grids come and go."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from studio_dome import done, session_of_dome

import scantruss as st
from scantruss.grid.marks import node_marks
from scantruss.studio.session import Session
from scantruss.studio.state import DEFAULT_STRUCTURE
from scantruss.studio.support_places import asked_supports, is_untouched, switched
from scantruss.studio.tab_structure import StructureTab


def place_of(session: Session, mark: str) -> np.ndarray:
    """Return where a node of the grid is [scan unit]."""
    assert session.grid is not None
    return np.asarray(session.grid.scan_nodes[node_marks(session.grid).index(mark)])


def with_length(session: Session, length: float) -> None:
    """Generate the grid again with another length."""
    session.set("length", length=length)
    done(session)
    session.generate()
    done(session)


def last_mark(session: Session) -> str:
    """Return the mark that supports name last."""
    return session.state.structure_settings.supports.split("+")[-1]


def test_a_support_at_a_node_stays_where_it_is_when_the_grid_is_made_again(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    assert session.grid is not None
    mark = node_marks(session.grid)[-1]
    place = place_of(session, mark)
    assert is_untouched(session.state)
    session.set_structure(supports=f"boundary+{mark}")
    assert not is_untouched(session.state)
    for length in (1.2, 2.0, 2.5):
        with_length(session, length)
        assert np.linalg.norm(place_of(session, last_mark(session)) - place) <= 0.8 * length
    assert last_mark(session) == mark  # of the grid that it was chosen on, whatever lay between
    with_length(session, 1.2)
    assert last_mark(session) != mark
    session.run_structure()
    done(session)
    assert session.solution is not None and session.solution.truss.supports is not None
    held = np.flatnonzero(np.any(session.solution.truss.supports != 0, axis=1))
    assert node_marks(session.grid).index(last_mark(session)) in held
    shown, why = asked_supports(session.state)  # as it is drawn before Run
    assert np.array_equal(shown, held) and why == ""
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert again.state.support_places == session.state.support_places


def test_a_support_without_a_node_is_said_and_nothing_is_solved_without_it(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    assert session.grid is not None
    mark = node_marks(session.grid)[int(session.grid.scan_nodes[:, 0].argmax())]
    session.set_structure(supports=f"corners+{mark}")
    session.crop(("box:0,0,6,6",))
    done(session)
    with_length(session, 1.5)
    assert session.state.structure_settings.supports == f"corners+{mark}?"
    session.run_structure()
    assert session.worker.wait(120) and session.solution is None
    assert session.message.startswith(f"the grid has no node where {mark}? stood at ")
    session.crop(())
    done(session)
    with_length(session, 2.5)
    assert session.state.structure_settings.supports == f"corners+{mark}"


def test_a_click_adds_a_support_to_what_is_typed_and_a_second_takes_it_away() -> None:
    assert switched("fixed", "N019") == "fixed+N019" and switched("", "N019") == "N019"
    assert switched("fixed+N019", "N019") == "fixed" and switched("N019 + N020", "N019") == "N020"


def test_another_scan_has_the_usual_supports_and_no_sizing_of_the_one_before(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.set_structure(
        supports="corners+N001", section="CHS60.3x4", loads="self", size=3, scale=2.0, support_type="fixed"
    )
    kept = session.state.structure_settings
    session.open_example("shell")
    done(session)
    asked = session.state.structure_settings
    assert asked == DEFAULT_STRUCTURE.replace(section="CHS60.3x4", loads=("self",)) and not session.state.support_places
    session.undo()
    assert session.state.structure_settings == kept
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert again.state.structure_settings == kept


def test_a_mark_that_is_lost_is_refused_even_without_a_place(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.set_structure(supports="N900?")
    session.run_structure()
    assert session.worker.wait(120) and "no node where N900?" in session.message
    nodes, why = asked_supports(session.state)
    assert len(nodes) == 0 and why == session.message
    with pytest.raises(st.InputError, match="names a file"):
        session.set_structure(supports="N001+a.csv")


def test_the_first_support_that_is_placed_takes_the_place_of_the_usual_ones_and_others_are_added(
    tmp_path: Path,
) -> None:
    session = session_of_dome(tmp_path, 6.0)
    assert session.grid is not None
    marks, said = node_marks(session.grid), list[str]()
    field = SimpleNamespace(value=DEFAULT_STRUCTURE.supports)
    view = SimpleNamespace(shown_model=lambda: (session.model("grid"), {}), session=session, say=said.append)
    tab: Any = SimpleNamespace(view=view, words={"supports": field})
    StructureTab.support(tab, ("nodes", 3))
    assert session.state.structure_settings.supports == field.value == marks[3]
    assert f"type boundary+{marks[3]} for both" in said[0]
    StructureTab.support(tab, ("nodes", 5))
    assert field.value == f"{marks[3]}+{marks[5]}" and "instead" not in said[1]
    session.set_structure(supports="boundary")
    session.run_structure()
    done(session)
    field.value = "boundary"  # of which a structure was made: no longer untouched
    StructureTab.support(tab, ("nodes", 3))
    assert field.value == f"boundary+{marks[3]}"
