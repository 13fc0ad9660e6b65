"""A session of the studio with a grid of few members over a shallow dome."""

from pathlib import Path

import numpy as np

from scantruss.studio.session import Session

PATIENCE = 120.0


def done(session: Session) -> None:
    """Wait for what runs."""
    assert session.worker.wait(PATIENCE) and session.message == ""


def session_of_dome(folder: Path, depth: float) -> Session:
    """Generate a grid over a dome of 10 by some depth [m]."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 10, 50), np.linspace(0, depth, round(5 * depth))))
    np.savetxt(folder / "dome.xyz", np.stack([x, y, 2 - 0.04 * ((x - 5) ** 2 + (y - depth / 2) ** 2)], axis=1))
    session = Session(folder / "dome.scantruss")
    session.open(folder / "dome.xyz")
    session.set_unit("m")
    session.change("length", settings=session.settings.replace(length=2.5, effort="quick"))
    session.generate()
    done(session)
    return session
