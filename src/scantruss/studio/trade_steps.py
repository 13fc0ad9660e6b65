"""Steps with few different parts: the trade of a grid, and grids of it that are taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..errors import InputError
from ..grid.alike import JOINTS, LENGTHS
from ..layouts.joints_alike import few_joints
from ..layouts.on_scan import ScanOfGrid
from ..layouts.panels_alike import few_panels
from ..layouts.trade import COUNTS_TRIED, Traded, traded_kinds, traded_lengths
from ..runtime.progress import Progress
from .scan_steps import ScanSteps
from .state import Trade
from .support_places import supports_on

FOUND_SHARE = 0.9  #: of the progress of a trade of kinds, when they have been found


class TradeSteps(ScanSteps):
    """Steps with few different parts."""

    def find_trade(self, parts: str, tolerance: float, *, mirrored: bool = False) -> None:
        """Look for what the numbers of lengths or kinds cost, as a step of the worker; those that are found are seen and saved at once.

        Parameters
        ----------
        parts : str
            Of `scantruss.grid.alike`.
        tolerance : float
            Largest misfit over the mean member, of joints of unit directions.
        mirrored : bool
            Whether mirror images of joints or panels are of one kind.

        Raises
        ------
        InputError
            There is no finished grid, or its parts have been made alike.
        """
        shown, grid, cloud, turn = self.state.trade, self.grid, self.cloud, self._turn
        before = grid if shown is None else shown.before
        if before is None or cloud is None or before.settings is None or (shown is None and self.state.is_live):
            raise InputError("few different parts are made of a finished grid; press Generate")
        if before.alike is not None:
            raise InputError(
                f"the {before.alike.parts} of this grid have been made equal; press Generate for a new one"
            )
        settings = before.settings

        def keep(traded: Sequence[Traded], off: float) -> None:
            with self._lock:
                if turn != self._turn:
                    return
                self.state = replace(self.state, trade=Trade(before, parts, tuple(traded), off))
            self.save()
            self.tell()

        def look(progress: Progress) -> None:
            progress(parts, 0.0)
            scan = ScanOfGrid.of(cloud, settings)
            off = scan.farthest_node(before) / float(before.lengths.mean())
            if parts == LENGTHS:
                traded: list[Traded] = []
                for done, count in enumerate(COUNTS_TRIED):

                    def report(stage: str, share: float, done: int = done) -> None:
                        progress(stage, (done + share) / len(COUNTS_TRIED))

                    traded += traded_lengths(before, tolerance, (count,), scan.farthest_node, report)
                    keep(traded, off)
                return

            def of_finding(stage: str, share: float) -> None:
                progress(stage, FOUND_SHARE * share)

            def of_trading(stage: str, share: float) -> None:
                progress(stage, FOUND_SHARE + (1.0 - FOUND_SHARE) * share)

            few = few_joints if parts == JOINTS else few_panels
            found = few(before, tolerance, mirrored=mirrored, progress=of_finding)
            keep(traded_kinds(before, found, scan.farthest_node, of_trading), off)

        self.worker.ask(look)

    def take_traded(self, number: int) -> None:
        """Take the grid with at most so many lengths or kinds, certified again, as a step of the worker.

        Raises
        ------
        InputError
            No trade of the grid is known.
        """
        trade, cloud, turn = self.state.trade, self.cloud, self._turn
        if trade is None or cloud is None or trade.before.settings is None:
            raise InputError("the trade of this grid is not known yet; press Find what fewer cost")
        chosen, settings = trade.with_at_most(number), trade.before.settings

        def take(progress: Progress) -> None:
            progress("certificate", 0.5)
            grid = ScanOfGrid.of(cloud, settings).certified(chosen.grid)
            with self._lock:
                if turn != self._turn:
                    return
                words = f"{chosen.number} {trade.parts if trade.parts == LENGTHS else f'kinds of {trade.parts}'}"
                supports = supports_on(self.state, grid)
                self.change(words, grid=grid, is_live=False, solution=None, report=None, **supports)
            self.save()

        self.worker.ask(take)
