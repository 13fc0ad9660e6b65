"""The studio without a browser: session, worker, project file."""

import asyncio
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from studio_dome import done, session_of_dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.pipeline import grid_from_cloud
from scantruss.report.advice import Advice
from scantruss.runtime.progress import Progress
from scantruss.studio.head import words_of_session
from scantruss.studio.in_order import InOrder
from scantruss.studio.project import read_project
from scantruss.studio.session import Session
from scantruss.studio.typed_fields import TypedFields
from scantruss.studio.worker import Worker

PATIENCE = 120.0


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """Save a shallow dome of points."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 10, 60), np.linspace(0, 10, 60)))
    z = 2 - 0.04 * ((x - 5) ** 2 + (y - 5) ** 2)
    path = tmp_path / "dome.xyz"
    np.savetxt(path, np.stack([x + 4.5e5, y + 5.3e6, z], axis=1), fmt="%.6f")
    return path


def opened(scan: Path, project: Path | None = None) -> Session:
    """Open a scan in metres."""
    session = Session(project)
    session.open(scan)
    session.set_unit("m")
    session.change("length", settings=session.settings.replace(length=1.0))
    return session


def made(session: Session) -> Session:
    """Generate, and wait for the grid."""
    session.generate()
    assert session.worker.wait(PATIENCE)
    assert session.message == "" and session.grid is not None
    return session


def test_the_grid_of_the_studio_is_that_of_the_library(scan: Path) -> None:
    session = made(opened(scan))
    assert session.cloud is not None and session.grid is not None
    grid = grid_from_cloud(session.cloud, session.settings)
    assert np.array_equal(grid.nodes, session.grid.nodes) and np.array_equal(grid.triangles, session.grid.triangles)


def test_the_newest_length_wins_and_a_live_grid_is_never_saved(scan: Path, tmp_path: Path) -> None:
    session = opened(scan, tmp_path / "a.scantruss")
    session.save()
    before = (tmp_path / "a.scantruss").read_bytes()
    for length in (0.8, 0.9, 1.1, 1.25):
        assert session.live(length)
    assert session.worker.wait(PATIENCE)
    assert session.grid is not None and session.grid.settings is not None
    assert session.grid.settings.length == 1.25 and session.state.is_live
    assert (tmp_path / "a.scantruss").read_bytes() == before


def test_a_project_opens_as_it_was(scan: Path, tmp_path: Path) -> None:
    place = tmp_path / "dome.scantruss"
    session = made(opened(scan, place))
    session.set_structure(supports="boundary", section="CHS60.3x4", loads="self,snow:1kN/m2")
    session.run_structure()
    assert session.worker.wait(PATIENCE) and session.message == ""
    again = Session(place)
    again.open(place)
    assert session.cloud is not None and again.cloud is not None
    assert np.array_equal(again.cloud.points, session.cloud.points)
    assert np.array_equal(again.cloud.origin, session.cloud.origin) and again.cloud.unit == "m"
    assert again.settings == session.settings and again.state.structure_settings == session.state.structure_settings
    for kind, suffix in (("grid", ".json"), ("grid", ".obj"), ("structure", ".json")):
        assert again.files(kind, suffix) == session.files(kind, suffix)
    assert again.command() == session.command()
    kept = place.read_bytes()
    again.save()
    assert place.read_bytes() == kept


def test_every_format_of_the_table_comes_out(scan: Path) -> None:
    session = made(opened(scan))
    for suffix in (".csv", ".html", ".ifc", ".ply", ".png"):
        assert all(session.files("grid", suffix).values())
    with pytest.raises(st.InputError, match="no structure yet"):
        session.files("structure", ".json")


def test_what_is_refused_is_said_and_the_studio_goes_on(scan: Path) -> None:
    session = opened(scan)
    session.change("length", settings=session.settings.replace(length=50.0))
    session.generate()
    assert session.worker.wait(PATIENCE)
    with pytest.raises(st.ScanTrussError) as refused:
        assert session.cloud is not None
        grid_from_cloud(session.cloud, session.settings)
    assert session.message == " ".join(str(refused.value).split())
    session.change("length", settings=session.settings.replace(length=1.0))
    made(session)


def test_an_upload_is_read_under_its_own_name_and_a_bad_one_is_refused(scan: Path) -> None:
    session = Session()
    session.open_upload("../../dome.xyz", scan.read_bytes())
    assert session.worker.wait(PATIENCE) and session.message == ""
    assert session.cloud is not None and session.cloud.name == "dome.xyz" and len(session.cloud.points) == 3600
    session.open_upload("no.xyz", b"no numbers")
    assert session.worker.wait(PATIENCE)
    assert "no.xyz" in session.message and session.cloud.name == "dome.xyz"


@pytest.mark.parametrize("content", [b"", b"1 2 3\n", b"no numbers"])
def test_what_is_refused_of_a_scan_is_said_as_the_command_line_does(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "no.xyz").write_bytes(content)
    monkeypatch.chdir(tmp_path)
    assert main(["info", "no.xyz"]) == 2
    words = capsys.readouterr().err.removeprefix("scantruss: ").strip()
    uploaded, named = Session(), Session(folder=tmp_path)
    uploaded.open_upload("no.xyz", content)
    named.open_path("no.xyz")
    for session in (uploaded, named):
        assert session.worker.wait(PATIENCE) and session.message == words


@pytest.mark.parametrize("words", ["own.csv", "own.csv:A", "loads.toml", "/etc/passwd"])
def test_the_page_reads_no_file(words: str) -> None:
    for name in ("supports", "section", "material", "loads"):
        with pytest.raises(st.InputError, match="names a file"):
            Session().set_structure(**{name: words})


def test_a_stopped_run_leaves_the_grid_before_it(scan: Path) -> None:
    session = made(opened(scan))
    before = session.grid
    session.listen(session.stop)  # as soon as it has begun
    session.change("length", settings=session.settings.replace(length=0.8))
    session.generate()
    assert session.worker.wait(PATIENCE)
    assert session.grid is before and session.message == ""


def test_a_crash_leaves_the_worker_alive() -> None:
    told: list[Exception | None] = []
    worker = Worker(told.append, lambda stage, share: None)

    def crash(progress: Progress) -> None:
        raise ZeroDivisionError

    worker.ask(crash)
    assert worker.wait(PATIENCE)
    worker.ask(lambda progress: None)
    assert worker.wait(PATIENCE)
    assert [type(one) for one in told] == [ZeroDivisionError, type(None)]


def test_a_quick_request_gives_way_to_a_run() -> None:
    worker = Worker(lambda error: None, lambda stage, share: None)
    go = threading.Event()
    done: list[str] = []

    def run(progress: Progress) -> None:
        go.wait(PATIENCE)
        done.append("run")

    assert worker.ask(run)
    time.sleep(0.01)
    assert not worker.ask(lambda progress: done.append("quick"), quick=True)
    go.set()
    assert worker.wait(PATIENCE) and done == ["run"]


def _note(done: list[int], number: int, _: Progress) -> None:
    done.append(number)


def test_of_quick_requests_that_follow_fast_some_come_to_their_end() -> None:
    """A slider that moves without a pause would else show nothing until it rests."""
    worker = Worker(lambda error: None, lambda stage, share: None)
    begun, go = threading.Event(), threading.Event()
    done: list[int] = []

    def first(progress: Progress) -> None:
        begun.set()
        go.wait(PATIENCE)
        progress("grid", 0.5)
        done.append(0)

    assert worker.ask(first, quick=True) and begun.wait(PATIENCE)
    for number in (1, 2, 3):
        assert worker.ask(partial(_note, done, number), quick=True)
    go.set()
    assert worker.wait(PATIENCE) and done == [0, 3]  # what runs, then the newest


@pytest.mark.parametrize("refused", [False, True])
def test_a_run_that_goes_on_with_another_waits_for_it(refused: bool) -> None:
    """The structure is that of the grid that is being made, not of the one before."""
    told: list[Exception | None] = []
    worker = Worker(told.append, lambda stage, share: None)
    begun, go = threading.Event(), threading.Event()
    done: list[str] = []

    def grid(progress: Progress) -> None:
        begun.set()
        go.wait(PATIENCE)
        progress("front", 0.5)
        done.append("grid")
        if refused:
            raise st.InputError("no")

    assert worker.ask(grid) and begun.wait(PATIENCE)
    assert worker.ask(lambda progress: done.append("structure"), then=True)
    go.set()
    assert worker.wait(PATIENCE)
    assert done == (["grid"] if refused else ["grid", "structure"])
    assert [type(each) for each in told] == (
        [st.InputError] if refused else [type(None)] * 2
    )  # which stays on the page


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"text"])
def test_a_damaged_project_is_refused_in_one_line(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.scantruss"
    path.write_bytes(content)
    with pytest.raises(st.FormatError, match="no project of scantruss studio"):
        read_project(path)
    with pytest.raises(st.FormatError, match="cannot read"):
        read_project(tmp_path / "none.scantruss")


def test_what_a_pointer_does_is_taken_in_its_order() -> None:
    in_order, taken, last = InOrder(), list[int](), threading.Event()

    def take(number: int) -> None:
        time.sleep(0.05 if number == 0 else 0.0)  # the first takes longest
        taken.append(number)
        if number == 9:
            last.set()

    call = in_order(take)

    async def events() -> None:
        for number in range(10):
            await call(number)

    asyncio.run(events())
    assert last.wait(PATIENCE) and taken == list(range(10))
    in_order.close()


def test_an_event_that_fails_keeps_none_from_being_taken(capsys: pytest.CaptureFixture[str]) -> None:
    in_order, taken = InOrder(), threading.Event()

    def fails(_: object) -> None:
        raise ZeroDivisionError

    async def events() -> None:
        await in_order(fails)(None)
        await in_order(lambda _: taken.set())(None)

    asyncio.run(events())
    assert taken.wait(PATIENCE) and "ZeroDivisionError" in capsys.readouterr().err
    in_order.close()


class Field:
    """A text field of a page."""

    def __init__(self, value: str) -> None:
        self.value = value

    def on_update(self, note: Callable[[Any], Any]) -> None:
        """Keep what is called when somebody types."""
        self.note = note


def test_a_step_of_one_field_writes_over_nothing_that_waits_in_another() -> None:
    in_order, fields, taken = InOrder(), (Field("0"), Field("0")), list[str]()

    def do(step: Callable[[], None]) -> bool:
        step()
        for each in fields:  # as a page that shows its state again
            typed.show(each, "0")
        return True

    typed = TypedFields(in_order, do)
    for each in fields:
        typed.on_typed(each, partial(lambda one: taken.append(one.value), each))
        each.value = "6"
        asyncio.run(each.note(SimpleNamespace(client=1)))
    assert typed.take() and taken == ["6", "6"]
    in_order.close()


class CrossedField(Field):
    """A field that somebody types into while the server writes there."""

    def __init__(self, typed: str) -> None:
        self.page = self.kept = ""
        self.typed = typed
        self.typing: threading.Thread | None = None

    @property
    def value(self) -> str:
        return self.kept

    @value.setter
    def value(self, text: str) -> None:
        self.page = text  # sent first, as viser does
        if self.typing is None:  # what was typed comes after it was sent, before it is kept
            self.kept, noted = self.typed, threading.Event()

            def tell() -> None:
                noted.set()
                asyncio.run(self.note(SimpleNamespace(client=1)))

            self.typing = threading.Thread(target=tell)
            self.typing.start()
            noted.wait(30.0)
            self.typing.join(0.2)  # it waits for who writes
        self.kept = text


def test_what_is_typed_while_the_server_writes_counts_and_is_seen() -> None:
    in_order, field, taken = InOrder(), CrossedField("6"), list[str]()

    def do(step: Callable[[], None]) -> bool:
        step()
        typed.show(field, taken[-1])
        return True

    def step() -> None:
        typed.show(field, "0")  # another thread, which shows what was there before
        taken.append(field.value)

    typed = TypedFields(in_order, do)
    typed.on_typed(field, step)
    typed.show(field, "0")
    assert field.typing is not None
    field.typing.join()
    assert typed.take() and taken == ["6"] and field.page == field.value == "6"
    in_order.close()


def test_the_length_that_is_tried_is_that_of_info_and_can_be_undone(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 10.0)
    done(session)
    cloud, before = session.cloud, session.settings.length
    assert cloud is not None
    session.try_lengths()
    done(session)
    assert session.settings.length == Advice(cloud, session.settings).suggest() != before
    assert session.grid is not None and session.grid.certificate is not None and session.grid.certificate.passed
    assert session.grid.settings is not None and session.grid.settings.length == session.settings.length
    assert words_of_session(session).endswith(f"{session.settings.length:g} is taken")
    session.undo()
    assert session.settings.length == before and "taken" not in words_of_session(session)
