"""Tab: what is taken away, in every format, and the command lines that repeat the work."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from ..export.formats import GRID, STRUCTURE, suffixes_of
from ..runtime.progress import Progress
from .further_files import FURTHER_FILES, further_files
from .outputs import PREVIEW_WORDS, Note, project_file, settings_files
from .page_words import in_words_of_page
from .presses import Call

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView


PROGRAMS = {
    ".3dm": "Rhino", ".3mf": "3D printing", ".compas.json": "COMPAS", ".csv": "spreadsheets", ".dxf": "AutoCAD and others",
    ".geojson": "QGIS and others", ".glb": "Blender, viewers", ".html": "any browser", ".ifc": "BIM: Revit, Archicad, Tekla",
    ".inp": "Abaqus", ".json": "ScanTruss", ".karamba.json": "Karamba", ".obj": "Rhino, Blender", ".ply": "MeshLab, CloudCompare",
    ".png": "a picture", ".py": "OpenSeesPy", ".s2k": "SAP2000", ".saf.xlsx": "SAF: SCIA, RFEM", ".step": "CAD: solids and curves",
    ".stl": "3D printing", ".stp": "CAD: solids and curves", ".tcl": "OpenSees", ".vtu": "ParaView", ".xlsx": "Excel and others",
}  # fmt: skip  #: that read what is written, by its suffix


def words_of_suffix(suffix: str) -> str:
    """Return a suffix with the programs that read it."""
    return f"{suffix}  {PROGRAMS[suffix]}"


class OutTab:
    """Downloads."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        session = view.session
        self.preview = gui.add_markdown(PREVIEW_WORDS, visible=False)
        self.suffix, self.buttons = dict[str, Any](), dict[str, Any]()
        for kind in (GRID, STRUCTURE):
            known = tuple(map(words_of_suffix, suffixes_of(kind)))
            self.suffix[kind] = gui.add_dropdown(kind, known, initial_value=words_of_suffix(".json"))
            self.buttons[kind] = gui.add_button(f"Download the {kind}")
            self.buttons[kind].on_click(self._download(partial(self._files, kind)))
        gui.add_button("Download the settings").on_click(self._download(lambda _: settings_files(session.state)))
        gui.add_button("Download the project").on_click(
            self._download(lambda _: project_file(session.state, session.place))
        )
        self.further = gui.add_dropdown(
            "further", FURTHER_FILES, hint="schedules and reports are of the structure once it is run"
        )
        self.size = gui.add_number(
            "printed size", 200.0, min=1.0, step=10.0, hint="longest side of the model to print [mm]"
        )
        self.that = gui.add_button("Download that")
        self.that.on_click(view.step(self._make_further))
        self.notes = gui.add_markdown("", visible=False)
        gui.add_markdown("The same from the command line, with the settings beside it:")
        self.command = gui.add_markdown("")

    def _files(self, kind: str, note: Note) -> dict[str, bytes]:
        return self.view.session.files(kind, self.suffix[kind].value.split()[0], note)

    def _download(self, files: Callable[[Note], dict[str, bytes]]) -> Call:
        return self.view.aside(lambda: self._send(files))

    def _make_further(self) -> None:
        """Make the file in the background, for some take long."""
        session, what, size = self.view.session, self.further.value, float(self.size.value)

        def make(progress: Progress) -> None:
            progress(what, 0.1)
            self._send(lambda note: further_files(session.state, what, size, note))

        session.worker.ask(make)

    def _send(self, make: Callable[[Note], dict[str, bytes]]) -> None:
        """Make files and send them; below the buttons stands what the command line would say of them."""
        notes = list[str]()
        files = make(notes.append)
        for name, content in files.items():
            self.view.client.send_file_download(name, content, save_immediately=True)
        said = "\n".join(f"- {in_words_of_page(words)}" for words in dict.fromkeys(notes))
        self.notes.content, self.notes.visible = f"**{' '.join(files)}**:\n\n{said}", bool(notes)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the command lines of a state, and whether its grid is a preview."""
        self.preview.visible = state.is_live
        if before is not state:
            self.command.content = f"```\n{self.view.session.command()}\n```"
