"""Pictures that the studio takes: a turntable is a task, which tells how far it is and can be stopped."""

import io
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from studio_dome import done

from scantruss.studio.frame import SceneFrame
from scantruss.studio.legend import ColourLegend, with_legends
from scantruss.studio.pictures import TURN_FRAMES, TURN_SIZE, PictureTool
from scantruss.studio.session import Session


def test_a_legend_stands_in_the_corner_of_a_picture_and_nowhere_else() -> None:
    picture = np.full((600, 900, 3), 7, np.uint8)
    stops = ((200, 0, 0), (0, 200, 0), (0, 0, 200))
    legend = ColourLegend("length", "m", (1.0, 3.0), stops).with_mark((90, 10, 170), "more than 3")
    drawn = with_legends(picture, [legend, ColourLegend("class", marks=(((1, 250, 3), "2 ground"),))], False)
    changed = np.argwhere((drawn != picture).any(axis=2))
    assert changed[:, 0].min() > 300 and changed[:, 1].max() < 300
    for color in (*stops, (90, 10, 170), (1, 250, 3)):
        assert (np.abs(drawn.astype(int) - color).max(axis=2) <= 2).sum() > 5, color
    assert np.array_equal(with_legends(picture, [], False), picture)
    said = legend.html()
    assert "length [m]" in said and all(f">{value}<" in said for value in ("1", "2", "3"))


@pytest.mark.parametrize("stops_at", [None, 3])
def test_a_turntable_tells_how_far_it_is_and_can_be_stopped(stops_at: int | None, tmp_path: Path) -> None:
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 10, 30), np.linspace(0, 10, 30)))
    np.savetxt(tmp_path / "dome.xyz", np.stack([x, y, 2 - 0.04 * ((x - 5) ** 2 + (y - 5) ** 2)], axis=1))
    session = Session()
    session.open(tmp_path / "dome.xyz")
    assert session.cloud is not None
    taken, sent, shares = list[Any](), list[bytes](), list[float]()

    def get_render(height: int, width: int, **camera: Any) -> np.ndarray:
        taken.append(camera["position"])
        if len(taken) == stops_at:
            session.stop()
        return np.full((height, width, 4), (5 * len(taken), 0, 0, 255), np.uint8)

    buttons: dict[str, Any] = {}
    button = SimpleNamespace(
        add_button=lambda name: SimpleNamespace(on_click=lambda step: buttons.update({name: step}))
    )
    view: Any = SimpleNamespace(
        session=session,
        step=lambda step: step,
        aside=lambda step: step,
        say=lambda words: None,
        legends=SimpleNamespace(shown=()),
        look=SimpleNamespace(tubes=SimpleNamespace(value=False), dark=SimpleNamespace(value=False)),
        scene=SimpleNamespace(api=SimpleNamespace(set_background_image=lambda image: None)),
        frame=SceneFrame.of(session.cloud),
        client=SimpleNamespace(
            camera=SimpleNamespace(position=(8.0, -14.0, 9.0), look_at=(0.0, 0.0, 0.0), fov=0.65, image_height=720),
            get_render=get_render,
            send_file_download=lambda name, content, save_immediately: sent.append(content),
        ),
    )
    PictureTool(view, button)
    end = session.listen(lambda: shares.append(session.share))
    buttons["Turntable, GIF"]()
    done(session)
    end()
    if stops_at is not None:
        assert len(taken) == stops_at and sent == []
        return
    assert len(taken) == TURN_FRAMES == len(np.unique(np.round(taken, 6), axis=0))
    assert [each for each in shares if each] == sorted(each for each in shares if each) and max(shares) == 1.0
    film = Image.open(io.BytesIO(sent[0]))
    assert film.size == TURN_SIZE[::-1] and getattr(film, "n_frames", 1) == TURN_FRAMES
