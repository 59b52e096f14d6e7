"""A National Instruments board by the package nidaqmx; written from its manual, not yet tried on one.

One counter per coordinate as a quadrature encoder, one analog output for the amplifier, one digital line for its
enable. Most boards keep their last output when this process dies: wire the enable line through a watchdog relay, or
take a board with a watchdog task.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from time import monotonic
from typing import Any

from upright.errors import BadInput
from upright.rigs.board import Board
from upright.rigs.driver import Connection, Driver
from upright.rigs.protocol import Capabilities, Mode

_BITS = 32  # of the counters, which count on from 0 to 2^32 - 1


class NidaqmxPort:
    """Port of a board by NI-DAQmx.

    Parameters
    ----------
    about : Capabilities
        Of the rig: coordinates, signed counts, converter.
    device : str
        ``"Dev1"``.
    counters : sequence of str
        Counter of each coordinate, ``"ctr0"``.
    output, enable_line : str
        ``"ao0"`` and ``"port0/line0"``.

    Raises
    ------
    BadInput
        When nidaqmx is not installed.
    """

    def __init__(
        self, about: Capabilities, device: str, *, counters: Sequence[str] = ("ctr0", "ctr1"), output: str = "ao0",
        enable_line: str = "port0/line0",
    ) -> None:  # fmt: skip
        try:
            self._kit: Any = import_module("nidaqmx")
            self._constants: Any = import_module("nidaqmx.constants")
        except ImportError:
            raise BadInput(
                'kind = "nidaqmx" needs the package nidaqmx and NI\'s driver NI-DAQmx: pip install nidaqmx, and the '
                "driver from ni.com."
            ) from None
        self._about, self._device, self._counters = about, device, tuple(counters)
        self._places = output, enable_line
        self._tasks: list[Any] = []
        self._encoders: list[Any] = []
        self._origin = [0] * len(self._counters)

    def open(self) -> Capabilities:
        """Make the tasks, with the output at zero."""
        most, k = self._about.full_scale, self._constants
        for counter in self._counters:
            task = self._task()
            task.ci_channels.add_ci_lin_encoder_chan(
                f"{self._device}/{counter}", decoding_type=k.EncoderType.X_4, units=k.LengthUnits.TICKS,
                dist_per_pulse=1.0, initial_pos=0.0,
            )  # fmt: skip
            task.start()
            self._encoders.append(task)
        self._analog, self._digital = self._task(), self._task()
        self._analog.ao_channels.add_ao_voltage_chan(f"{self._device}/{self._places[0]}", min_val=-most, max_val=most)
        self._digital.do_channels.add_do_chan(f"{self._device}/{self._places[1]}")
        self.write(0.0)
        self.enable(False)
        return replace(self._about, modes=frozenset({Mode.HOST}), virtual=False, hardware=True)

    def _task(self) -> Any:
        task = self._kit.Task()
        self._tasks.append(task)
        return task

    def write(self, command: float) -> None:
        """Put the command out."""
        self._analog.write(command)

    def enable(self, on: bool) -> None:
        """Switch the amplifier's enable line."""
        self._digital.write(on)

    def advance(self) -> float:
        """The loop keeps the time; the sample is taken at once."""
        return monotonic()

    def read(self) -> tuple[int, ...]:
        """Counts now."""
        half = 1 << (_BITS - 1)
        raw = [round(task.read()) for task in self._encoders]
        return tuple((n - zero + half) % (2 * half) - half for n, zero in zip(raw, self._origin, strict=True))

    def zero(self) -> None:
        """Count from here on."""
        self._origin = [round(task.read()) for task in self._encoders]

    def close(self) -> None:
        """Zero, off, and let go."""
        if self._tasks:
            self.write(0.0)
            self.enable(False)
        for task in self._tasks:
            task.close()
        self._tasks, self._encoders = [], []


def _open(to: Connection) -> Board:
    about, rest = to.capabilities()
    return Board(NidaqmxPort(about, **rest))


DRIVER = Driver(name="nidaqmx", order=50, open=_open)
