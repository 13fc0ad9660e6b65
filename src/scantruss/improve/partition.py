"""A grid in two parts that two threads improve at once, the same for any number of processors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..kernels.mesh import partition as kernels
from ..kernels.mesh.grid import Net
from ..runtime.parallel import in_parts


class Partition:
    """The two parts of a net, each a net with free nodes of its own; the nodes between them do not change.

    Parameters
    ----------
    net : Net
    among : (C,) bool, the nodes to be worked at, about as many in either part
    """

    def __init__(self, net: Net, among: np.ndarray) -> None:
        self._net = net
        self.label = np.full(len(net.arc), kernels.BETWEEN_PARTS, np.int64)  #: (C,) 0 or 1, or BETWEEN_PARTS
        away, queue = np.empty((2, len(net.arc)), np.int64), np.empty(len(net.arc), np.int64)
        if kernels.paths_from_ends(net, among, away, queue):
            ahead = away[0] - away[1]
            kernels.part(net, (ahead > np.median(ahead[among])).astype(np.int64), self.label)
        self.nets = tuple(net._replace(**self._free(side)) for side in (0, 1))  #: the net of each part

    def _free(self, side: int) -> dict[str, np.ndarray]:
        count = self._net.spare[0]
        own = self._net.free[:count][side::2]
        self.label[own] = side
        free = np.zeros(len(self._net.free), np.int64)
        free[: len(own)] = own
        return {"free": free, "spare": np.array([len(own)]), "in_use": self._net.in_use.copy()}

    def run(self, work: Callable[[int], object]) -> None:
        """Call work(side) for both parts at once, and make them one net again."""

        def both(_: int, begin: int, end: int) -> None:
            for side in range(begin, end):
                work(side)

        in_parts(2, 1, both)
        first, second = self.nets
        left = np.concatenate([net.free[: net.spare[0]] for net in self.nets])
        self._net.free[: len(left)] = np.sort(left)[::-1]
        self._net.spare[0], self._net.in_use[0] = len(left), max(first.used, second.used)
