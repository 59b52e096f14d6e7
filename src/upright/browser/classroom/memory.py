"""What the process of the lanes and its server share: orders for each lane, answers, and every tick in a ring.

Each number has one side that writes it, and nobody waits for the other. An order is numbered, and what belongs to it is
written before its number.
"""

from __future__ import annotations

import multiprocessing
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS = 8192
"""Ticks that the ring holds; who reads is given half of them at most, so that none is written over meanwhile."""
NUMBERS = 64
"""Most gains of a law."""
RUNNING, BY_HAND, ENDED, LEANT, TRAVELLED, UNHEARD = range(6)
"""Why a lane's run is over, or that it is not."""


class SharedLanes:
    """Memory of two processes; sent to the second as it starts.

    Attributes
    ----------
    lanes, coordinates : int
        How many lanes there are, and coordinates in each.
    """

    def __init__(self, lanes: int, coordinates: int) -> None:
        self.lanes, self.coordinates = lanes, coordinates
        context = multiprocessing.get_context("spawn")
        n, m = lanes, coordinates
        self._orders = np.dtype(
            [("run", "<i8"), ("stop", "<i8"), ("away", "<f8"), ("signal", "<i8"), ("begins", "<i8"),
             ("ticks", "<i8"),
             ("taps", "<f8", (m,)),
             ("given", "<i8"), ("shape", "<i8"), ("size", "<f8"), ("period", "<f8"), ("change", "<i8"),
             ("gains", "<i8"), ("numbers", "<f8", (NUMBERS,))]
        )  # fmt: skip
        self._answers = np.dtype(
            [("run", "<i8"), ("why", "<i8"), ("first", "<i8"), ("last", "<i8"), ("late", "<i8"), ("where", "<i8"),
             ("value", "<f8"), ("changed", "<i8"), ("at", "<i8"), ("followed", "<i8"), ("since", "<i8"),
             ("taken", "<i8")]
        )  # fmt: skip
        sizes = {
            "orders": n * self._orders.itemsize, "answers": n * self._answers.itemsize, "marks": 6 * 8,
            "counts": ROWS * n * m * 8, "command": ROWS * n * 8, "reference": ROWS * n * 8, "late": ROWS * 8,
        }  # fmt: skip
        self._raw: dict[str, Any] = {name: context.RawArray("c", size) for name, size in sizes.items()}

    def orders(self) -> NDArray[np.void]:
        """Of the server, a row for each lane."""
        return np.frombuffer(self._raw["orders"], dtype=self._orders)

    def answers(self) -> NDArray[np.void]:
        """Of the lanes, a row for each."""
        return np.frombuffer(self._raw["answers"], dtype=self._answers)

    def marks(self) -> NDArray[np.int64]:
        """`HEAD` and so on."""
        return np.frombuffer(self._raw["marks"], dtype=np.int64)

    def counts(self) -> NDArray[np.int64]:
        """As the encoders count, shape (ROWS, lanes, coordinates)."""
        return np.frombuffer(self._raw["counts"], dtype=np.int64).reshape(ROWS, self.lanes, self.coordinates)

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Command or reference of each tick, shape (ROWS, lanes)."""
        return np.frombuffer(self._raw[name], dtype=np.float64).reshape(ROWS, self.lanes)

    def late(self) -> NDArray[np.int64]:
        """Late ticks up to each, of all lanes alike."""
        return np.frombuffer(self._raw["late"], dtype=np.int64)


HEAD, LATE, PASSED, PRIORITY, LOOKS, CLOSE = range(6)
"""The ticks of all lanes so far, how many of them were late and passed over, whether there is FIFO; the last two are
the server's: how often it has looked, and that the process is to end."""
