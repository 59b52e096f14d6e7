"""The protocol of every rig: a twin, a replay of a record, firmware at the end of a wire, a vendor's board.

A rig moves between five modes, and nothing but a fault leaves `Mode.HOST` or `Mode.MCU` without a request::

    IDLE -> ARMED -> HOST | MCU -> IDLE        any of them -> FAULT -> (clear_fault) -> IDLE

In IDLE and FAULT the command is zero and the power stage is off. Faults are latched: they stay until they are cleared.
This is supervision in software, not a rated safety function; a rig needs a stop in hardware besides.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Protocol

from upright.errors import BadInput
from upright.laws import Law


class Mode(IntEnum):
    """Who moves the rig."""

    IDLE = 0
    ARMED = 1
    HOST = 2
    MCU = 3
    FAULT = 4


class Fault(IntFlag):
    """Why a rig was stopped; several may come together. The numbers are those on the wire."""

    WATCHDOG = 1
    OVERTRAVEL = 2
    OVERSPEED = 4
    GAINS = 8
    STOP = 16
    OVERRUN = 32
    ENCODER = 64
    SATURATION = 128
    START = 256
    RESET = 512
    TWIST = 1024
    LINK = 2048
    STALE = 4096
    SELF_TEST = 8192
    MODEL = 16384


NO_FAULT = Fault(0)
LONGEST_PULSE = 0.3
"""Of a self-test [s]; a board holds it by itself."""


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """What a rig says of itself when it is opened.

    Attributes
    ----------
    name : str
        Of the rig and its board, as a person would call it.
    coordinates : tuple of str
        What each encoder measures, in the plant's order.
    counts : tuple of float
        Signed counts per rad or m of each encoder.
    command_unit : str
        ``"V"``, ``"A"``, ...
    full_scale : float
        Command at the converter's last step [command unit].
    steps : int
        Steps of the converter from zero to full scale.
    period : float
        Of the control tick [s].
    modes : frozenset of Mode
        `Mode.HOST`, `Mode.MCU` or both.
    virtual : bool
        Whether time passes only while a sample is exchanged, as on a twin, instead of by the clock on the wall.
    hardware : bool
        Whether something can really move; then limits are demanded.
    paced : bool
        Whether `exchange` comes back at the rig's own tick, so that the rig's clock paces the loop.
    replayed : bool
        Whether its samples come as they were stored, whatever it is commanded.
    """

    name: str
    coordinates: tuple[str, ...]
    counts: tuple[float, ...]
    command_unit: str
    full_scale: float
    steps: int
    period: float
    modes: frozenset[Mode] = frozenset({Mode.HOST})
    virtual: bool = False
    hardware: bool = True
    paced: bool = False
    replayed: bool = False

    @property
    def step(self) -> float:
        """Command of one step of the converter [command unit]."""
        return self.full_scale / self.steps


@dataclass(frozen=True, kw_only=True)
class Limits:
    """How far a rig may go; in the coordinates' units, from where it was zeroed.

    Attributes
    ----------
    travel, speed, start : tuple of float
        Largest position [rad or m], speed [rad/s or m/s] and, when it is armed, distance from zero of each coordinate;
        inf for one that may do what it likes, such as a pendulum that turns over.
    command : float
        Largest command [command unit].
    watchdog : float
        Longest time between two commands of the host [s].
    saturation : float
        Longest time at the largest command without a break [s].
    frozen : float
        How far [rad or m] one coordinate may travel while another does not show a single count; 0 to not look.
    twist : float
        Largest difference between the first two coordinates [rad], for a flexible shaft; inf without one.
    """

    travel: tuple[float, ...]
    speed: tuple[float, ...]
    start: tuple[float, ...]
    command: float
    watchdog: float = 0.02
    saturation: float = 2.0
    frozen: float = 0.0
    twist: float = math.inf

    def __post_init__(self) -> None:
        values = {"command": (self.command,), "watchdog": (self.watchdog,), "saturation": (self.saturation,)}
        for name, of in {"travel": self.travel, "speed": self.speed, "start": self.start, **values}.items():
            if not all(v > 0.0 for v in of):
                raise BadInput(f"the limit on {name} must be above zero, got {of}.")
        if len({len(self.travel), len(self.speed), len(self.start)}) > 1:
            raise BadInput("limits on travel, speed and start need one number for each coordinate.")
        if not math.isfinite(self.command):
            raise BadInput("the limit on the command must be a number: say how much the rig can stand.")


@dataclass(frozen=True, kw_only=True)
class Tick:
    """One tick of a rig.

    Attributes
    ----------
    tick : int
        Counted by the rig from its start; a gap is a sample that was lost.
    time : float
        By the rig's own clock [s].
    counts : tuple of int
        Of the encoders since they were zeroed.
    applied : float
        Command that the converter really puts out [command unit].
    """

    tick: int
    time: float
    counts: tuple[int, ...]
    applied: float
    mode: Mode
    faults: Fault = NO_FAULT


@dataclass(frozen=True, kw_only=True)
class SelfTest:
    """What a small pulse at arming showed, coordinate by coordinate.

    Attributes
    ----------
    moved : dict of str to float
        How far each coordinate went, with its sign [rad or m].
    complaint : str
        What is wrong, as a sentence (a dead channel, a wrong sign, a scale that does not fit); empty when all is well.
    """

    moved: Mapping[str, float]
    complaint: str = ""


class LiveRig(Protocol):
    """A rig as the loop sees it. Every call but `exchange` answers only when the rig has done it.

    Raises
    ------
    RigStopped
        From any call, when the rig refuses or does not answer; the command is zero before it is raised. A rig that has
        stopped itself answers `exchange` with a `Tick` that tells why.
    """

    def open(self) -> Capabilities:
        """Connect, and say what is there. The mode is IDLE or FAULT (`Fault.RESET`) afterwards."""
        ...

    def configure(self, limits: Limits) -> Limits:
        """Set limits in IDLE; returns what the rig holds now, read back, as its counts and steps allow."""
        ...

    def zero(self) -> None:
        """Take where every coordinate is now as zero; in IDLE only."""
        ...

    def self_test(self, pulse: float, seconds: float) -> SelfTest:
        """Give a small pulse [command unit] of up to `LONGEST_PULSE` and look what moves; in ARMED only, and back in
        ARMED afterwards. The watchdog acts during the pulse as in a loop.
        """
        ...

    def arm(self) -> None:
        """Switch the power stage on at zero command; refused without limits, with a fault, or off the start window."""
        ...

    def start(self, mode: Mode, law: Law | None = None) -> None:
        """Give the rig to the host's loop, or to its own with a law, which is read back and compared bit by bit."""
        ...

    def exchange(self, command: float) -> Tick:
        """Hand a command over [command unit; in MCU a reference in rad or m] and take the newest sample."""
        ...

    def stop(self) -> None:
        """Command to zero and power stage off, back to IDLE."""
        ...

    def estop(self) -> None:
        """The same at once from any mode, latched as `Fault.STOP`; never raises."""
        ...

    def clear_fault(self) -> None:
        """Forget latched faults, in FAULT or IDLE."""
        ...

    def close(self) -> None:
        """Stop and let go of the rig; never raises, and may be called twice."""
        ...
