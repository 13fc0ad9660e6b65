"""The page of a studio without a browser: its controls and its scene, whose messages nobody reads."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from scantruss.studio.session import Session
from scantruss.studio.view import StudioView

PATIENCE = 60.0


@contextmanager
def view_of(session: Session) -> Iterator[StudioView]:
    """Give the view of a session; what it sends to the page is in its `client.sent`, what it says there in `client.said`."""
    viser = pytest.importorskip("viser", reason="the studio needs viser")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    sent, said = dict[str, bytes](), list[str]()
    camera = SimpleNamespace(
        position=(1.0, 1.0, 1.0), look_at=(0.0, 0.0, 0.0), fov=0.65, image_width=1280, image_height=720
    )
    client: Any = SimpleNamespace(
        gui=server.gui, scene=server.scene, atomic=server.atomic, flush=server.flush, camera=camera, sent=sent, said=said,
        add_notification=lambda title, words, **_: said.append(words),
        send_file_download=lambda name, content, **_: sent.update({name: content}),
        get_render=lambda *_, **__: None,
    )  # fmt: skip
    view = StudioView(session, client)
    try:
        yield view
    finally:
        view.close()
        server.stop()


def choose(view: StudioView, control: Any, value: Any) -> None:
    """Give a control a value as a person does, and wait for what comes of it."""
    control.value = value
    press(view, control)


def press(view: StudioView, control: Any) -> None:
    """Press a control, and wait for what comes of it."""
    for call in list(control._impl.update_cb):
        asyncio.run(call(SimpleNamespace(client=view.client, target=control)))
    done = threading.Event()
    view.in_order.add(done.set)
    assert done.wait(PATIENCE)
