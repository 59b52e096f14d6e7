"""A law as a rig runs it: with its converter and limit, about what is held, a reference handed over each tick."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from upright.errors import BadInput
from upright.laws import Law, Rule, at_work
from upright.laws.at_work import RECENT
from upright.records import Array
from upright.rigs.onboard import MEMORIES
from upright.rigs.protocol import Capabilities, Limits

STEP_SAMPLES = 100
"""For which one count is held to see what a law's memories add up."""
GROWTH = 64 ** (1 / 512)
"""Largest size of a law's own pole: e-fold in no less than 123 samples."""


def for_rig(law: Law | Rule, about: Capabilities, limits: Limits, target: Sequence[float] | None = None) -> Law | Rule:
    """The law with the rig's converter and the limits' command; with other targets of its readings, where given.

    Raises
    ------
    BadInput
        When it is of several lanes or commands, reads something else, or is made for another period.
    """
    name = about.name
    if any(width > 1 for width in law.widths().values()):
        raise BadInput("a rig runs one law, and this one is of several lanes; take one of them (of_lanes).")
    changes = {
        "command_resolution": about.step,
        "limit": min(law.limit, limits.command),
        "delay": 0.0,
        "resolution": 0.0,
    }
    if isinstance(law, Rule):
        return replace(law, **changes)
    if len(law.D) != 1 or law.readings != len(about.coordinates):
        raise BadInput(
            f"{name} shows {', '.join(about.coordinates)} and takes one command; this law reads {law.readings} signals "
            f"and gives {len(law.D)}."
        )
    if law.period and not math.isclose(law.period, about.period, rel_tol=1e-3):
        raise BadInput(
            f"this law is made for a period of {1e3 * law.period:.6g} ms, and {name} ticks every "
            f'{1e3 * about.period:.6g} ms; design for that: upright design FIT --period "{1e3 * about.period:.6g} ms".'
        )
    return replace(law, **changes, **({} if target is None else {"target": np.array(target, dtype=np.float64)}))


class RunningLaw:
    """A law at work, called once per tick with the readings and, where it has one, its reference.

    The references are readings of their own here, so that whoever runs the loop can change them.
    """

    def __init__(self, law: Law | Rule, period: float, *, after: RunningLaw | None = None) -> None:
        recent = () if after is None else tuple(after._recent)
        self.period, self.ticks = period, 0 if after is None else after.ticks - len(recent)
        self.references: tuple[float, ...] = ()  # at the tick that was answered last
        self._signal: list[list[float]] = law.signal().tolist()
        self._own = isinstance(law, Rule)
        self._recent: deque[tuple[Sequence[float], float | None, float | None]] = deque(maxlen=RECENT)
        if isinstance(law, Law) and (m := law.signal().shape[1]):
            n = law.readings
            begin = None if law.begin is None else np.hstack([law.begin, np.zeros((len(law.begin), m))])
            target = np.append(np.broadcast_to(np.asarray(law.target, dtype=np.float64), (n,)), np.zeros(m))
            law = replace(law, references=None, reference_names=(), measured=(), target=target, begin=begin)
        self._step = at_work(law, [self._heard(*had) for had in recent])

    @property
    def followed(self) -> float:
        """First of the references; 0 without any."""
        return self.references[0] if self.references else 0.0

    def step(self, readings: Sequence[float], reference: float | None = None, time: float | None = None) -> float:
        """Command of this tick, rounded and limited.

        Parameters
        ----------
        readings : sequence of float
            As the encoders show them [rad or m].
        reference : float, optional
            First reference now; the law's own signal when omitted.
        time : float, optional
            Since the first tick [s]; so many periods as ticks have passed when omitted.
        """
        return self._step(*self._heard(readings, reference, time))[0]

    def _heard(
        self, readings: Sequence[float], reference: float | None, time: float | None
    ) -> tuple[float, Sequence[float]]:
        """Time and inputs of the next tick."""
        row = list(self._signal[min(self.ticks, len(self._signal) - 1)])
        if reference is not None and row:
            row[0] = reference
        self.references = tuple(row)
        self._recent.append((readings, reference, time))
        self.ticks += 1
        return (self.ticks - 1) * self.period if time is None else time, readings if self._own else (*readings, *row)

    def going_on(self, law: Law | Rule) -> RunningLaw:
        """Another law in the place of this one, that remembers the last `RECENT` readings as if it had read them."""
        return RunningLaw(law, self.period, after=self)


def absurdity(law: Law | Rule, about: Capabilities, limits: Limits) -> str:
    """Why no rig may be given these gains, as a clause; empty when it may.

    Gains with which one count moves the command by its whole limit, at once or through the law's memories, or held
    for `STEP_SAMPLES`, amplify nothing but rounding. A law that grows by itself, faster than `GROWTH` a sample, runs
    away while its command is limited. The firmware computes the same.
    """
    if isinstance(law, Rule):
        return ""
    growth = float(np.abs(np.linalg.eigvals(law.A.reshape(law.A.shape[:2]))).max(initial=0.0))
    if not growth <= GROWTH:
        return (
            f"its own memory is unstable: with nothing to read it grows {growth:.3g} times with each sample, and runs "
            f"away while the command is limited (at most {GROWTH:.4g} times)"
        )
    for k, response in enumerate(_impulse(law, len(about.coordinates))):
        for name, u, per in zip(about.coordinates, response, about.counts, strict=True):
            if not abs(u / per) < limits.command:
                later = f" {k} sample{'s' * (k > 1)} later" if k else ""
                return (
                    f"its gain on {name} is absurd: one count changes the command by {abs(u / per):.3g} "
                    f"{about.command_unit}{later}, and its limit is {limits.command:g} {about.command_unit}"
                )
    held = _step(law, len(about.coordinates))
    for name, u, per in zip(about.coordinates, held, about.counts, strict=True):
        if not abs(u / per) < limits.command:
            return (
                f"its gain on {name} is absurd: one count that stays for {STEP_SAMPLES} samples changes the command by "
                f"{abs(u / per):.3g} {about.command_unit}, and its limit is {limits.command:g} {about.command_unit}"
            )
    return ""


def _step(law: Law, readings: int) -> list[float]:
    """Largest command within `STEP_SAMPLES` after each reading has gone from 0 to 1, from memories at zero."""
    A, B, C, D = (m.reshape(m.shape[:2]) for m in (law.A, law.B, law.C, law.D))
    memories = _filled(A.tobytes(), B[:, :readings].tobytes(), len(A))
    u = np.einsum("i,kij->kj", C[0], memories) + D[0, :readings]
    return np.abs(u).max(axis=0).tolist()


@lru_cache(maxsize=8)
def _filled(A: bytes, B: bytes, n: int) -> Array:
    """Memories at each sample of a step, shape (STEP_SAMPLES + 1, n, readings); kept, since other gains leave them."""
    a, b = np.frombuffer(A).reshape(n, n), np.frombuffer(B)
    b = b.reshape(n, -1) if n else b.reshape(0, 1)
    z = np.zeros((STEP_SAMPLES + 1, *b.shape))
    for k in range(STEP_SAMPLES):
        z[k + 1] = a @ z[k] + b
    return z


def _impulse(law: Law, readings: int) -> Iterator[list[float]]:
    """Largest command, sample by sample, after 1 in one sample of each reading, from memories at zero or begun by it.

    With n memories it reaches the command within n samples or never: A^n is a sum of lower powers (Cayley and
    Hamilton), so that C A^k B is zero for every k if it is for k < n. At least as many as the firmware looks at.
    """
    n = len(law.A)
    A, B, C, D = (m.reshape(m.shape[:2]) for m in (law.A, law.B, law.C, law.D))
    begin = np.zeros((n, readings)) if law.begin is None else np.asarray(law.begin, dtype=np.float64)
    z = np.hstack([np.zeros((n, readings)), begin.reshape(begin.shape[:2])[:, :readings]])
    with np.errstate(over="ignore", invalid="ignore"):  # what is no number is refused
        for k in range(max(MEMORIES, n) + 1):
            first = float(k == 0)
            u, z = C @ z + first * np.tile(D[:, :readings], 2), A @ z + first * np.tile(B[:, :readings], 2)
            yield np.abs(u[0].reshape(2, readings)).max(axis=0).tolist()
