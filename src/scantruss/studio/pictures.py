"""Pictures and turntables of the drawing, as files."""

from __future__ import annotations

import io
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..runtime.progress import Progress
from .frame import ROOM_AROUND
from .legend import with_legends
from .scene import sky

if TYPE_CHECKING:
    from .view import StudioView

LARGE_PICTURE = (2160, 3840)  #: height and width of a picture [pixel]
TURN_SIZE = (540, 960)  #: height and width of a turntable [pixel]
TURN_FRAMES, TURN_MILLISECONDS = 36, 100  #: of a turntable, and how long each is shown
TURNED_POINTS = 5_000  #: that a turntable must show
PICTURE_PATIENCE = 120.0  #: how long the browser may take for a picture [s]
BEHIND_PICTURE = {False: (255, 255, 255), True: (20, 20, 20)}  #: behind a picture of a light and a dark page


class PictureTool:
    """Takes pictures of what is drawn, as the page shows it."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        gui.add_button("Picture, 3840 x 2160").on_click(view.aside(self._picture))
        gui.add_button("Turntable, GIF").on_click(view.step(self._turntable))

    def _picture(self) -> None:
        height, width = LARGE_PICTURE
        self._send("scantruss.png", [self._shot(height, width)], "PNG")

    def _turntable(self) -> None:
        cloud = self.view.session.cloud
        if cloud is None:
            raise InputError("there is no scan yet; open one")
        every = max(1, len(cloud.points) // TURNED_POINTS)
        drawn = self.view.frame.to_scene(np.asarray(cloud.points[::every]) + cloud.origin)
        self.view.say(f"taking {TURN_FRAMES} pictures; keep the page in front")
        self.view.session.worker.ask(partial(self._take_turn, drawn))

    def _take_turn(self, drawn: np.ndarray, progress: Progress) -> None:
        """Take the pictures of a turntable that shows places of the scene (N, 3), as a task that Stop ends."""
        progress("turntable", 0.0)
        camera = self.view.client.camera
        position, target = np.array(camera.position), np.array(camera.look_at)
        turns = [2 * np.pi * k / TURN_FRAMES for k in range(TURN_FRAMES)]
        places = np.array([target + about_z(turn) @ (position - target) for turn in turns])
        fov = min(float(camera.fov), angle_to_see(drawn, places, target, TURN_SIZE[1] / TURN_SIZE[0]))
        frames = []
        for at in places:
            frames.append(self._shot(*TURN_SIZE, wxyz=facing(at, target), position=tuple(at), fov=fov))
            progress("turntable", len(frames) / TURN_FRAMES)
        self._send("turntable.gif", frames, "GIF")

    def _shot(self, height: int, width: int, **camera: Any) -> np.ndarray:
        """Return what the browser draws before the sky or a plain page, (height, width, 3) uint8."""
        look, scene = self.view.look, self.view.scene
        is_fine, is_dark = bool(look.tubes.value), bool(look.dark.value)
        times = max(height / max(float(self.view.client.camera.image_height), 1.0), 1.0)
        try:
            if times > 1.0:
                look.draw(for_picture=True)
                scene.widen_lines(times)
            scene.api.set_background_image(None)  # the page stretches it to its own window
            pixels = self.view.client.get_render(
                height, width, timeout=PICTURE_PATIENCE, transport_format="png", **camera
            )
        except (RuntimeError, TimeoutError):
            raise InputError("the browser gave no picture; keep the page open and in front") from None
        finally:
            if times > 1.0:
                look.draw()
                scene.widen_lines(1.0)
            if is_fine:
                scene.api.set_background_image(sky(is_dark))
        picture = over(pixels, sky(is_dark, height) if is_fine else np.array(BEHIND_PICTURE[is_dark], np.uint8))
        return with_legends(picture, self.view.legends.shown, is_dark)

    def _send(self, name: str, frames: list[np.ndarray], kind: str) -> None:
        from PIL import Image

        first, *others = [Image.fromarray(each) for each in frames]
        more = {"save_all": True, "append_images": others, "duration": TURN_MILLISECONDS, "loop": 0} if others else {}
        stream = io.BytesIO()
        first.save(stream, kind, **more)
        self.view.client.send_file_download(name, stream.getvalue(), save_immediately=True)


def over(pixels: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """Return a picture (H, W, 4) before a background (H, 1, 3) or of one colour (3,), (H, W, 3) uint8."""
    share = pixels[:, :, 3:].astype(np.float32) / 255.0
    mixed = share * pixels[:, :, :3] + (1.0 - share) * behind
    return np.ascontiguousarray(np.rint(mixed).astype(np.uint8))


def about_z(turn: float) -> np.ndarray:
    """Return the (3, 3) rotation about z by an angle [rad]."""
    return np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])


def angle_to_see(points: np.ndarray, places: np.ndarray, target: np.ndarray, aspect: float) -> float:
    """Return the least upright angle of view [rad] in which cameras at some places (C, 3) see all points (N, 3), with some room.

    Parameters
    ----------
    target : (3,)
        What all cameras look at, upright.
    aspect : float
        Width over height of the picture.
    """
    needed = 0.0
    for place in places:
        ahead = (target - place) / np.linalg.norm(target - place)
        right = np.cross(ahead, [0.0, 0.0, 1.0])
        right = right / (np.linalg.norm(right) or 1.0)
        seen = (points - place) @ np.stack([right, np.cross(ahead, right), ahead]).T
        if seen[:, 2].min() <= 0:  # it stands among them
            return float(np.pi)
        needed = max(needed, float((np.abs(seen[:, :2]) / (seen[:, 2:] * [aspect, 1.0])).max()))
    return 2.0 * float(np.arctan(ROOM_AROUND * needed))


def facing(place: np.ndarray, target: np.ndarray) -> tuple[float, float, float, float]:
    """Return the quaternion w, x, y, z of a camera at a place that looks at a target, z being up."""
    ahead = (target - place) / np.linalg.norm(target - place)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right = right / (np.linalg.norm(right) or 1.0)
    turn = np.stack([right, np.cross(ahead, right), ahead], axis=1)  # x right, y down, z ahead
    w = 0.5 * np.sqrt(max(1.0 + np.trace(turn), 1e-12))
    x, y, z = (turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
    return float(w), float(x / (4 * w)), float(y / (4 * w)), float(z / (4 * w))
