"""The first power-up of a rig, step by step with a person beside it: what is done, what was seen, and what mends it.

First with the motor without power: every coordinate is moved by hand by an amount that the person can see, which shows
whether its encoder counts, the right way, and as many as described. Nothing is switched on while that is wrong, since
every limit is in counts. Then pulses, each stronger than the last, show where the drive begins to move its body, to
which side, how far by the model, and whether the pendulum follows as it must; then the stop button, the end of the
travel and the watchdog are tried.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from upright.control.watch import sticking
from upright.errors import RigStopped
from upright.rig import Rig
from upright.rigs import Board, Fault, LiveRig, Mode, TwinPort
from upright.rigs.board import fault_text
from upright.rigs.supervisor import ALIKE, Supervisor, pulse_response

QUARTER = math.pi / 2
LENGTH = 0.1
"""How far a hand moves a coordinate that does not turn, where its travel allows [m]."""
TOLERANCE = 0.2
"""By how much a hand misses what it was asked for, as a share of it."""
DECODED = (0.25, 0.5, 2.0, 4.0)
"""Counts over those described, where lines were taken for counts or edges for lines."""
STILL = 3
"""Counts that a body that nothing drives may show."""
WEAKEST, STRONGER = 0.002, 1.5
"""The first pulse, as a share of the largest command, and how much stronger each is than the one before."""
PLAINLY = 10.0
"""How much stronger than the first pulse that moves it the one is whose size is compared, where its travel allows."""
PATIENCE = 15.0
"""In which a person pushes the driven body to the end of its travel [s]."""

REMINDERS = 3
"""How often a person is asked to bring the driven body back who has left it off its start window."""

PAUSE = threading.Event()
Hand = Callable[[str], bool]


@dataclass(frozen=True, kw_only=True)
class CheckupFinding:
    """One thing that was looked at; `good` is None where it was not, and `fix` says what mends what is wrong."""

    what: str
    observed: str
    good: bool | None = True
    fix: str = ""


@dataclass(kw_only=True)
class FirstPowerUp:
    """A rig that was opened and holds its limits, and the person beside it.

    Attributes
    ----------
    hand : callable or None
        Called with a sentence that asks for something to be done, or a question; answers whether it was, or yes. A
        twin moves itself where there is none.
    wait : callable
        Lets seconds pass in which nobody speaks to the rig.
    counts : dict of str to float
        Signed counts per turn or metre that a hand has shown, of the coordinates that count otherwise than described.
    dead_zone : tuple of (float, float)
        Largest command that did not move the driven body and smallest that did, forward [command unit].
    """

    beside: Supervisor
    model: Rig
    hand: Hand | None = None
    wait: Callable[[float], object] = PAUSE.wait
    counts: dict[str, float] = field(default_factory=dict[str, float])
    dead_zone: tuple[float, float] = (0.0, 0.0)

    @property
    def rig(self) -> LiveRig:
        """Itself."""
        return self.beside.rig

    @property
    def twin(self) -> TwinPort | None:
        """The port of a rig that is simulated here."""
        return self.rig.port if isinstance(self.rig, Board) and isinstance(self.rig.port, TwinPort) else None

    @property
    def driven(self) -> int:
        """Which coordinate the drive moves."""
        names = [c.name for c in self.model.plant.coordinates]
        return names.index(self.model.plant.inputs[0].on)

    def by_hand(self) -> Iterator[CheckupFinding]:
        """Every encoder."""
        if self.hand is not None and self.twin is None:
            self.hand("The motor without power, its button pressed: nothing may move by itself.")
        for i in range(len(self.model.plant.coordinates)):
            yield self._moved_by_hand(i)

    def _moved_by_hand(self, i: int) -> CheckupFinding:
        coordinate, per = self.model.plant.coordinates[i], np.array(self.beside.about.counts)
        what, requested, words = f"{coordinate.name} by hand", *self._amount_and_way(i)
        before = self.rig.exchange(0.0)
        if before.faults:
            return CheckupFinding(what=what, observed=fault_text(before.faults), good=False)
        if self.hand is not None:
            if not self.hand(f"Move {coordinate.name} by hand {words}, and hold it still."):
                return CheckupFinding(what=what, observed="not moved", good=None)
        elif self.twin is not None:
            away = np.zeros(2 * len(per))
            away[2 * i] = requested
            self.twin.hold(next(iter(self.model.plant.equilibria)), away)
        else:
            return CheckupFinding(what=what, observed="it was not moved", good=None)
        moved = np.array(self.rig.exchange(0.0).counts) - before.counts
        shown = _amount(moved[i] / per[i], coordinate.unit)
        if abs(moved[i]) < TOLERANCE / 2 * requested * abs(per[i]):
            # of an encoder at another's place the counts come there
            there = np.abs(np.abs(moved) / (requested * abs(per[i])) - 1.0) <= TOLERANCE
            others = [c.name for c, other in zip(self.model.plant.coordinates, there, strict=True) if other]
            return self._silent(what, shown, coordinate.name, others)
        return self._judged(i, what, shown, float(moved[i] / per[i]) / requested)

    @staticmethod
    def _silent(what: str, shown: str, name: str, others: list[str]) -> CheckupFinding:
        if others:
            return CheckupFinding(
                what=what, good=False,
                observed=f"showed {shown}, and {' and '.join(others)} moved: their encoders are swapped",
                fix=f"swap the plugs of {name} and {others[0]}",
            )  # fmt: skip
        return CheckupFinding(
            what=what, good=False, observed=f"showed {shown}: not connected, or not this channel",
            fix=f"check the encoder of {name}: its supply, its ground, both channels, and their pins",
        )  # fmt: skip

    def _judged(self, i: int, what: str, shown: str, ratio: float) -> CheckupFinding:
        name, described = self.model.plant.coordinates[i].name, self.model.counts[i]
        way = math.copysign(1.0, self.beside.about.counts[i])
        if abs(abs(ratio) - 1.0) <= TOLERANCE:
            if ratio > 0:
                return CheckupFinding(what=what, observed=f"showed {shown}")
            self.counts[name] = -way * round(described, 6)
            return CheckupFinding(
                what=what, good=False, observed=f"showed {shown}: it counts the wrong way, swap its channels",
                fix=f"swap channels A and B of {name}'s encoder, or give its counts a minus",
            )  # fmt: skip
        factor = min(DECODED, key=lambda f: abs(math.log(abs(ratio) / f)))
        likely = abs(abs(ratio) / factor - 1.0) <= TOLERANCE
        counts = round(described * factor) if likely else float(f"{described * abs(ratio):.2g}")
        if likely:
            self.counts[name] = math.copysign(counts, way * ratio)
        unit = "turn" if self.model.plant.coordinates[i].unit == "rad" else "metre"
        turned = ", and counts the wrong way" if ratio < 0 else ""
        return CheckupFinding(
            what=what, good=False,
            observed=f"showed {shown}, {abs(ratio):.2g} times the motion requested{turned}: wrong counts per {unit}",
            fix=f"it has {'' if likely else 'about '}{counts:.6g} counts per {unit} and not {described:.6g}; correct "
            "them (four times the lines of an encoder)",
        )  # fmt: skip

    def _amount_and_way(self, i: int) -> tuple[float, str]:
        """How far a hand is to move a coordinate, and in words to which side."""
        coordinate, travel = self.model.plant.coordinates[i], self.beside.held.travel[i]
        sense = "in the sense that is to be positive"
        if coordinate.unit != "rad":
            requested = LENGTH if travel > 1.5 * LENGTH else float(f"{travel / 2:.1g}")
            return requested, f"by {1e3 * requested:.4g} mm {sense}"
        if i == self.driven:
            sense += ", such as anticlockwise seen from above" if travel < math.inf else ""
        elif (against := self._against()) is not None:
            sense = f"its free end leaving {'against' if against else 'in'} the positive sense of {self._driven_name}"
        whole = travel > 2 * math.pi
        return (2 * math.pi if whole else QUARTER), f"by {'one full turn' if whole else 'a quarter turn'}, {sense}"

    def _against(self) -> bool | None:
        """Whether the free end of a pendulum leaves against the positive sense of what carries it: inertia holds it
        back, so that this is where it is shown positive when both move alike in the model.
        """
        if "inverted" not in self.model.plant.equilibria or len(self.model.per_unit) != 2:
            return None
        body, pendulum = self.model.linear(self.beside.duty.zero).B[1::2, 0]
        return bool(body * pendulum > 0)

    @property
    def _driven_name(self) -> str:
        return self.model.plant.coordinates[self.driven].name

    def drive(self) -> Iterator[CheckupFinding]:
        """Pulses to either side, until the driven body moves; ends at what has to be mended first."""
        self._steadied(
            "Let it hang at rest. Supply on, button released, and hands away but for the button: it gives short "
            "pulses, each stronger than the last."
        )
        below, first, moved = self._first_move(1.0)
        what = "the drive, forward"
        if not first:
            yield self._nothing_moves(what)
            return
        self.dead_zone = below, first
        unit, (lost, error) = self.model.unit, self.lost
        if moved[self.driven] < 0:
            yield CheckupFinding(
                what=what, good=False,
                observed=f"{first:.3g} {unit} moved {self._driven_name} backwards: the motor's leads are swapped",
                fix="swap the motor's two leads",
            )  # fmt: skip
            return
        not_yet = f", and not at {below:.3g} {unit}" if below else ""
        zone = f": a dead zone of {lost:.3g} {unit}, standard error {error:.2g} {unit}" if lost else ""
        yield CheckupFinding(what=what, observed=f"{self._driven_name} moves from {first:.3g} {unit} on{not_yet}{zone}")
        yield self._size(first)
        self._steadied()
        below, first, moved = self._first_move(-1.0)
        if not first or moved[self.driven] > 0:
            yield CheckupFinding(
                what="the drive, backward", good=False,
                fix="check the line for the other direction: PWM B, or the sign",
                observed="it does not move backwards: the drive pushes one way only",
            )  # fmt: skip
            return
        not_yet = f", and not at {below:.3g} {unit}" if below else ""
        yield CheckupFinding(what="the drive, backward", observed=f"moves from {first:.3g} {unit} on{not_yet}")

    @property
    def lost(self) -> tuple[float, float]:
        """Dead zone by the first motion, and its standard error; zeros where there is none beyond friction.

        In the middle between the largest command that moved nothing and the smallest that did, less what the model's
        dry friction takes of it. Anywhere between the two is as likely, so the error is their distance over sqrt(12);
        what is wrong with the model's friction is not in it.
        """
        below, first = self.dead_zone
        friction = sticking(self.model)
        if not below or below <= friction:
            return 0.0, 0.0
        return (below + first) / 2 - friction, (first - below) / math.sqrt(12.0)

    def _steadied(self, request: str = "Bring all to rest where it hangs, and take your hands away.") -> None:
        if self.hand is not None:
            self.hand(request)
            for _ in range(REMINDERS):  # a board that is armed elsewhere latches a fault
                tick, name = self.rig.exchange(0.0), self._driven_name
                off = tick.counts[self.driven] / self.beside.about.counts[self.driven]
                within, unit = self.beside.held.start[self.driven], self.model.plant.coordinates[self.driven].unit
                if abs(off) <= within:
                    return
                self.hand(
                    f"{name} is {_amount(off, unit)} from where it was at the beginning, and the drive is tried within "
                    f"{_amount(within, unit)} of that: bring it back, and let all hang at rest."
                )
        elif self.twin is not None:
            self.twin.hold(self.beside.duty.zero)
            self.twin.let_go()

    def _first_move(self, side: float) -> tuple[float, float, list[float]]:
        """Largest command without a motion, smallest with one (0 where there is none), and that motion."""
        most, below = self.beside.held.command, 0.0
        still = STILL / abs(self.beside.about.counts[self.driven])
        height = max(WEAKEST * most, self.beside.about.step)
        while True:
            moved = list(self.beside.pulse(side * height).moved.values())
            if abs(moved[self.driven]) > still:
                return below, height, moved
            if height >= most:
                return most, 0.0, moved
            below, height = height, min(STRONGER * height, most)

    def _nothing_moves(self, what: str) -> CheckupFinding:
        most = f"not even {self.beside.held.command:.3g} {self.model.unit} moved {self._driven_name}"
        if self.hand is None:
            return CheckupFinding(what=what, observed=f"{most}: nothing drives it", good=False,
                                  fix="check supply, fuse, button, enable line and motor leads")  # fmt: skip
        if self.hand("Does the bridge have its supply? Its own lamp is on, or a meter shows the voltage."):
            return CheckupFinding(
                what=what, good=False,
                observed=f"{most}, although the bridge has its supply: the enable line or the motor's leads are open",
                fix="check the enable line (does the board's lamp go on for a moment?), at the PWM lines and the "
                "motor's leads",
            )  # fmt: skip
        return CheckupFinding(what=what, observed=f"{most}: the bridge has no supply", good=False,
                              fix="check the supply, its fuse, and the button")  # fmt: skip

    def _size(self, first: float) -> CheckupFinding:
        """How far the rig goes under a pulse that moves it plainly, beside its model."""
        below, most = self.dead_zone[0], 0.4 * self.beside.held.travel[self.driven]
        height = min(PLAINLY * first, self.beside.held.command)
        while height > STRONGER * first and abs(self._expected(height - below)[self.driven]) > most:
            height /= STRONGER
        self._steadied()
        moved = list(self.beside.pulse(height).moved.values())
        # the dead zone lies between two commands, and so does what the model does beyond it
        least, model = self._expected(height - first), self._expected(height - below)
        shown = ", ".join(f"{c.name} {_amount(v, c.unit)}" for c, v in
                          zip(self.model.plant.coordinates, moved, strict=True))  # fmt: skip
        shown = f"{height:.3g} {self.model.unit} moved {shown}"
        for i, c in enumerate(self.model.plant.coordinates):
            if (
                i != self.driven
                and abs(model[i]) * abs(self.beside.about.counts[i]) > STILL
                and moved[i] * model[i] < 0
            ):
                self.counts[c.name] = -math.copysign(round(self.model.counts[i], 6), self.beside.about.counts[i])
                return CheckupFinding(
                    what="a small pulse", good=False,
                    observed=f"{shown}: {c.name} went the wrong way, its encoder's channels are swapped",
                    fix=f"swap channels A and B of {c.name}'s encoder, or give its counts a minus",
                )  # fmt: skip
        went = moved[self.driven]
        return self._strength(shown, went / model[self.driven], went / least[self.driven])

    def _expected(self, pulse: float) -> list[float]:
        """Of a drive without a dead zone, which the pulses show."""
        more = {name: value for name, value in self.model.more.items() if name != "actuator.dead_zone"}
        return list(pulse_response(self.model.replace(more=more), self.beside.duty.zero, pulse).moved.values())

    def _strength(self, shown: str, ratio: float, at_most: float) -> CheckupFinding:
        guessed = "actuator.gain" in self.model.guessed
        compared = f"{shown}; {ratio:.2g} to {at_most:.2g} times its model's"
        compared += ", whose gain is a guess" if guessed else ""
        if (ratio < ALIKE and at_most > 1 / ALIKE) or guessed:
            return CheckupFinding(what="a small pulse", observed=compared)
        if at_most <= 1 / ALIKE:
            return CheckupFinding(
                what="a small pulse", observed=f"{compared}: the drive is weak", good=False,
                fix="measure the bridge's supply under load, and see that full_scale in [board] is its volts; is "
                "something rubbing?",
            )  # fmt: skip
        return CheckupFinding(
            what="a small pulse", observed=f"{compared}: the drive is stronger than described", good=False,
            fix="see that full_scale in [board] is the supply's volts, and correct the gain",
        )  # fmt: skip

    def button(self) -> Iterator[CheckupFinding]:
        """Whether the button takes the motor's power."""
        if self.hand is None or self.twin is not None or not self.dead_zone[1]:
            return
        what = "stop button"
        if not self.hand(
            "Bring all to rest, press the stop button and leave it pressed: a pulse must move nothing now."
        ):
            yield CheckupFinding(what=what, observed="not pressed", good=None)
            return
        height = min(2 * self.dead_zone[1], self.beside.held.command)
        moved = abs(list(self.beside.pulse(height).moved.values())[self.driven])
        if moved * abs(self.beside.about.counts[self.driven]) > STILL:
            yield CheckupFinding(
                what=what, observed="the motor moved although the button is pressed", good=False,
                fix="wire the button into the motor's supply, between its plus and the bridge",
            )  # fmt: skip
        else:
            yield CheckupFinding(what=what, observed="pressed, a pulse moves nothing")
        self.hand("Release the button.")

    def travel(self) -> Iterator[CheckupFinding]:
        """Whether the rig stops at the end of the driven body's travel."""
        most, unit = self.beside.held.travel[self.driven], self.model.plant.coordinates[self.driven].unit
        if math.isinf(most) or (self.hand is None and self.twin is None):
            return
        what, far = "end of travel", _amount(most, unit)
        if self.hand is None:
            self._steadied()
        elif not self.hand(
            f"The drive goes on without a command for {PATIENCE:g} s. Push {self._driven_name} slowly beyond "
            f"{far} meanwhile."
        ):
            yield CheckupFinding(what=what, observed="not tried", good=None)
            return
        self.rig.arm()
        if self.hand is None and self.twin is not None:
            away = np.zeros(2 * len(self.model.per_unit))
            away[2 * self.driven] = 1.01 * most
            self.twin.hold(self.beside.duty.zero, away)
        tick = first = self.rig.exchange(0.0)
        while not tick.faults and tick.time - first.time < PATIENCE:
            tick = self.rig.exchange(0.0)
        if tick.faults & Fault.OVERTRAVEL:
            yield CheckupFinding(what=what, observed=f"switched off beyond {far}")
        elif tick.faults:
            yield CheckupFinding(what=what, observed=fault_text(tick.faults), good=False,
                                 fix="push slowly, and watch what it says")  # fmt: skip
        else:
            yield CheckupFinding(what=what, observed="it was not pushed that far", good=None)
        self.rig.stop()
        self.rig.clear_fault()

    def watchdog(self) -> Iterator[CheckupFinding]:
        """Whether the rig stops by itself when nobody speaks to it."""
        self._steadied(f"Bring {self._driven_name} back to its middle, let all hang at rest, hands away.")
        self.rig.exchange(0.0)  # a board looks at its start window where it last saw it
        self.rig.arm()
        self.rig.start(Mode.HOST)
        self.rig.exchange(0.0)
        silence = 2 * self.beside.held.watchdog
        if self.twin is not None and isinstance(self.rig, Board):
            self.rig.alone(silence)
        else:
            self.wait(silence)
        tick = self.rig.exchange(0.0)
        good = bool(tick.faults & (Fault.WATCHDOG | Fault.STALE))
        shown = f"{1e3 * silence:.4g} ms of silence: {fault_text(tick.faults) if tick.faults else 'it went on'}"
        if tick.faults and not good:  # stopped by something else, before
            yield CheckupFinding(what="watchdog", observed=shown, good=None)
        else:
            yield CheckupFinding(what="watchdog", observed=shown, good=good,
                                 fix="" if good else "do not run it; flash the firmware again")  # fmt: skip
        with suppress(RigStopped):
            self.rig.stop()
            self.rig.clear_fault()


def _amount(value: float, unit: str) -> str:
    return f"{math.degrees(value):.3g} degrees" if unit == "rad" else f"{1e3 * value:.3g} mm"
