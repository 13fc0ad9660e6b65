"""Symmetry: mirror planes or the rotation that the grid keeps exactly, found in the scan or typed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..settings.values import ROTATION_NUMBERS, SYMMETRIES_FOUND
from .drawn_lines import numbers_of
from .frame import DRAWN_EXTENT, SceneFrame

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

PLANE_COLOR = (90, 120, 200)
PLANE_REACH = 0.6  #: of a plane that is drawn, from its middle [extent of the scan]
SYMMETRIES = ("none", *SYMMETRIES_FOUND, "typed")


class SymmetryTool:
    """Chooses mirror planes and draws those that the grid keeps."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.way = gui.add_dropdown(
            "planes",
            SYMMETRIES,
            hint="auto finds planes in the scan, else a rotation; rotation finds that only; typed takes what is below",
        )
        self.words = gui.add_text(
            "plane",
            "",
            hint="x, y, z, nx, ny, nz: a point and a normal, in the frame of the scan; or a point, an axis and the parts of a turn",
        )
        self._count = 0
        self.way.on_update(view.step(self._set))
        self.words.on_update(view.typed(lambda: self._set() if self.way.value == SYMMETRIES[-1] else None))

    def _set(self) -> None:
        way, session = self.way.value, self.view.session
        plane: Any = "" if way == SYMMETRIES[0] else way
        if way == SYMMETRIES[-1]:
            if not self.words.value.strip():
                self.view.say("type a plane: x, y, z, nx, ny, nz")
                return
            count = ROTATION_NUMBERS if len(self.words.value.split(",")) == ROTATION_NUMBERS else 6
            plane = (numbers_of(self.words.value, count, "a mirror plane needs a point and a normal, six numbers"),)
        if plane != session.settings.symmetry:
            session.set("symmetry", symmetry=plane)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the planes of a state."""
        asked = state.settings.symmetry
        if before is None or before.settings.symmetry != asked:
            self.way.value = asked if asked in SYMMETRIES_FOUND else SYMMETRIES[-1 if asked else 0]
            if asked and not isinstance(asked, str):
                self.words.value = ", ".join(f"{number:.7g}" for number in asked[0])
        if before is not None and before.grid is state.grid and before.cloud is state.cloud:
            return
        made = state.grid.settings if state.grid is not None else None
        rows = made.symmetry if made is not None and not isinstance(made.symmetry, str) else ()
        planes = [row for row in rows if len(row) != ROTATION_NUMBERS]
        self.view.scene.remove(*(f"/mirror/{k}" for k in range(self._count)))
        self._count = len(planes)
        for k, plane in enumerate(planes):
            assert state.cloud is not None
            corners = corners_of(SceneFrame.of(state.cloud), np.array(plane, float))
            faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
            self.view.scene.api.add_mesh_simple(
                f"/mirror/{k}", corners, faces, color=PLANE_COLOR, side="double", opacity=0.25, flat_shading=True,
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip


def corners_of(frame: SceneFrame, plane: np.ndarray) -> np.ndarray:
    """Return the corners (4, 3) of a plane as it is drawn around the middle of the scan, float32."""
    normal = plane[3:] / np.linalg.norm(plane[3:])
    at = frame.to_scene(plane[None, :3])[0].astype(float)
    middle = normal * (normal @ at)
    aside = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    aside = aside / np.linalg.norm(aside)
    up = np.cross(normal, aside)
    reach = PLANE_REACH * DRAWN_EXTENT
    corners = [middle + reach * (a * aside + 0.5 * b * up) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array(corners, np.float32)
