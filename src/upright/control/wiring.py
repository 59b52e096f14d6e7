"""How a rig is wired, from its first motions: signs of drive and encoders, counts per turn, what the drive gives.

The pendulum's row of eq. (3), ``J theta'' + kappa cos(theta) q'' + weight sin(theta) = spin sin cos q'^2 - friction``,
has no drive in it, and ``kappa/weight`` is r/g of an arm and 1/g of a cart, whatever the pendulum weighs. With
readings ``theta = h/c`` and ``q = p/s``,

    h'' = -w^2 c sin(h/c) - (kappa/weight) w^2 c cos(h/c) p''/s + ...,

so that small and large swings tell w and c (a pendulum at 90 degrees is 18 % slower than at 10), and their answer to
p'' tells s with its sign. The driven body's row then tells what a unit of command gives, and the command that is lost
to either side: ``force = gain sign(u) max(|u| - dead_zone, 0)``. All columns go through one low-pass, which leaves a
linear relation as it is.

Of drive, body and pendulum one is turned round against the two others, or none: all three turned round is the same rig
seen in a mirror.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from upright.control.sensors import SURE, TOLERATED
from upright.control.swing_up import Body, body
from upright.records import Array
from upright.rig import Rig

SMOOTHED = 0.08
"""Length of the low-pass [s]."""
APART = 0.008
"""Step of the differences [s]."""
OF_RATIO = 0.01
"""Relative standard error of kappa and of kappa/weight, as well as a ruler gives the length of an arm."""
OF_LIMIT = 0.002
"""Standard error of a dead zone, as a share of the largest command: friction close to rest passes for as much."""
LONGEST = 0.04
"""Delay and lag of a drive together, at most [s]."""
WEAK = 0.75
"""Share of the force described, below which a drive is called weak."""
PLAIN = 20
"""Counts without which an encoder shows nothing."""
USUAL = tuple(
    sorted({lines * edges for edges in (1, 2, 4) for lines in (
        100, 200, 250, 256, 300, 360, 400, 500, 512, 600, 720, 1000, 1024, 1250, 1800, 2000, 2048, 2500, 3600, 4000,
        4096, 5000)})
)  # fmt: skip
"""Counts per turn that encoders have."""


@dataclass(frozen=True, kw_only=True)
class WiringCheck:
    """What the first motions tell.

    Attributes
    ----------
    names : tuple of str
        Driven body and pendulum.
    unit : str
        Of the command.
    described : tuple of float
        Counts per turn or metre, as described.
    turns : tuple of bool
        Whether they are per turn.
    scale, error : tuple of float
        What each encoder shows over what is true, without its sign, and standard errors.
    drive, drive_error : float or None
        Force of a unit of command over what is described, without its sign.
    dead_zone, dead_error : float or None
        Command that is lost to either side [command unit].
    delay : float or None
        From a command to its force [s].
    moves, swings : float or None
        Sign of the body's shown motion under a positive command, and of the pendulum's shown motion under that of the
        body, each over what the model has; None where nothing was shown.
    broke_away : tuple of float
        Commands to either side at which the body had moved [command unit].
    """

    names: tuple[str, str]
    unit: str
    described: tuple[float, float]
    turns: tuple[bool, bool]
    moves: float | None = None
    swings: float | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    error: tuple[float, float] = (0.0, 0.0)
    drive: float | None = None
    drive_error: float | None = None
    dead_zone: float | None = None
    dead_error: float | None = None
    delay: float | None = None
    broke_away: tuple[float, float] = (0.0, 0.0)

    @property
    def wrong(self) -> tuple[tuple[str, str], ...]:
        """What is wired or counted otherwise than described, each with what to do; a loop must not be closed on it."""
        return (*self._turned, *self._counted)

    @property
    def weak(self) -> str:
        """That the drive gives less than described, as a clause; a loop made from what it gives may be closed."""
        if self.drive is None or self.drive_error is None or not self.drive + SURE * self.drive_error < WEAK:
            return ""
        share = "half" if abs(self.drive - 0.5) < 0.1 else f"{self.drive:.2g} of what is described"
        return f"supply at {share}: the drive gives {self.drive:.2g} ± {2 * self.drive_error:.1g} times its description"

    @property
    def _turned(self) -> tuple[tuple[str, str], ...]:
        driven, pendulum = self.names
        if self.moves is None or self.swings is None:
            return (self._dead,)
        turned = {
            (1.0, 1.0): (), (-1.0, 1.0): (("motor leads swapped", "change the motor's two leads over"),),
            (-1.0, -1.0): ((f"encoder channels of {driven} swapped", "change its channels A and B over"),),
            (1.0, -1.0): ((f"encoder channels of {pendulum} swapped", "change its channels A and B over"),),
        }  # fmt: skip
        return turned[self.moves, self.swings]

    @property
    def _dead(self) -> tuple[str, str]:
        driven, pendulum = self.names
        if self.moves is None and self.swings is None:
            return "nothing moves", "look at supply, enable line and motor leads; is something holding it fast?"
        dead = driven if self.moves is None else pendulum
        return f"encoder of {dead} shows nothing", "look at its supply, its cable and its two channels"

    @property
    def _counted(self) -> tuple[tuple[str, str], ...]:
        out: list[tuple[str, str]] = []
        rows = zip(self.names, self.described, self.turns, self.scale, self.error, strict=True)
        for name, described, turns, scale, error in rows if self.moves and self.swings else ():
            if abs(math.log(scale)) <= max(TOLERATED, SURE * error / scale):
                continue
            counts = abs(described) * scale
            usual = {round(abs(described) * edges) for edges in (0.25, 0.5, 2.0, 4.0)} | (
                set(USUAL) if turns else set()
            )
            near = sorted(n for n in usual if abs(n - counts) < counts * max(0.005, 2.5 * error / scale))
            likely = " or ".join(f"{n}" for n in near) if 0 < len(near) < 4 else f"{float(f'{counts:.3g}'):.0f}"
            what = f"{name}: counts per {'turn' if turns else 'metre'} {likely}, not {abs(described):.0f}"
            out.append((what, f"it shows {scale:.3g} ± {2 * error:.1g} times what is true; correct its counts"))
        return tuple(out)


def check_wiring(model: Rig, t: ArrayLike, readings: ArrayLike, command: ArrayLike) -> WiringCheck:
    """How a rig is wired.

    Parameters
    ----------
    model : Rig
        As described: a pendulum on a driven body.
    t : array, shape (N,)
        Evenly spaced [s].
    readings : array, shape (N, 2)
        Of body and pendulum as the encoders show them, from where it hung at rest [m or rad].
    command : array, shape (N,)
        As applied.
    """
    time, shown, u = (np.asarray(a, dtype=np.float64) for a in (t, readings, command))
    dt, units = float(time[-1] - time[0]) / (len(time) - 1), [c.unit for c in model.plant.coordinates]
    known = WiringCheck(
        names=(model.plant.coordinates[0].name, model.plant.coordinates[1].name), unit=model.unit,
        described=(model.counts[0], model.counts[1]), turns=(units[0] == "rad", units[1] == "rad"),
        broke_away=_broke_away(model, shown[:, 0], u),
    )  # fmt: skip
    shows = [bool(np.ptp(column) > PLAIN * step) for column, step in zip(shown.T, model.resolution, strict=True)]
    if not all(shows):
        return replace(known, moves=1.0 if shows[0] else None, swings=1.0 if shows[1] else None)
    b, every = body(model), max(1, round(APART / dt))
    motion = _Motion(shown[:, 0], shown[:, 1], dt, every)
    scale, error, signed = _scales(b, motion)
    turned = replace(known, scale=scale, error=error, swings=math.copysign(1.0, signed))
    return _of_drive(model, b, turned, signed, motion, u, dt)


class _Motion:
    """Readings with their differences, and the low-pass that every column goes through."""

    def __init__(self, p: Array, h: Array, dt: float, every: int) -> None:
        self.k, self.p, self.h = every, p[every:-every], h[every:-every]
        step = every * dt
        self.p1, self.h1 = ((a[2 * every :] - a[: -2 * every]) / (2 * step) for a in (p, h))
        self.p2, self.h2 = ((a[2 * every :] - 2 * a[every:-every] + a[: -2 * every]) / step**2 for a in (p, h))
        self.window = np.hanning(max(5, round(SMOOTHED / dt)) + 2)[1:-1]
        self.window /= self.window.sum()
        self.every = max(1, self.window.size // 4)

    def smooth(self, *columns: Array) -> Array:
        """Columns, shape (M, columns), thinned to a quarter of the window."""
        return np.column_stack([self.smoothed(c)[:: self.every] for c in columns])

    def smoothed(self, column: Array) -> Array:
        """One column through the low-pass, shorter by its length."""
        return np.asarray(np.convolve(column, self.window, mode="valid"), dtype=np.float64)


def _scales(b: Body, m: _Motion) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Scales of both encoders with their errors, and the sign between them."""
    rho, spin = -b.kappa / b.weight, b.spin / b.J
    quiet = 0.02 * float(np.std(m.h1))

    def columns(c: float, s: float) -> Array:
        sine, cosine = np.sin(m.h / c), np.cos(m.h / c)
        turning = spin * c * sine * cosine * (m.p1 / s) ** 2
        return m.smooth(m.h2 - turning, -c * sine, rho * c * cosine * m.p2, -m.h1, -np.tanh(m.h1 / quiet))

    def solved(c: float, s: float) -> tuple[Array, Array]:
        rows = columns(c, s)
        theta = np.asarray(np.linalg.lstsq(rows[:, 1:], rows[:, 0], rcond=None)[0], dtype=np.float64)
        return theta, rows[:, 0] - rows[:, 1:] @ theta

    def of(c: float) -> tuple[float, Array, float]:
        theta, left = solved(c, 1.0)
        for _ in range(2):
            theta, left = solved(c, abs(theta[0] / theta[1]) if theta[1] else 1.0)
        s = abs(theta[0] / theta[1]) if theta[1] else 1.0
        return float(left @ left), theta, s

    tried = np.geomspace(0.15, 6.0, 60)
    c = float(tried[int(np.argmin([of(float(c))[0] for c in tried]))])
    _, theta, s = of(c)
    start = np.array([math.log(c), theta[0], theta[1], theta[2], theta[3]])

    def residual(x: Array) -> Array:
        rows = columns(math.exp(x[0]), abs(x[1] / x[2]))
        return np.asarray(rows[:, 0] - rows[:, 1:] @ x[1:], dtype=np.float64)

    x, left, J = start, residual(start), np.zeros((0, 0))
    steps = 1e-4 * np.maximum(np.abs(start), 1e-3)
    for _ in range(6):  # Gauss and Newton's, from the best of the grid
        J = np.column_stack([(residual(x + h) - left) / step for h, step in zip(np.diag(steps), steps, strict=True)])
        x = np.asarray(x - np.linalg.lstsq(J, left, rcond=None)[0], dtype=np.float64)
        left = residual(x)
    spread = np.linalg.pinv(J.T @ J) * float(left @ left) / max(len(left) - 5, 1) * 4.0
    c, s = math.exp(x[0]), abs(x[1] / x[2])
    to_s = np.array([0.0, 1 / x[1], -1 / x[2], 0.0, 0.0]) * s
    of_s = math.hypot(math.sqrt(max(to_s @ spread @ to_s, 0.0)), s * OF_RATIO)
    return (s, c), (of_s, c * math.sqrt(max(spread[0, 0], 0.0))), float(x[1] / x[2])


def _of_drive(model: Rig, b: Body, check: WiringCheck, signed: float, m: _Motion, u: Array, dt: float) -> WiringCheck:
    """What the drive gives, by the row of the body: inertia, friction, gain and dead zone."""
    s, c = check.scale[0], math.copysign(check.scale[1], signed)
    q1, q2, theta, w, w2 = m.p1 / s, m.p2 / s, m.h / c, m.h1 / c, m.h2 / c
    sine, cosine = np.sin(theta), np.cos(theta)
    # with the pendulum's share known, inertia and what a unit of command gives follow beside each other
    known = b.kappa * (cosine * w2 - sine * w**2) + b.spin * (sine**2 * q2 + 2 * sine * cosine * w * q1)
    quiet = 0.02 * float(np.std(q1))
    fixed = m.smooth(known, -q2, -q1, -np.tanh(q1 / quiet))
    delays = range(round(LONGEST / dt) + 1)

    def of(lost: float) -> tuple[float, int, Array, Array]:
        """Cost, delay in samples, coefficients and columns where so much of the command is lost."""
        passed = np.sign(u) * np.maximum(np.abs(u) - lost, 0.0)
        early = m.smoothed(np.concatenate([np.zeros(delays[-1]), passed]))
        best: tuple[float, int, Array, Array] | None = None
        for late in delays:
            applied = early[delays[-1] - late + m.k :: m.every][: len(fixed)]
            rows = np.column_stack([fixed[:, 1:], applied])
            x = np.asarray(np.linalg.lstsq(rows, fixed[:, 0], rcond=None)[0], dtype=np.float64)
            cost = float(np.sum((fixed[:, 0] - rows @ x) ** 2))
            if best is None or cost < best[0]:
                best = cost, late, x, rows
        assert best is not None
        return best

    lost, delays = 0.0, range(of(0.0)[1] + 1)  # what a dead zone hides of a drive does not make it faster
    tried = np.linspace(0.0, 0.9 * float(np.abs(u).max()), 31)
    for _ in range(5):  # each time between the neighbours of the best
        k = int(np.argmin([of(lost)[0] for lost in tried.tolist()]))
        lost = float(tried[k])
        tried = np.linspace(tried[max(k - 1, 0)], tried[min(k + 1, tried.size - 1)], 9)
    cost, late, x, rows = of(lost)
    edge = np.concatenate([np.zeros(late), -np.sign(u) * (np.abs(u) > lost)])[m.k : u.size - m.k]
    rows = np.column_stack([rows, x[-1] * m.smooth(edge)])
    spread = np.linalg.pinv(rows.T @ rows) * cost / max(len(rows) - x.size - 1, 1) * 4.0
    gain = float(x[-1])
    return replace(
        check, moves=math.copysign(1.0, gain * model.gain), drive=abs(gain / model.gain), dead_zone=lost,
        drive_error=math.hypot(math.sqrt(spread[3, 3]), OF_RATIO * gain) / abs(model.gain),
        dead_error=math.hypot(math.sqrt(spread[4, 4]), OF_LIMIT * model.limit), delay=late * dt,
    )  # fmt: skip


def _broke_away(model: Rig, p: Array, u: Array) -> tuple[float, float]:
    """Commands of the two ramps when the body had moved by two counts; 0 where it did not."""
    out: list[float] = []
    for side in (1.0, -1.0):
        on = np.flatnonzero(side * u > 0)
        if not on.size:
            out.append(0.0)
            continue
        moved = np.flatnonzero(np.abs(p[on[0] :] - p[on[0]]) >= 2 * model.resolution[0])
        out.append(float(u[on[0] + moved[0]]) if moved.size else 0.0)
    return out[0], out[1]
