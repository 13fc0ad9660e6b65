"""Tab: what is taken away, in every format, and the command lines that repeat the work."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from ..export.formats import GRID, STRUCTURE, suffixes_of
from .outputs import project_file, settings_files

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView


class OutTab:
    """Downloads."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        session = view.session
        self.suffix: dict[str, Any] = {}
        for kind in (GRID, STRUCTURE):
            self.suffix[kind] = gui.add_dropdown(kind, tuple(suffixes_of(kind)), initial_value=".json")
            button = gui.add_button(f"Download the {kind}")
            button.on_click(self._download(partial(self._files, kind)))
        gui.add_button("Download the settings").on_click(self._download(lambda: settings_files(session.state)))
        gui.add_button("Download the project").on_click(
            self._download(lambda: project_file(session.state, session.place))
        )
        gui.add_markdown("The same from the command line, with the settings beside it:")
        self.command = gui.add_markdown("")

    def _files(self, kind: str) -> dict[str, bytes]:
        return self.view.session.files(kind, self.suffix[kind].value)

    def _download(self, files: Callable[[], dict[str, bytes]]) -> Callable[[Any], None]:
        def send() -> None:
            for name, content in files().items():
                self.view.client.send_file_download(name, content, save_immediately=True)

        return self.view.step(send)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the command lines of a state."""
        if before is not state:
            self.command.content = f"```\n{self.view.session.command()}\n```"
