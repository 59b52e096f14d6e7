"""A stored run played back as a rig: its samples come again, whatever is commanded, and what would be put out is kept.

Under the law that was logged the same readings give the same commands, to the last bit; another law shows what it would
have asked for, and limits show when they would have stopped the run.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upright.basis import REPLAYED
from upright.errors import BadInput, RigStopped
from upright.readers import read
from upright.records import Record
from upright.rigs.board import Board
from upright.rigs.driver import Connection, Driver
from upright.rigs.protocol import Capabilities, Mode


class ReplayPort:
    """The board of a record.

    Parameters
    ----------
    record : Record
        Of coordinates [rad or m] and command; evenly sampled.
    counts : sequence of float
        Signed counts per rad or m of each output; readings are rounded to them.
    full_scale, step : float
        Largest command of the converter and its step [command unit].
    coordinates : sequence of str, optional
        Columns of the coordinates; the record's outputs when omitted.

    Raises
    ------
    BadInput
        When the record does not tell its coordinates, or counts are not for them.
    """

    def __init__(
        self, record: Record, counts: Sequence[float], full_scale: float, step: float, coordinates: Sequence[str] = ()
    ) -> None:
        names = tuple(coordinates) or record.outputs
        if not names or len(names) != len(counts):
            raise BadInput(
                f"a replay needs the columns of its coordinates and counts for each, got {', '.join(names) or 'none'} "
                f"and {len(counts)} counts; name the outputs of the record."
            )
        readings = np.column_stack([record[n] for n in names]) * np.asarray(counts, dtype=np.float64)
        self.record, self.names, self.per = record, names, tuple(float(c) for c in counts)
        self._counts: NDArray[np.int64] = np.floor(readings + 0.5).astype(np.int64)
        self._full_scale, self._step = full_scale, step
        self._row = -1  # before the first sample
        self._enabled, self._waited = False, 0

    def open(self) -> Capabilities:
        """What there is, by the record."""
        unit = self.record.units[self.record.inputs[0]] if self.record.inputs else "V"
        steps = max(1, round(self._full_scale / self._step))
        return Capabilities(
            name=f"the replay of {self.record.provenance.file or self.record.provenance.rig or 'a record'}",
            coordinates=self.names, counts=self.per, command_unit=unit, full_scale=steps * self._step, steps=steps,
            period=self.record.period, modes=frozenset({Mode.HOST, Mode.MCU}), virtual=True, hardware=False,
            replayed=True,
        )  # fmt: skip

    def write(self, command: float) -> None:
        """Nothing moves."""

    def enable(self, on: bool) -> None:
        """The record begins when the power stage comes on, and stands still while it is off."""
        self._enabled = on

    def advance(self) -> float:
        """Go to the next sample; time goes on by the record's clock, and by its period while it waits.

        Raises
        ------
        RigStopped
            At the end of the record.
        """
        if self._enabled and self._row + 1 >= len(self._counts):
            raise RigStopped(f"The record ends after {len(self._counts)} samples.")
        self._row += self._enabled
        self._waited += not self._enabled
        return float(self.record.t[max(self._row, 0)]) + self._waited * self.record.period

    def read(self) -> tuple[int, ...]:
        """Counts of the sample; those of the first before it comes."""
        row: list[int] = self._counts[max(self._row, 0)].tolist()
        return tuple(row)

    def zero(self) -> None:
        """The record keeps the zero that it was logged with."""

    def close(self) -> None:
        """Nothing is held open."""


def _open(to: Connection) -> Board:
    assert to.record is not None  # since the driver needs it
    step = to.model.converter or 2.0 * to.model.limit / (1 << 23)
    return Board(ReplayPort(read(to.record), to.model.per_unit, 2.0 * to.model.limit, step, to.coordinates))


DRIVER = Driver(name="replay", order=20, open=_open, needs={"record": "run.csv"}, performed=REPLAYED)
