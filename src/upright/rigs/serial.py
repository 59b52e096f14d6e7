"""A rig at the end of a wire: firmware on a board, on a simulated board, or in a process, all by the same frames."""

from __future__ import annotations

import math
import secrets
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import NoReturn

from upright.errors import BadInput, RigStopped
from upright.laws import Law
from upright.rigs import wire
from upright.rigs.board import fault_text
from upright.rigs.driver import Connection, Driver
from upright.rigs.line import Line, open_line
from upright.rigs.onboard import onboard, ticks
from upright.rigs.protocol import LONGEST_PULSE, NO_FAULT, Capabilities, Fault, Limits, Mode, SelfTest, Tick
from upright.rigs.wire import Kind, Packet, Result, Status

_AGAIN = 0.02  # s; after which a request is repeated, as long as there is no watchdog that would not wait for it
_LOOKS_AT_A_LAW = 0.4  # s; a small processor, before it answers
_TRIES = 4  # repetitions within the watchdog's time
_REFUSAL_OF_VERSION_1 = 4  # bytes of it, where a body stands now
_BOOT = 4.0  # s; a board that resets when its port is opened waits for its boot loader

_WHY = {
    Result.WRONG_LENGTH: "a frame has the wrong length; is its firmware as old as this program?",
    Result.WRONG_MODE: "it is in the wrong mode for that",
    Result.WRONG_VALUE: "a value is beyond what it takes",
    Result.NOT_CONFIGURED: "it has no limits or no law yet; configure them first",
    Result.FAULTED: "it has a fault that must be cleared first",
    Result.OFF_START: "it is outside its start window",
    Result.UNKNOWN: "it does not know that request; is its firmware as old as this program?",
    Result.WRONG_SESSION: "it was stopped, cleared or reset since it answered last, and has to be set up again",
}


class SerialRig:
    """A `LiveRig` over a serial port, a pty or any `Line`.

    The sample that `exchange` gives is that of the tick after the command arrived, so that the board's clock paces the
    loop. On firmware in lockstep (`port_host.c`, `simrig.c`) time passes by that tick only.

    Parameters
    ----------
    line : str, Line or callable
        Port such as ``/dev/ttyACM0``, ``COM4`` or ``/dev/pts/4``; or what opens a line.
    coordinates : sequence of str
        What each encoder measures, in the plant's order; one or two.
    counts : sequence of float
        Signed counts per rad or m of each encoder.
    command_unit : str
        ``"V"``, ``"A"``, ...
    full_scale : float
        Command at the converter's last step [command unit].
    period : float, optional
        Between two exchanges [s], a multiple of the board's tick; that itself when omitted. Over USB an answer takes 2
        to 3 ms, and a loop on the host needs the same time for each.
    patience : float
        How long an answer may take before the link is taken for lost [s].
    lockstep : bool
        Whether the board is simulated in lockstep although its firmware does not know it.
    nonce : callable
        Numbers of 32 bits to greet a board with, so that an old answer is not taken for its own.
    resend : float, optional
        After which time a request is repeated [s]; by default a quarter of the watchdog's time, so that it stands a
        few frames lost in a row, and never in lockstep, where time passes by it.
    clock : callable
        Seconds of a clock that never goes back.
    """

    def __init__(
        self,
        line: str | Line | Callable[[], Line],
        *,
        coordinates: Sequence[str],
        counts: Sequence[float],
        command_unit: str,
        full_scale: float,
        period: float | None = None,
        patience: float = 1.0,
        lockstep: bool = False,
        resend: float | None = None,
        clock: Callable[[], float] = time.monotonic,
        nonce: Callable[[], int] = lambda: secrets.randbits(32),
    ) -> None:
        if not 1 <= len(coordinates) <= wire.CHANNELS or len(counts) != len(coordinates):
            raise BadInput(
                f"the firmware reads 1 or {wire.CHANNELS} encoders, each with its counts; got {len(coordinates)} "
                f"coordinates and {len(counts)} counts."
            )
        if not all(math.isfinite(n) and n != 0.0 for n in counts) or not 0.0 < full_scale < math.inf:
            raise BadInput(f"counts must not be zero and the full scale above it, got {counts} and {full_scale:g}.")
        self._open = line if callable(line) else partial(open_line, line) if isinstance(line, str) else None
        self._line = None if isinstance(line, str) or callable(line) else line
        self._coordinates, self._counts = tuple(coordinates), tuple(float(n) for n in counts)
        self._unit, self._full_scale, self._period = command_unit, full_scale, period
        self._patience, self._lockstep, self._resend, self._clock = patience, lockstep, resend, clock
        self._nonce, self._session = nonce, 0
        self._again = math.inf
        self._parser = wire.Parser()
        self._sequence = 0
        self._every, self._tick = 1, 1e-3
        self._about: Capabilities | None = None
        self._hello: wire.Hello | None = None
        self._status = Status(Result.DONE, Mode.FAULT, Fault.RESET, 0)
        self._at: tuple[int, ...] = (0,) * len(self._counts)

    @property
    def dropped(self) -> int:
        """Frames that came damaged since the port was opened."""
        return self._parser.dropped

    @property
    def session(self) -> int:
        """As the board's last answer counts it."""
        return self._session

    def open(self) -> Capabilities:
        """Find the firmware; a board that was switched on stands in FAULT with `Fault.RESET`."""
        if self._line is None:
            if self._open is None:
                raise RigStopped("Its line was closed; open the rig again on another line.")
            self._line = self._open()
        self._parser = wire.Parser()
        self._again = 0.3  # a board that resets when its port is opened hears nothing for a while
        hello = self._greet(1)
        self._every = ticks(self._period, 1e-6 * hello.period) if self._period else 1
        if self._every > 1:
            hello = self._greet(self._every)
        if hello.protocol != wire.PROTOCOL:
            raise RigStopped(
                f"The firmware '{hello.name}' speaks version {hello.protocol} of the protocol and this program version "
                f"{wire.PROTOCOL}; flash the firmware of this release (upright firmware flash)."
            )
        virtual = self._lockstep or hello.virtual
        self._again = self._resend or (math.inf if virtual else _AGAIN)
        self._about = Capabilities(
            name=f"{hello.name} on {self._line.name}", coordinates=self._coordinates, counts=self._counts,
            command_unit=self._unit, full_scale=self._full_scale, steps=hello.steps, period=self._every * self._tick,
            modes=frozenset({Mode.HOST, Mode.MCU}), virtual=virtual, hardware=not virtual, paced=not virtual,
        )  # fmt: skip
        return self._about

    def _greet(self, every: int) -> wire.Hello:
        """Capabilities of the firmware, at this many ticks between two exchanges."""
        greeting = wire.greeting(every, nonce := self._nonce())
        hello = self._hello = wire.hello(self._ask(Kind.HELLO, greeting, max(_BOOT, self._patience)))
        if hello.protocol == wire.PROTOCOL and hello.nonce != nonce:
            raise RigStopped(f"{self._name()} answers another program; stop that one first.")
        self._tick = 1e-6 * hello.period
        return hello

    def configure(self, limits: Limits) -> Limits:
        """Hold limits, rounded towards the safe side to counts, steps and ticks, and to the ceilings that the board was
        compiled with; what came back is compared.
        """
        requested = self._on_wire(limits)
        held = self._ask(Kind.CONFIGURE, requested.body())
        if not wire.limits(held).within(requested):
            self._distrust("limits", wire.limits(held), requested)
        if self._resend is None and math.isfinite(self._again):
            self._again = min(_AGAIN, limits.watchdog / _TRIES)
        return self._from_wire(wire.limits(held))

    def zero(self) -> None:
        """Count from here on."""
        self._ask(Kind.ZERO)

    def self_test(self, pulse: float, seconds: float) -> SelfTest:
        """The farthest that each coordinate went under a pulse and for as long after it.

        Every tick of it is exchanged, which feeds the board's watchdog.
        """
        c = self._there()
        if not 0.0 < seconds <= LONGEST_PULSE:
            raise self._refusal(f"a self-test takes a pulse of up to {LONGEST_PULSE:g} s, got {seconds:g} s")
        length = max(1, _down(seconds / self._tick))
        first = self.exchange(0.0).counts
        self._ask(Kind.SELF_TEST, wire.self_test_body(self._steps(pulse), length))
        farthest, until = [0] * len(first), self._status.tick + 2 * length + 1
        while self._status.tick < until:
            tick = self.exchange(0.0)
            if tick.faults:
                raise self._stopped()
            for i, (now, then) in enumerate(zip(tick.counts, first, strict=True)):
                farthest[i] = max(farthest[i], now - then, key=abs)
        moved = {n: k / per for n, k, per in zip(c.coordinates, farthest, c.counts, strict=True)}
        dead = [n for n, v in moved.items() if v == 0.0]
        return SelfTest(
            moved=moved, complaint=f"Nothing moved: {', '.join(dead)} showed not a single count." if dead else ""
        )

    def arm(self) -> None:
        """Switch the power stage on at zero command."""
        self._ask(Kind.ARM)

    def start(self, mode: Mode, law: Law | None = None) -> None:
        """Give it to the host, or to the firmware's loop with a law in float32 that is read back bit by bit."""
        c = self._there()
        if mode not in c.modes:
            raise self._refusal(f"it has no mode {mode.name}, only {', '.join(sorted(m.name for m in c.modes))}")
        if mode == Mode.MCU:
            if law is None:
                raise self._refusal("its own loop needs a law")
            body = onboard(law, c, self._tick).body()
            try:
                held = self._ask(Kind.LAW, body)
            except RigStopped:
                if self._status.result != Result.WRONG_VALUE:
                    raise
                raise self._refusal(
                    "the law's numbers are absurd; check gains and units: one count, or one that stays, may not move "
                    "the command by its whole limit, its memory may not grow by itself, and no number may reach 2^30 "
                    "in counts and steps"
                ) from None
            if held != body:
                self._distrust("law", held.hex(), body.hex())
        self._ask(Kind.START, bytes((mode,)))

    def exchange(self, command: float) -> Tick:
        """Hand a command over and take the sample of the next tick; faults are in the sample."""
        c = self._there()
        value = 0.0
        if not math.isfinite(command):
            value = math.nan  # the firmware stops on it
        elif self._status.mode == Mode.MCU:
            value = command
        elif self._status.mode == Mode.HOST:
            value = float(self._steps(command))
        try:
            body = wire.exchange(value, self._status.tick)
        except OverflowError:
            body = wire.exchange(math.nan, self._status.tick)
        sample = wire.sample(self._ask(Kind.EXCHANGE, body))
        self._at = sample.counts[: len(self._counts)]
        return Tick(
            tick=self._status.tick // self._every, time=self._status.tick * self._tick + 1e-6 * sample.late,
            counts=self._at,
            applied=sample.applied * c.step, mode=self._status.mode, faults=self._status.faults,
        )  # fmt: skip

    def snapshot(self) -> wire.Snapshot:
        """How it was when the first fault since the last clearing came."""
        return wire.snapshot(self._ask(Kind.SNAPSHOT))

    def stop(self) -> None:
        """Zero, power stage off, IDLE; in FAULT it stays there."""
        self._ask(Kind.STOP)

    def estop(self) -> None:
        """The same from anywhere, latched."""
        if self._about is not None:
            try:
                self._ask(Kind.ESTOP)
            except (RigStopped, OSError):
                return  # the watchdog does it then

    def clear_fault(self) -> None:
        """Forget faults, those too that came since it answered last."""
        try:
            self._ask(Kind.CLEAR)
        except RigStopped:
            if self._status.result != Result.WRONG_SESSION:
                raise
            self._ask(Kind.CLEAR)

    def close(self) -> None:
        """Stop and let go of the line."""
        line, self._line = self._line, None
        if line is None:
            return
        try:
            if self._about is not None:
                self._line = line
                self._ask(Kind.STOP)
        except (RigStopped, OSError):
            pass
        finally:
            self._line = None
            self._about = None
            line.close()

    def _ask(self, kind: Kind, body: bytes = b"", patience: float | None = None) -> bytes:
        """Body of the answer, behind its status; repeated while none comes."""
        line = self._line
        if line is None or (self._about is None and kind != Kind.HELLO):
            raise RigStopped("The rig is not open; open it first.")
        now = again = self._clock()
        patience = self._patience if patience is None else patience
        deadline = now + patience
        # An exchange that is repeated is a new one; anything else is done once, however often it is asked for.
        self._sequence = (self._sequence + 1) & 0xFF
        while now < deadline:
            if now >= again:
                line.write(wire.pack(kind, self._sequence, self._session, body))
                again = now + (self._again if kind != Kind.LAW else max(self._again, _LOOKS_AT_A_LAW))
            for frame in self._parser.feed(line.read(min(again, deadline) - now)):
                answer = self._answer(frame, kind)
                if answer is not None:
                    return answer
            now = self._clock()
        raise RigStopped(
            f"{self._name()} did not answer for {patience:g} s ({self._parser.dropped} damaged frames came). "
            "Its watchdog stops it; look at cable, port and power."
        )

    def _answer(self, frame: Packet, kind: Kind) -> bytes | None:
        """What a frame says to the last request; None when it is no answer to that."""
        if not frame.answers(kind) or frame.sequence != self._sequence:
            return None
        if kind == Kind.HELLO and len(frame.body) == _REFUSAL_OF_VERSION_1:
            raise RigStopped(
                f"{self._name()} speaks version 1 of the protocol and this program version "
                f"{wire.PROTOCOL}; flash the firmware of this release (upright firmware flash)."
            )
        read = wire.status(frame.body)
        if read is None:
            return None
        self._status, rest = read
        self._session = frame.session
        if self._status.result == Result.DONE:
            return rest
        if self._status.result == Result.OFF_START:
            raise self._refusal(f"{_WHY[Result.OFF_START]}: bring it nearer to its zero, and clear the fault")
        raise self._refusal(_WHY[self._status.result])

    def _on_wire(self, limits: Limits) -> wire.LimitsOnWire:
        """Limits in the firmware's units, never wider than requested."""
        c, hello = self._there(), self._hello
        assert hello is not None
        n = len(c.coordinates)
        if len(limits.travel) != n:
            raise self._refusal(f"limits are for {len(limits.travel)} coordinates, and it has {n}")
        if limits.command > c.full_scale * (1 + 1e-9):
            raise self._refusal(
                f"the limit on the command is {limits.command:g} {c.command_unit}, beyond the converter's "
                f"{c.full_scale:g} {c.command_unit}"
            )
        command, watchdog = min(_down(limits.command / c.step), wire.MOST), _down(limits.watchdog / self._tick)
        if command < 1:
            raise self._refusal(f"the limit on the command is less than a step of {c.step:g} {c.command_unit}")
        if not self._every <= watchdog <= 5000:
            raise self._refusal(
                f"the watchdog takes {c.period:g} to {5000 * self._tick:g} s, got {limits.watchdog:g} s"
            )
        twist = wire.NO_LIMIT
        if math.isfinite(limits.twist):
            if n < 2 or c.counts[0] != c.counts[1]:
                raise self._refusal(
                    f"it compares counts for a twist, which takes two encoders of the same counts and sign; they are "
                    f"{', '.join(f'{k:g}' for k in c.counts)} (swap A and B of one that runs the other way)"
                )
            twist = _down(limits.twist * abs(c.counts[0]))
        window = hello.speed_window * self._tick
        return wire.LimitsOnWire(
            travel=self._pair(limits.travel), start=self._pair(limits.start),
            speed=self._pair([v * window for v in limits.speed]),
            frozen=(0, 0) if n < 2 or not limits.frozen else self._pair([limits.frozen] * n),
            twist=twist, watchdog=watchdog, command=command,
            saturation=min(_down(limits.saturation / self._tick), wire.FOREVER - 1)
            if math.isfinite(limits.saturation) else wire.FOREVER,
        )  # fmt: skip

    def _pair(self, values: Sequence[float]) -> tuple[int, int]:
        """Distances in counts of both encoders, at least one; no limit on one that is not there."""
        pairs = [*zip(values, self._counts, strict=True)]
        counts = [wire.NO_LIMIT if math.isinf(v) else _down(v * abs(n)) for v, n in pairs]
        if 0 in counts:
            raise self._refusal(
                f"a limit is less than a count; {self._coordinates} have {self._counts} counts per unit"
            )
        first, second = (*counts, wire.NO_LIMIT)[:2]
        return min(first, wire.NO_LIMIT), min(second, wire.NO_LIMIT)

    def _from_wire(self, held: wire.LimitsOnWire) -> Limits:
        c, hello = self._there(), self._hello
        assert hello is not None

        def back(pair: tuple[int, int], per: float = 1.0) -> tuple[float, ...]:
            each = zip(pair, self._counts, strict=False)
            return tuple(math.inf if k == wire.NO_LIMIT else k / (abs(n) * per) for k, n in each)

        return Limits(
            travel=back(held.travel), speed=back(held.speed, hello.speed_window * self._tick), start=back(held.start),
            command=held.command * c.step, watchdog=held.watchdog * self._tick, frozen=max(back(held.frozen)),
            saturation=math.inf if held.saturation == wire.FOREVER else held.saturation * self._tick,
            twist=math.inf if held.twist == wire.NO_LIMIT else held.twist / abs(c.counts[0]),
        )  # fmt: skip

    def _steps(self, command: float) -> int:
        """A command in steps, as far as the wire has room; the firmware holds it to its limit."""
        steps = math.floor(command / self._there().step + 0.5)
        return min(max(steps, -wire.MOST), wire.MOST)

    def _there(self) -> Capabilities:
        if self._about is None:
            raise RigStopped("The rig is not open; open it first.")
        return self._about

    def _name(self) -> str:
        if self._about is not None:
            return self._about.name
        return f"The board on {self._line.name}" if self._line is not None else "The board"

    def _distrust(self, what: str, held: object, requested: object) -> NoReturn:
        self.estop()
        raise self._refusal(f"it holds another {what} than it was given ({held} instead of {requested})")

    def _stopped(self) -> RigStopped:
        return RigStopped(
            f"{self._name()} stopped: {fault_text(self._status.faults)}. Look at it before it is cleared."
        )

    def _refusal(self, why: str) -> RigStopped:
        faults = self._status.faults
        state = f" It is in {self._status.mode.name}" + (f": {fault_text(faults)}." if faults != NO_FAULT else ".")
        return RigStopped(f"{self._name()} refused: {why}.{state}")


def _down(value: float) -> int:
    """Whole number below, but for rounding of the last digits."""
    return math.floor(min(value + 1e-9 * max(1.0, value), 2.0**40))


def _open(to: Connection) -> SerialRig:
    about, rest = to.capabilities()
    assert to.port is not None  # the driver needs it, so RIG.toml has been refused without
    return SerialRig(
        to.port, coordinates=about.coordinates, counts=about.counts, command_unit=about.command_unit,
        full_scale=about.full_scale, **rest,
    )  # fmt: skip


DRIVER = Driver(name="serial", order=30, open=_open, needs={"port": "/dev/ttyACM0"})
