"""The modes and limits of a rig whose board has no firmware of its own: a twin, a replay, a vendor's card.

What a board can do by itself (read encoders, put a command out, switch its power stage) is a `Port`; everything that
makes a `LiveRig` of it stands here once. At every tick the command is put out, a period passes, the encoders are read,
and every limit is checked before anything is reported; a limit that is passed puts the command to zero first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from upright.errors import RigStopped
from upright.laws import Law
from upright.rigs.law import RunningLaw, absurdity, for_rig
from upright.rigs.protocol import LONGEST_PULSE, NO_FAULT, Capabilities, Fault, Limits, Mode, SelfTest, Tick


class Port(Protocol):
    """What a board without firmware can do."""

    def open(self) -> Capabilities:
        """Connect with the command at zero and the power stage off, and say what is there."""
        ...

    def write(self, command: float) -> None:
        """Put a command out, rounded and limited by the caller [command unit]."""
        ...

    def enable(self, on: bool) -> None:
        """Switch the power stage."""
        ...

    def advance(self) -> float:
        """Let a period pass, or wait for the board's next one; the board's time then [s]."""
        ...

    def read(self) -> tuple[int, ...]:
        """Counts of the encoders since they were zeroed."""
        ...

    def zero(self) -> None:
        """Count from here on."""
        ...

    def close(self) -> None:
        """Let go of the board; may be called twice."""
        ...


SENTENCES = {
    Fault.WATCHDOG: "no command came within the watchdog's time",
    Fault.OVERTRAVEL: "a coordinate left its travel",
    Fault.OVERSPEED: "a coordinate was faster than its limit",
    Fault.GAINS: "the law gave a command that is no number, or its gains are absurd",
    Fault.STOP: "it was stopped by hand",
    Fault.OVERRUN: "its own tick took longer than a period, or did not come",
    Fault.ENCODER: "an encoder stood still while another coordinate moved on, or did what no encoder does",
    Fault.SATURATION: "the command stayed at its limit for too long",
    Fault.START: "it was not where a run may start",
    Fault.RESET: "it was switched on or reset",
    Fault.TWIST: "the shaft was twisted too far",
    Fault.LINK: "the link to it does not answer",
    Fault.STALE: "its samples did not go on, or a command came too late for the sample that it answers",
    Fault.SELF_TEST: "its self-test did not show what it should",
    Fault.MODEL: "it did not move as its model does: an encoder or the drive is not what it was",
}
"""Every fault as a clause."""


def fault_text(faults: Fault) -> str:
    """Faults as a sentence has them."""
    return "; ".join(text for fault, text in SENTENCES.items() if fault in faults) or "no fault"


class Board:
    """A `LiveRig` made of a port."""

    def __init__(self, port: Port) -> None:
        self.port = port
        self._capabilities: Capabilities | None = None
        self._limits: Limits | None = None
        self._mode, self._faults = Mode.IDLE, Fault.RESET
        self._tick, self._time, self._applied = 0, 0.0, 0.0
        self._counts: tuple[int, ...] = ()
        self._before: tuple[int, ...] = ()
        self._command, self._fed, self._full = 0.0, 0.0, 0.0
        self._still: list[list[float]] = []
        self._law: RunningLaw | None = None

    def open(self) -> Capabilities:
        """Connect; a board that was just switched on stands in FAULT with `Fault.RESET`."""
        self._capabilities = self.port.open()
        self._counts = self._before = self.port.read()
        self._mode, self._faults, self._limits = Mode.FAULT, Fault.RESET, None
        return self._capabilities

    def configure(self, limits: Limits) -> Limits:
        """Hold limits, rounded towards the safe side to counts and steps."""
        self._must("configure", Mode.IDLE)
        c = self._there()
        if len(limits.travel) != len(c.coordinates):
            raise self._refusal(f"limits are for {len(limits.travel)} coordinates, and it has {len(c.coordinates)}")
        if limits.command > c.full_scale:
            raise self._refusal(
                f"the limit on the command is {limits.command:g} {c.command_unit}, beyond the converter's "
                f"{c.full_scale:g} {c.command_unit}"
            )
        command = math.floor(limits.command / c.step + 1e-9) * c.step
        if not command > 0:
            raise self._refusal(f"the limit on the command is less than a step of {c.step:g} {c.command_unit}")
        per = [abs(n) for n in c.counts]
        held = {
            "travel": _down(limits.travel, per), "start": _down(limits.start, per),
            "speed": _down(limits.speed, [n * c.period for n in per]),
        }  # fmt: skip
        for name, values in held.items():
            if not all(values):
                raise self._refusal(f"the limit on {name} is less than a count; ask for more")
        self._limits = replace(limits, command=command, **held)
        return self._limits

    def zero(self) -> None:
        """Count from here on."""
        self._must("zero", Mode.IDLE)
        self.port.zero()
        self._counts = self._before = self.port.read()

    def self_test(self, pulse: float, seconds: float) -> SelfTest:
        """The farthest that each coordinate went under a pulse and for as long after it."""
        self._must("test", Mode.ARMED)
        c, limits = self._there(), self._held()
        if not (0 < abs(pulse) <= limits.command and 0 < seconds <= LONGEST_PULSE):
            raise self._refusal(
                f"a self-test takes a pulse up to {limits.command:g} {c.command_unit} for up to {LONGEST_PULSE:g} s, "
                f"got {pulse:g} {c.command_unit} for {seconds:g} s"
            )
        first, farthest, ticks = self._counts, [0] * len(self._counts), max(1, round(seconds / c.period))
        for k in range(2 * ticks):
            self._pass(pulse if k < ticks else 0.0)
            if self._faults:
                raise self._stopped()
            for i, (now, then) in enumerate(zip(self._counts, first, strict=True)):
                farthest[i] = now - then if abs(now - then) > abs(farthest[i]) else farthest[i]
        self._pass(0.0)
        moved = {n: k / per for n, k, per in zip(c.coordinates, farthest, c.counts, strict=True)}
        dead = [n for n, v in moved.items() if v == 0.0]
        complaint = f"Nothing moved: {', '.join(dead)} showed not a single count." if dead else ""
        return SelfTest(moved=moved, complaint=complaint)

    def arm(self) -> None:
        """Switch the power stage on at zero command."""
        if self._mode == Mode.IDLE and self._limits is None:
            raise self._refusal("it has no limits; configure them first")
        self._must("arm", Mode.IDLE)
        if self._faults:
            raise self._refusal(f"it is not cleared ({fault_text(self._faults)})")
        c, limits = self._there(), self._held()
        self._counts = self._before = self.port.read()
        for name, q, most in zip(c.coordinates, self._at(), limits.start, strict=True):
            if abs(q) > most:
                self._faults |= Fault.START
                raise self._refusal(f"{name} is at {q:.4g}, and a run starts within {most:.4g} of zero")
        self._still = [[0.0] * len(self._counts) for _ in self._counts]
        self._full, self._applied, self._command = 0.0, 0.0, 0.0
        self.port.write(0.0)
        self.port.enable(True)
        self._mode = Mode.ARMED

    def start(self, mode: Mode, law: Law | None = None) -> None:
        """Give it to the host's loop, or to the law."""
        self._must("start", Mode.ARMED)
        c, limits = self._there(), self._held()
        if mode not in c.modes or mode not in (Mode.HOST, Mode.MCU):
            raise self._refusal(f"it has no mode {mode.name}, only {', '.join(sorted(m.name for m in c.modes))}")
        if mode == Mode.MCU:
            if law is None:
                raise self._refusal("its own loop needs a law")
            fitted = for_rig(law, c, limits)
            if absurd := absurdity(law, c, limits):
                self._trip(Fault.GAINS)
                raise self._refusal(absurd)
            self._law = RunningLaw(fitted, c.period)
        self._command, self._fed, self._mode = 0.0, self._time, mode

    def exchange(self, command: float) -> Tick:
        """Take a command, let a tick pass, and give its sample; faults are in the sample."""
        self._there()
        self._command, self._fed = command, self._time
        self._own_tick()
        return self.sample

    def alone(self, seconds: float) -> Tick:
        """Go on for some time while nobody speaks to it, as firmware does by its own timer; the sample then."""
        for _ in range(max(1, round(seconds / self._there().period))):
            self._own_tick()
        return self.sample

    @property
    def sample(self) -> Tick:
        """The newest sample."""
        return Tick(
            tick=self._tick, time=self._time, counts=self._counts, applied=self._applied, mode=self._mode,
            faults=self._faults,
        )  # fmt: skip

    def stop(self) -> None:
        """Zero, power stage off, IDLE; in FAULT it stays there."""
        self._there()
        self._off()
        if self._mode != Mode.FAULT:
            self._mode = Mode.IDLE

    def estop(self) -> None:
        """The same from anywhere, latched."""
        if self._capabilities is not None:
            self._trip(Fault.STOP)

    def clear_fault(self) -> None:
        """Forget faults."""
        self._must("clear faults", Mode.FAULT, Mode.IDLE)
        self._mode, self._faults = Mode.IDLE, NO_FAULT

    def close(self) -> None:
        """Zero and let go."""
        if self._capabilities is not None:
            self._off()
            self._capabilities, self._mode = None, Mode.IDLE
        self.port.close()

    def _own_tick(self) -> None:
        silent, running = self._time - self._fed, self._mode in (Mode.HOST, Mode.MCU)
        # half a period is what rounding of times cannot make
        if running and silent > self._held().watchdog + 0.5 * self._there().period:
            self._trip(Fault.WATCHDOG)
        command = 0.0
        if self._mode == Mode.HOST:
            command = self._command
        elif self._mode == Mode.MCU and self._law is not None:
            command = self._law.step(self._at(), self._command)
        self._pass(command)

    def _pass(self, command: float) -> None:
        """Put a command out, let a period pass, read, and look at every limit."""
        c = self._there()
        if self._mode in (Mode.IDLE, Mode.FAULT):
            put = 0.0
        elif not math.isfinite(command):
            self._trip(Fault.GAINS)
            put = 0.0
        else:
            most = self._held().command
            put = min(max(math.floor(command / c.step + 0.5) * c.step, -most), most)
            self._full = self._full + c.period if abs(put) >= most else 0.0
        self.port.write(put)
        if self._mode in (Mode.IDLE, Mode.FAULT):
            self.port.enable(False)  # to a line that lost it, too
        self._applied = put
        self._time = self.port.advance()
        self._before, self._counts = self._counts, self.port.read()
        self._tick += 1
        if self._mode not in (Mode.IDLE, Mode.FAULT) and (faults := self._beyond()):
            self._trip(faults)

    def _beyond(self) -> Fault:
        """Limits that the newest sample passes."""
        c, limits, faults = self._there(), self._held(), NO_FAULT
        at = self._at()
        steps = [(b - a) / per for a, b, per in zip(self._before, self._counts, c.counts, strict=True)]
        if any(abs(q) > most for q, most in zip(at, limits.travel, strict=True)):
            faults |= Fault.OVERTRAVEL
        if any(abs(s) > most * c.period * (1 + 1e-9) for s, most in zip(steps, limits.speed, strict=True)):
            faults |= Fault.OVERSPEED
        if len(at) > 1 and abs(at[0] - at[1]) > limits.twist:
            faults |= Fault.TWIST
        if self._full > limits.saturation:
            faults |= Fault.SATURATION
        for i, step in enumerate(steps):
            for j in range(len(steps)):
                self._still[j][i] += abs(step)  # how far i went since j showed its last count
            if step:
                self._still[i] = [0.0] * len(steps)
        if limits.frozen and any(far > limits.frozen for row in self._still for far in row):
            faults |= Fault.ENCODER
        return faults

    def _trip(self, fault: Fault) -> None:
        self._off()
        self._faults |= fault
        self._mode = Mode.FAULT

    def _off(self) -> None:
        self._command, self._applied = 0.0, 0.0
        self.port.write(0.0)
        self.port.enable(False)

    def _at(self) -> list[float]:
        return [n / per for n, per in zip(self._counts, self._there().counts, strict=True)]

    def _there(self) -> Capabilities:
        if self._capabilities is None:
            raise RigStopped("The rig is not open; open it first.")
        return self._capabilities

    def _held(self) -> Limits:
        if self._limits is None:
            raise self._refusal("it has no limits; configure them first")
        return self._limits

    def _must(self, what: str, *modes: Mode) -> None:
        self._there()
        if self._mode not in modes:
            raise self._refusal(
                f"to {what} it must be {' or '.join(m.name for m in modes)}, and it is {self._mode.name}"
                + (f" ({fault_text(self._faults)})" if self._faults else "")
            )

    def _stopped(self) -> RigStopped:
        return RigStopped(
            f"{self._there().name} stopped: {fault_text(self._faults)}. Look at it before faults are cleared."
        )

    def _refusal(self, why: str) -> RigStopped:
        return RigStopped(f"{self._there().name} refused: {why}.")


def _down(values: Sequence[float], per: Sequence[float]) -> tuple[float, ...]:
    """Values rounded down to whole counts."""
    return tuple(v if math.isinf(v) else math.floor(v * n + 1e-9) / n for v, n in zip(values, per, strict=True))
