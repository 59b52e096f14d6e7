"""The supervisor between a law and a rig, on the host: nothing is armed unasked, zero goes out before a word.

The order is fixed: open and read limits back, zero the encoders where it hangs, a small pulse whose answer is compared
with the model's, the start window, a start without a jump; then, tick by tick, a look at the rig's own faults, at
samples that do not go on, at the length of its tick, at travel, at how far it leans, at the command, and at whether
command, driven body and pendulum agree (`control.watch`), which tells a wrong encoder or drive from a hand.
Every way out goes through `LiveRig.estop` before a word; where the host's loop stops it, and drive and body's encoder
are sound, the body is braked before that, for at most `LONGEST`.

This is supervision in software on a computer that may hang, not a rated safety function: a rig needs a stop in
hardware.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from upright.control.braking import LONGEST, SPAN, Braking
from upright.errors import BadInput, RigStopped
from upright.gains.loop import closed
from upright.laws import Law, Rule
from upright.logs.replay import other_gains
from upright.rig import Rig
from upright.rigs.board import Board, fault_text
from upright.rigs.doubts import Doubts
from upright.rigs.law import RunningLaw, absurdity, for_rig
from upright.rigs.protocol import NO_FAULT, Capabilities, Fault, Limits, LiveRig, Mode, SelfTest, Tick
from upright.rigs.still_driven import LOOKED, energy_risen
from upright.rigs.tick_length import TickLength
from upright.rigs.twin import TwinPort
from upright.systems import StateSpace

ALIKE = 1.5
"""Factor by which the response to a pulse may differ from the model's: friction varies, counts do not double."""
PULSES = (0.02, 0.05, 0.1, 0.2, 0.4)
"""Pulses that are tried on the model, in shares of the largest command, until every coordinate would show `PLAIN`."""
PLAIN = 60
"""Counts that a pulse must move a coordinate by to say anything of it."""
PULSE = 0.15
"""Length of the pulse [s]."""
REST = 0.5
"""Time without a count after which a rig is at rest [s]."""

UNSEEING = Fault.ENCODER | Fault.MODEL | Fault.STALE | Fault.LINK | Fault.RESET
"""Faults after which the readings do not tell whether the rig still moves; a board that starts anew counts anew."""

Event = Callable[[float, str, str], None]
Braked = Callable[[Tick, Tick, float], None]
"""Called with a sample while a run is braked, the next one, and the command in between."""
BRAKING = 100
"""Mode of such a row in a log: the supervisor commands, and not the law."""


def unheard(_t: float, _kind: str, _text: str) -> None:
    """Events of a fault."""


def unlogged(_sample: Tick, _next: Tick, _command: float) -> None:
    """Samples of a run that is braked."""


@dataclass(frozen=True, kw_only=True)
class Duty:
    """What a rig is to hold, and how it is looked after.

    Attributes
    ----------
    limits : Limits or None
        How far it may go; without them nothing is armed.
    model : Rig or None
        As identified; what is compared with a model is left out without one.
    at, zero : str
        Equilibrium that is held, and the one at which its encoders are zeroed, of the model's plant.
    lean : float
        How far the last coordinate may be from what is held [rad or m].
    near : float
        The same for a start.
    watch : bool
        Whether encoders and drive are doubted beside the loop; for a pendulum that is held upright.
    """

    limits: Limits | None
    model: Rig | None = None
    at: str = ""
    zero: str = ""
    lean: float = math.inf
    near: float = math.inf
    watch: bool = True

    @property
    def watched(self) -> bool:
        """Whether encoders and drive can be distinguished from hands and friction."""
        return self.watch and self.model is not None and self.at == "inverted" and len(self.model.per_unit) == 2


@dataclass(eq=False)
class Supervisor:
    """A rig with somebody beside it.

    Attributes
    ----------
    event : callable
        Called with ``(time, kind, text)`` of each event.
    stopped : callable
        Called at every tick; answers why to stop, or an empty text.
    clock : callable or None
        The host's own time [s], with which the board's is compared; None where the board's is virtual.
    braked : callable
        Called while a run is braked, see `Braked`; whatever it raises ends that.
    """

    rig: LiveRig
    duty: Duty
    event: Event = unheard
    stopped: Callable[[], str] = field(default=lambda: "")
    clock: Callable[[], float] | None = None
    braked: Braked = unlogged
    about: Capabilities = field(init=False)
    held: Limits = field(init=False)
    law: Law | Rule = field(init=False)
    faults: Fault = field(init=False, default=NO_FAULT)
    target: tuple[float, ...] = field(init=False, default=())
    _running: RunningLaw | None = field(init=False, default=None)
    _doubts: Doubts | None = field(init=False, default=None)
    _ticking: TickLength = field(init=False)
    _braking: Braking | None = field(init=False, default=None)
    _passed: deque[list[float]] = field(init=False)
    _last: Tick | None = field(init=False, default=None)
    _first: Tick | None = field(init=False, default=None)
    _command: float = field(init=False, default=0.0)
    _stale: int = field(init=False, default=0)
    _mode: Mode = field(init=False, default=Mode.IDLE)
    _of_model: StateSpace | None = field(init=False, default=None)

    def prepare(self, *, zero: bool = True) -> Capabilities:
        """Open the rig, hand limits over and read them back; zero its encoders once it rests.

        Raises
        ------
        RigStopped
            When there are no limits, they do not come back as they were sent, it has a fault that nobody looked at, or
            it does not come to rest.
        """
        self.about = self.rig.open()
        if self.duty.limits is None:
            self._give_up(
                NO_FAULT, f"{self.about.name} has no limits, and is not armed without them: write [limits] with "
                f"command, and [limits.{self.about.coordinates[0]}] with travel, speed and start into its RIG.toml.",
            )  # fmt: skip
        requested = self.duty.limits
        assert requested is not None  # as was just asked
        # who stopped it by hand knows, and starts it again on purpose
        left = self.rig.exchange(0.0).faults & ~(Fault.RESET | Fault.STOP)
        if left:
            self._give_up(left, f"{self.about.name} stopped before: {fault_text(left)}. Look at it, then clear its "
                          "fault (upright rig doctor --clear).")  # fmt: skip
        self.rig.clear_fault()
        self.held = self.rig.configure(requested)
        if wrong := _wider(self.held, requested, self.about):
            self._give_up(NO_FAULT, f"{self.about.name} holds other limits than it was given: {wrong}; do not run it.")
        if zero and not self.about.replayed:
            self._await_rest()
            self.rig.zero()
        return self.about

    def check(self) -> SelfTest:
        """Answer of the resting rig to a small pulse, beside the model's; leaves it in IDLE.

        Raises
        ------
        RigStopped
            When it does not come to rest, or does not answer as the model does.
        """
        pulse, expected = self._expected()
        result = self.pulse(pulse)
        complaint = result.complaint or unlike(result, expected)
        moves = ", ".join(f"{n} {v:.4g}" for n, v in result.moved.items())
        self.event(self._time, "self-test", f"a pulse of {pulse:.3g} {self.about.command_unit} moved {moves}")
        if complaint:
            self._give_up(Fault.SELF_TEST, complaint)
        return replace(result, complaint="")

    def pulse(self, height: float) -> SelfTest:
        """How far a resting rig goes under a short command [command unit]; leaves it in IDLE.

        Raises
        ------
        RigStopped
            When it does not come to rest, or passes a limit.
        """
        self._await_rest()
        self._arm()
        result = self.rig.self_test(height, PULSE)
        self.rig.stop()
        return result

    def aim(self, law: Law | Rule) -> Law | Rule:
        """The law as it will run from where the rig is now; still in IDLE, so that a log can be opened with it.

        It holds the driven coordinate where that is now, and a coordinate that turns at the nearest turn of what is to
        be held: neither jumps.

        Raises
        ------
        RigStopped
            When the rig is off its start window, the law has absurd gains, would let the model fall, or would begin
            with all that the command may be.
        BadInput
            When the law is for another rig or period.
        """
        fitted = for_rig(law, self.about, self.held)
        if unfit := absurdity(fitted, self.about, self.held) or self._falls(fitted):
            self._give_up(Fault.GAINS, f"{self.about.name} is not started: {unfit}.")
        if self.about.replayed:
            self.target = self._own_target(fitted)
        else:
            self.target = self._targets(fitted, self.readings(self.rig.exchange(0.0)))
            fitted = for_rig(law, self.about, self.held, self.target) if isinstance(law, Law) else fitted
        self.law = fitted
        self._in_window()
        # what takes time is done before anything is switched on
        watched = self.duty.model if self.duty.watched else None
        self._doubts = Doubts(watched, self.duty.at, self.about.name) if watched else None
        return fitted

    def start(self, mode: Mode = Mode.HOST) -> None:
        """Arm the rig, and give it to the law that was aimed.

        Raises
        ------
        RigStopped
            When it has left its start window, refuses, or is no longer wanted to run.
        """
        self._arm()
        self._in_window()
        self.rig.start(mode, self.law if mode == Mode.MCU and isinstance(self.law, Law) else None)
        self._running, self._mode = RunningLaw(self.law, self.about.period), mode
        model = self.duty.model if mode == Mode.HOST and not self.about.replayed else None
        falls = self.duty.at == "inverted" and len(self.target) == 2
        self._braking = Braking(model, self.duty.at, self.held.command, falls=falls) if model else None
        self._passed = deque(maxlen=1 + SPAN)
        self._last, self._first, self._command, self._stale = None, None, 0.0, 0
        self._ticking = TickLength(self.held.watchdog)
        self.event(self._time, "start", f"{mode.name} holds {', '.join(f'{t:.4g}' for t in self.target)}")

    def _arm(self) -> None:
        """Aiming and opening a log take time: whether the run is still wanted is evaluated just before."""
        if reason := self.stopped():
            self._give_up(Fault.STOP, reason)
        self.rig.arm()

    def near(self) -> bool:
        """Whether the rig is where a run may start; a pulse may have left the driven body off its start window."""
        readings = self.readings(self.rig.exchange(0.0))
        if any(abs(q) > most for q, most in zip(readings[:-1], self.held.start, strict=False)):
            return False
        return abs(readings[-1] - self._targets(self.law, readings)[-1]) <= self.duty.near

    def _in_window(self) -> None:
        if self.about.replayed:
            return
        tick = self.rig.exchange(0.0)
        if tick.faults:
            self._give_up(tick.faults, f"{self.about.name} is not started: {fault_text(tick.faults)}.")
        readings = self.readings(tick)
        if abs(readings[-1] - self.target[-1]) > self.duty.near:
            self._give_up(
                Fault.START, f"{self.about.coordinates[-1]} is {self._shown(readings[-1] - self.target[-1])} from "
                f"where it is to be stabilised, and a run starts within {self._shown(self.duty.near)}; bring it there.",
            )  # fmt: skip
        first = RunningLaw(self.law, self.about.period).step(readings, 0.0)  # a reference may ask for all there is
        if abs(first) >= self.held.command:
            self._give_up(
                Fault.START, f"the law would begin with its largest command, {first:.3g} {self.about.command_unit}; "
                "bring the rig closer to where it is to be stabilised, and let it rest.",
            )  # fmt: skip

    def step(self, tick: Tick, reference: float | None = None) -> float:
        """Command for this tick; in MCU mode the reference, the law's own when omitted.

        Raises
        ------
        RigStopped
            When something is wrong; the command was zero before.
        """
        if reason := self.stopped():
            self._give_up(Fault.STOP, reason)
        if tick.mode != self._mode or tick.faults:
            self._give_up(tick.faults, f"{self.about.name} stopped itself: {fault_text(tick.faults)}.{self._likeliest}")
        if self._last is not None and tick.tick <= self._last.tick:
            self._stale += 1
            if self._stale * self.about.period > self.held.watchdog:
                self._give_up(Fault.STALE, f"{self.about.name} has shown the same sample {self._stale + 1} times.")
            return self._command  # nothing new to answer
        before, self._last, self._first, self._stale = self._last or tick, tick, self._first or tick, 0
        if self.clock is not None and (longer := self._ticking.sees(tick.time, self.clock())) != 1.0:
            self._give_up(
                Fault.MODEL, f"{self.about.name} does not keep its period: on average its ticks lasted {longer:.3g} "
                f"times {1e3 * self.about.period:.4g} ms by this computer's clock. Check the board's clock and "
                "prescaler.",
            )  # fmt: skip
        self._look(self.readings(tick))
        if self._running is None:
            raise BadInput("the loop was not started; call start first.")
        command = self._command
        for time, readings in self._since(before, tick):
            command = self._running.step(readings, reference, time - self._first.time)
            if not math.isfinite(command):
                self._give_up(Fault.GAINS, f"the law gave {command} for a command.")
            if self._doubts is not None:
                # until the host has answered, its last command is what drives the rig
                drives = command if self._mode == Mode.MCU or time == tick.time else self._command
                drives = min(max(drives, -self.held.command), self.held.command)
                away = [q - t for q, t in zip(readings, self.target, strict=True)]
                if wrong := self._doubts.sees(readings, away, drives):
                    self._give_up(*wrong, body_trusted=self._doubts.body_trusted)
        self._command = command if self._mode == Mode.HOST else self._running.followed
        return self._command

    def change(self, law: Law) -> str:
        """Go on by C and D of a law from the next sample on; why not, as a sentence, or an empty text.

        Nothing of the law that runs is changed where they are refused.

        Raises
        ------
        BadInput
            When the law is for another rig or period.
        """
        if self._running is None or self._mode != Mode.HOST:
            return f"{self.about.name} runs no law of the host whose gains could be changed."
        fitted = for_rig(law, self.about, self.held, self.target)
        if unfit := absurdity(fitted, self.about, self.held) or self._falls(fitted):
            return f"These gains are not applied: {unfit}."
        self.law, self._running = fitted, self._running.going_on(fitted)
        self.event(self._time, *other_gains(law))
        return ""

    def _since(self, before: Tick, tick: Tick) -> Iterator[tuple[float, list[float]]]:
        """Time and readings of every tick after one, on a straight line where samples in between did not come."""
        first, last, ticks = self.readings(before), self.readings(tick), tick.tick - before.tick
        for k in range(1, ticks):
            share = k / ticks
            between = [a + share * (b - a) for a, b in zip(first, last, strict=True)]
            yield before.time + share * (tick.time - before.time), between
        yield tick.time, last

    def finish(self) -> None:
        """The end of a run: command to zero, power stage off, IDLE."""
        self.rig.stop()
        self.event(self._time, "stop", "the run is over")

    def give_up(self, fault: Fault, why: str) -> None:
        """Zero first, or braked to rest and zero, then the message.

        Raises
        ------
        RigStopped
            Always.
        """
        self._give_up(fault, why)

    def readings(self, tick: Tick) -> list[float]:
        """Coordinates of a sample [rad or m]."""
        return [n / per for n, per in zip(tick.counts, self.about.counts, strict=True)]

    @property
    def references(self) -> tuple[float, ...]:
        """What the law followed at the tick that was answered last."""
        return () if self._running is None else self._running.references

    @property
    def stale(self) -> bool:
        """Whether the last sample was one that had come before."""
        return self._stale > 0

    @property
    def _likeliest(self) -> str:
        return "" if self._doubts is None else self._doubts.likeliest

    @property
    def _time(self) -> float:
        return 0.0 if self._last is None else self._last.time

    def _look(self, readings: Sequence[float]) -> None:
        for name, q, most in zip(self.about.coordinates, readings, self.held.travel, strict=True):
            if abs(q) > most:
                self._give_up(Fault.OVERTRAVEL, f"{name} is at {q:.4g}, beyond its travel of {most:.4g}.")
        if self._braking is not None:
            self._passed.append([q - target for q, target in zip(readings, self.target, strict=True)])
            i, most = self._braking.which, self.held.travel[self._braking.which]
            q = readings[i]
            outwards = math.copysign(1.0, q) * self._braking.momentum(self._passed)
            needed = self._braking.distance(outwards, most)
            if abs(q) + needed > most:
                self._give_up(Fault.OVERTRAVEL, f"{self.about.coordinates[i]} is at {q:.4g}, and needs {needed:.4g} to "
                              f"stop within its travel of {most:.4g}.{self._likeliest}")  # fmt: skip
        if abs(readings[-1] - self.target[-1]) > self.duty.lean:
            self._give_up(
                Fault.OVERTRAVEL, f"{self.about.coordinates[-1]} is {self._shown(readings[-1] - self.target[-1])} from "
                f"where it is to be stabilised, more than {self._shown(self.duty.lean)}: it fell."
                f"{self._likeliest}",
            )  # fmt: skip

    def _brake(self, *, alone: bool) -> None:
        """Bring the driven body to rest while the drive obeys; whatever goes wrong meanwhile ends it."""
        braking, self._braking = self._braking, None
        if braking is None or self._last is None or not self._passed:
            return
        first, last = braking.momentum(self._passed, alone=alone), self._last
        with suppress(RigStopped):
            for _ in range(round(LONGEST / self.about.period)):
                momentum = braking.momentum(self._passed, alone=alone)
                if self.stopped() or not braking.goes_on(momentum, first):
                    return
                command = braking.command(momentum)
                tick = self.rig.exchange(command)
                if tick.faults or tick.mode != Mode.HOST or tick.tick <= last.tick:
                    return
                self.braked(last, tick, command)
                last = tick
                self._passed.append([q - target for q, target in zip(self.readings(tick), self.target, strict=True)])

    def _give_up(self, fault: Fault, why: str, *, body_trusted: bool = False) -> None:
        try:
            if body_trusted or not fault & (UNSEEING | Fault.GAINS | Fault.STOP):  # who stops it by hand means now
                self._brake(alone=body_trusted)
        finally:
            self.rig.estop()
        if self._running is not None and not fault & UNSEEING and self._still_driven():
            fault |= Fault.MODEL
            why += (
                " It gains energy at zero command: if it keeps moving, the drive does not obey; press the stop button."
            )
        self.faults |= fault
        self.event(self._time, "fault", why)
        raise RigStopped(why)

    def _still_driven(self) -> bool:
        """Whether the rig gains energy after its command went to zero."""
        model, self._running = self.duty.model, None
        if model is None or self.about.replayed:
            return False
        zero = model.plant.equilibrium(self.duty.zero or None)
        offset = np.array([zero[c.name] for c in model.plant.coordinates])
        ticks: list[Tick] = []
        with suppress(RigStopped):  # a rig that does not answer shows nothing
            for _ in range(round(LOOKED / self.about.period)):
                ticks.append(self.rig.exchange(0.0))
        q = np.array([self.readings(tick) for tick in ticks]).reshape(len(ticks), len(offset)) + offset
        return energy_risen(model, [tick.time for tick in ticks], q)

    def _await_rest(self, patience: float = 30.0) -> None:
        """Wait with the power stage off, so that nothing drives what is still moving."""
        first = moved = self.rig.exchange(0.0)
        while moved.time - first.time < patience:
            tick = self.rig.exchange(0.0)
            moved = tick if tick.counts != moved.counts else moved
            if reason := self.stopped():
                self._give_up(Fault.STOP, reason)
            if tick.mode != Mode.IDLE:
                self._give_up(tick.faults, f"{self.about.name} stopped itself: {fault_text(tick.faults)}.")
            if tick.time - moved.time >= REST:
                return
        self._give_up(Fault.SELF_TEST, f"{self.about.name} does not come to rest within {patience:g} s; hold it still.")

    def _expected(self) -> tuple[float, SelfTest | None]:
        """Pulse for the self-test, and what the model does under it."""
        model = self.duty.model
        if model is None:
            return PULSES[1] * self.held.command, None
        response = None
        for share in PULSES:
            response, per_unit = pulse_response(model, self.duty.zero, share * self.held.command), model.per_unit
            counts = [abs(v * per) for v, per in zip(response.moved.values(), per_unit, strict=True)]
            if min(counts) >= PLAIN:
                return share * self.held.command, response
        return PULSES[-1] * self.held.command, response

    def _own_target(self, law: Law | Rule) -> tuple[float, ...]:
        own = law.target if isinstance(law, Law) else 0.0
        return tuple(np.broadcast_to(np.asarray(own, dtype=np.float64), (len(self.about.counts),)).tolist())

    def _targets(self, law: Law | Rule, readings: Sequence[float]) -> tuple[float, ...]:
        """What is held, as the encoders show it."""
        model = self.duty.model
        if model is None:
            return self._own_target(law)
        held, zero = (model.plant.equilibrium(n or None) for n in (self.duty.at, self.duty.zero))
        point = [held[c.name] - zero[c.name] for c in model.plant.coordinates]
        turns = [c.unit == "rad" for c in model.plant.coordinates]
        out = [
            p + math.tau * round((q - p) / math.tau) if turn else p
            for p, q, turn in zip(point, readings, turns, strict=True)
        ]
        i = [c.name for c in model.plant.coordinates].index(model.plant.inputs[0].on)
        along = _free_with(model, self.duty.at, i)
        return tuple(p + d * (readings[i] - point[i]) for p, d in zip(out, along, strict=True))

    def _falls(self, law: Law | Rule) -> str:
        """Why the model falls under this law, as a clause; empty when it stands, or nobody knows."""
        model = self.duty.model
        if model is None or isinstance(law, Rule):
            return ""
        largest = float(np.abs(np.linalg.eigvals(closed(self._sampled(model), law))).max())
        if largest < 1.0 + 1e-9:
            return ""
        return (
            f"under this law its model falls, by a factor e every {model.period / math.log(largest):.3g} s; design a "
            "law for this rig (upright design)"
        )

    def _sampled(self, model: Rig) -> StateSpace:
        """The model as the loop sees it; kept, since other gains are looked at between two ticks."""
        if self._of_model is None:
            linear = model.linear(self.duty.at or next(iter(model.plant.equilibria)))
            self._of_model = linear.to_sampled(model.period, model.delay / model.period, model.lag)
        return self._of_model

    def _shown(self, value: float) -> str:
        unit = "rad" if self.duty.model is None else self.duty.model.plant.coordinates[-1].unit
        return f"{math.degrees(abs(value)):.3g} degrees" if unit == "rad" else f"{1e3 * abs(value):.3g} mm"


def pulse_response(model: Rig, zero: str, pulse: float) -> SelfTest:
    """What a model does under a pulse [command unit] where its encoders are zeroed, if nothing limits it."""
    board = Board(TwinPort(replace(model, scales=None), zero, full_scale=2.0 * max(model.limit, abs(pulse))))
    about = board.open()
    board.clear_fault()
    board.configure(_free(about))
    board.arm()
    return board.self_test(pulse, PULSE)


def _free_with(model: Rig, at: str, i: int) -> list[float]:
    """How all coordinates go along when one is displaced and nothing pulls back, as on a shaft without a spring to
    ground; zeros where something does.
    """
    stiffness = model.linear(at or next(iter(model.plant.equilibria))).A[1::2, 0::2]
    others = np.delete(stiffness, i, axis=1)
    along, *_ = np.linalg.lstsq(others, -stiffness[:, i], rcond=None)
    left = stiffness[:, i] + others @ along
    if np.abs(left).max() > 1e-9 * np.abs(stiffness).max():
        return [0.0] * len(stiffness)
    return np.insert(along, i, 1.0).tolist()


def _free(about: Capabilities) -> Limits:
    wide = (math.inf,) * len(about.counts)
    return Limits(travel=wide, speed=wide, start=wide, command=about.full_scale, watchdog=1e9, saturation=1e9)


def _wider(held: Limits, requested: Limits, about: Capabilities) -> str:
    """What a rig holds wider, or far narrower, than requested."""
    for name in ("travel", "speed", "start"):
        for which, mine, theirs in zip(about.coordinates, getattr(requested, name), getattr(held, name), strict=True):
            if theirs > mine * (1 + 1e-6) or not theirs > 0:
                return f"{name} of {which} {theirs:g} instead of {mine:g}"
    for name in ("command", "watchdog", "saturation"):
        mine, theirs = getattr(requested, name), getattr(held, name)
        if theirs > mine * (1 + 1e-6) + (about.period if name != "command" else 0.0):
            return f"{name} {theirs:g} instead of {mine:g}"
    return ""


def unlike(measured: SelfTest, expected: SelfTest | None) -> str:
    """Why the answer to a pulse is not the model's, as sentences; empty when it is."""
    if expected is None:
        return ""
    out: list[str] = []
    for name, wanted in expected.moved.items():
        moved = measured.moved.get(name, 0.0)
        ratio = moved / wanted if wanted else 1.0
        if abs(ratio) < 0.1:
            out.append(f"{name} hardly moved ({moved:.3g}, its model {wanted:.3g}): is its encoder connected?")
        elif ratio < 0:
            out.append(f"{name} went the wrong way ({moved:.3g}, its model {wanted:.3g}): swap its encoder's channels, "
                       "or the motor's leads if all went the wrong way.")  # fmt: skip
        elif not 1 / ALIKE < ratio < ALIKE:
            out.append(f"{name} showed {ratio:.2g} times its model's motion: correct its counts per turn.")
    return " ".join(out)
