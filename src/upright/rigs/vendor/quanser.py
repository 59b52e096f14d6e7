"""A Quanser board (Q2-USB, QUBE-Servo, Q8-USB) by Quanser's Python API; written from its manual, not yet tried on one.

The kit comes with QUARC or the Quanser SDK, not from PyPI. One encoder channel per coordinate, one analog output for
the amplifier, one digital output for its enable line. The board's own watchdog puts the analog output to zero when this
process dies; without it an orphaned output keeps its last value.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from time import monotonic
from typing import Any

from upright.errors import BadInput
from upright.rigs.board import Board
from upright.rigs.driver import Connection, Driver
from upright.rigs.protocol import Capabilities, Mode


class QuanserPort:
    """Port of a Quanser board.

    Parameters
    ----------
    about : Capabilities
        Of the rig: coordinates, signed counts, converter.
    board, identifier : str
        As `HIL.open` takes them: ``"q2_usb"``, ``"0"``.
    encoders : sequence of int
        Channel of each coordinate.
    output, enable_line : int
        Channels of the analog output and of the amplifier's enable.
    watchdog : float
        After which the board puts its outputs to zero by itself [s].

    Raises
    ------
    BadInput
        When Quanser's kit is not installed.
    """

    def __init__(
        self, about: Capabilities, board: str, identifier: str = "0", *, encoders: Sequence[int] = (0, 1),
        output: int = 0, enable_line: int = 0, watchdog: float = 0.02,
    ) -> None:  # fmt: skip
        try:
            self._kit: Any = import_module("quanser.hardware")
        except ImportError:
            raise BadInput(
                'kind = "quanser" needs Quanser\'s Python API, which comes with QUARC or the Quanser SDK and not from '
                "PyPI; install it into this environment, and check that `from quanser.hardware import HIL` works."
            ) from None
        self._about, self._board, self._identifier, self._watchdog = about, board, identifier, watchdog
        self._encoders, self._output = array("I", encoders), array("I", [output])
        self._line = array("I", [enable_line])
        self._card: Any = None
        self._watched = False

    def open(self) -> Capabilities:
        """Connect, with the output at zero."""
        card = self._kit.HIL()
        card.open(self._board, self._identifier)
        self._card, self._watched = card, False
        self.write(0.0)
        self.enable(False)
        return replace(self._about, modes=frozenset({Mode.HOST}), virtual=False, hardware=True)

    def write(self, command: float) -> None:
        """Put the command out, and tell the watchdog that somebody is there."""
        if self._watched:
            self._card.watchdog_reload()
        self._card.write_analog(self._output, 1, array("d", [command]))

    def enable(self, on: bool) -> None:
        """Switch the amplifier's enable line, and its watchdog: nobody feeds one while a person is waited for."""
        if on:
            self._card.watchdog_clear()
            self._card.watchdog_start(self._watchdog)
        self._card.write_digital(self._line, 1, array("b", [int(on)]))
        if self._watched and not on:
            self._card.watchdog_stop()
        self._watched = on

    def advance(self) -> float:
        """The loop keeps the time; the sample is taken at once."""
        return monotonic()

    def read(self) -> tuple[int, ...]:
        """Counts now."""
        buffer = array("i", [0] * len(self._encoders))
        self._card.read_encoder(self._encoders, len(self._encoders), buffer)
        return tuple(buffer)

    def zero(self) -> None:
        """Set the counters to zero."""
        n = len(self._encoders)
        self._card.set_encoder_counts(self._encoders, n, array("i", [0] * n))

    def close(self) -> None:
        """Zero, off, and let go."""
        if self._card is not None:
            self.write(0.0)
            self.enable(False)
            self._card.close()
            self._card = None


def _open(to: Connection) -> Board:
    about, rest = to.capabilities()
    return Board(QuanserPort(about, **rest))


DRIVER = Driver(name="quanser", order=40, open=_open)
