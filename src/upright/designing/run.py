"""From an identified rig to gains, and what they are worth in the loop that a computer runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from upright.basis import DESCRIBED, Basis
from upright.control.effort import QUIET_RMS, RestEffort, shown
from upright.control.score import effort_at_rest, score
from upright.control.trial import trial
from upright.designing.estimators import chosen, estimator, estimators
from upright.errors import BadInput
from upright.gains import (
    Estimator,
    Margins,
    Placement,
    feedback,
    filtered,
    kalman,
    margins,
    place,
    place_sampled,
    prefilter,
    process_noise,
    read_off,
    weight_for_effort,
)
from upright.gains.loop import closed, command_noise, swing
from upright.gains.lqr import least_cost, linear_motion
from upright.gains.requests import Roots, conjugate_poles, poles_of, written
from upright.laws import Law
from upright.quantities import two_figures
from upright.records import Array
from upright.rig import Rig
from upright.rig.completion import completed
from upright.systems import StateSpace, to_s, to_z
from upright.workers import one_thread

SLOWEST, ROWS = 10.0, 60_000
"""Time constants of the slowest pole, and most samples, for which the motion to rest is simulated."""
CYCLES = 18
"""Of a dead zone, for which it is simulated: the last third has four of them where they are slower by a third."""
MOST_STATES = 30
"""States from which 60 digits take longer than anyone waits."""

SPEEDS = ("plain", "filtered", "kalman")
"""Ways to the velocities: differences of encoders, plain or through a low pass, and a Kalman filter."""


@dataclass(frozen=True, kw_only=True)
class DesignRequest:
    """Request for a loop; SI units, the limit in the command's.

    `period` is that of the matrices where they are sampled.
    `delay` is how late a command acts in all [samples]: that of the rig's file when None, or one where it has none.
    `lag` is the drive's [s], that of the rig's file when None.
    `poles` [1/s] or `weights` (diagonal of Q, with `R`, or with the limit and `start` from which R follows).
    `speed` is one of `SPEEDS`, or a way that matrices allow, empty for the plainest; `memory` is the filter's. With
    `sampled`, the gains are those whose sampled loop has the requested poles. `on` is the rig completed for a run,
    where it is one. `proposed` is how many times as fast as the model itself proposed poles are; None where poles are
    requested.
    """

    at: str
    poles: Roots | None = None
    weights: tuple[float, ...] | None = None
    R: float | None = None
    period: float = 1e-3
    delay: float | None = None
    lag: float | None = None
    speed: str = "filtered"
    memory: float = 0.5
    resolution: tuple[float, ...] | None = None
    limit: float | None = None
    start: tuple[float, ...] | None = None
    track: str | None = None
    sampled: bool = False
    on: Rig | None = None
    proposed: float | None = None

    def __post_init__(self) -> None:
        if not 1e-6 <= self.period <= 10.0:
            raise BadInput(f"a loop is closed every 1e-6 to 10 s, got a period of {self.period:g} s.")
        if self.limit is not None and not 0 < self.limit < 1e9:
            raise BadInput(f"the largest command lies above 0 and below 1e9, got {self.limit:g}.")


@dataclass(frozen=True, kw_only=True)
class VelocityLoop:
    """One way to the velocities, with the loop that it makes; `margins` is None where the loop falls.

    Noise is that of rounding encoders; None where no encoders are known.
    """

    name: str
    speed_noise: Array | None
    command_noise: float | None
    margins: Margins | None
    poles: Roots


@dataclass(frozen=True, kw_only=True)
class Holding:
    """What holding takes on the nonlinear rig with counts and dry friction; `lost` is when it was lost [s], or inf."""

    effort: RestEffort
    lost: float

    @property
    def quiet(self) -> bool:
        """Whether it is held to the end, by a command that is quiet at rest."""
        return math.isinf(self.lost) and self.effort.quiet


@dataclass(frozen=True, kw_only=True)
class Designed:
    """Gains and what they are worth.

    `model` is sampled where plain matrices are those of samples; all poles are in s [1/s] all the same.
    `peak` is the largest command that the start takes with continuous feedback, `peak_sampled` in the loop as it runs;
    `swing` is that way back: t, outputs, commands.
    `holding` is simulated; None of plain matrices, without a limit, and where the linear loop falls.
    K are the gains in force: the `continuous` ones of placement or LQR (`placement` is None then), or the
    `sampled_gains`, whose poles are met in the loop as it runs.
    """

    rig: Rig | StateSpace
    request: DesignRequest
    model: StateSpace
    sampled: StateSpace
    K: Array
    continuous: Array
    placement: Placement | None
    sampled_gains: Array | None
    R: float | None
    law: Law
    poles: Roots
    ways: tuple[VelocityLoop, ...]
    chosen: VelocityLoop
    k_pf: float | None
    peak: float
    peak_sampled: float
    swing: tuple[Array, Array, Array]
    chance: float | None
    holding: Holding | None = None
    cloud: Roots = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))

    def __dir__(self) -> list[str]:
        return [
            "K", "R", "basis", "chance", "chosen", "holding", "k_pf", "law", "model", "open_loop", "peak", "poles",
            "request", "rig", "sampled", "verdict", "wanted",
        ]  # fmt: skip

    @property
    def open_loop(self) -> Roots:
        """Poles of the model, the fastest growing first."""
        poles = _in_s(self.model, poles_of(self.model.A))
        return poles[np.lexsort((poles.imag, -poles.real))]

    @property
    def wanted(self) -> Roots:
        """Requested poles, or those of LQR."""
        if self.placement is not None:
            return self.placement.requested
        return _in_s(self.model, poles_of(self.model.A - self.model.B @ self.continuous))

    @property
    def verdict(self) -> str:
        """Whether this loop may be closed on a rig, in a sentence or two."""
        return self.basis.qualified(self._loop_verdict())

    @property
    def basis(self) -> Basis:
        """What the numbers of the model rest on; those of a plain linear model were given."""
        return DESCRIBED if isinstance(self.rig, StateSpace) else self.rig.basis

    def _loop_verdict(self) -> str:
        way, unit = self.chosen, self.rig.unit
        if way.margins is None:
            samples = f"{self.sampled.delay:.3g} sample{'s' * (self.sampled.delay != 1)}"
            return (
                f"The sampled loop falls: with a period of {1e3 * self.request.period:.4g} ms, a delay of {samples} "
                f"and the {way.name} the gains do not stabilize. "
                "Sample faster, ask for slower poles, or design for the sampled loop (--sampled)."
            )
        thin = self._reservations(way.margins)
        head = "Stable, with reservations: " + "; ".join(thin) if thin else "Stable with margin"
        limit = self.request.limit
        if limit is None:
            return f"{head}."
        share = self.peak_sampled / limit
        start = f"the {'default' if self.request.start is None else 'requested'} start"
        if share > 1:
            return (
                f"{head}. Recovering from {start} takes {self.peak_sampled:.3g} {unit}, {100 * share:.0f} % of the "
                f"limit, and saturates the drive; a start up to {100 / share:.0f} % as far does not."
            )
        return f"{head}; recovering from {start} takes {100 * share:.0f} % of the drive's limit."

    def _reservations(self, m: Margins) -> list[str]:
        """What is thin about the loop, or too much about its command at rest."""
        chance, limit = self.chance, self.request.limit or math.inf
        rounding = (self.chosen.command_noise or 0.0) / limit
        out = [
            text
            for text, bad in (
                (f"modulus margin is only {m.modulus:.2f}", m.modulus < 0.4),
                (f"a gain {100 * (1 - m.least_gain):.0f} % weaker makes it unstable", m.least_gain > 0.7),
                (f"it bears only {1e3 * m.delay:.2g} ms more delay", m.delay < self.request.period),
                (f"{100 * (1 - (chance or 0)):.0f} % of the rigs sampled from the fit's covariance are unstable with "
                 "it", chance is not None and chance < 0.99),
            )
            if bad
        ]  # fmt: skip
        if self.holding is not None and math.isfinite(self.holding.lost):
            out.append(f"with counts, dry friction and limit the simulated rig is lost after {self.holding.lost:.2g} s")
        elif self.holding is not None and not self.holding.effort.quiet:
            out.append(f"the command at rest {shown(self.holding.effort, limit, self.rig.unit)}")
        elif rounding > QUIET_RMS:
            out.append(
                f"the rounding of encoders gives the command an rms of {two_figures(100 * rounding)} % of the limit "
                f"({100 * QUIET_RMS:.0f} % is quiet)"
            )
        return out


@one_thread()
def design_for(rig: Rig | StateSpace, request: DesignRequest) -> Designed:
    """Gains as requested, and their loop as a computer runs it.

    Parameters
    ----------
    rig : Rig or StateSpace
        A plain model knows no encoders and no covariance, and needs no equilibrium.

    Raises
    ------
    BadInput
        When the request cannot be met; the sentence says why.
    """
    if isinstance(rig, StateSpace):
        model, sampled = _plain(rig), _held(_plain(rig), request)
    else:
        model = rig.linear(request.at)
        sampled = model.to_sampled(request.period, _late(rig, request), rig.lag if request.lag is None else request.lag)
    start = _tilt(rig) if request.start is None else np.array(request.start)
    if model.B.shape[1] != 1:
        raise BadInput(f"upright design is for one input, and this model has {model.B.shape[1]}; use place.")
    K, placement, R = _gains(model, request, start)
    wanted = placement.requested if placement is not None else _in_s(model, poles_of(model.A - model.B @ K))
    resolution: tuple[float, ...] | None = None
    if isinstance(rig, StateSpace):
        speed = chosen(model, request.speed)
        known = dict.fromkeys((speed, *estimators(model)[:-1]))
        ways = {s: estimator(s, sampled, request.memory, wanted) for s in known}
    else:
        speed, ways, resolution = _from_encoders(rig, model, sampled, request)
    observed = speed in ("kalman", "observer")
    if request.sampled and observed:
        raise BadInput(
            f"--sampled is for states that no model estimates; with --speed {speed} the poles are met as they are."
        )
    needed = request.sampled or model.dt is None  # gains of a sampled model are at its samples already
    gains = place_sampled(sampled, ways[speed], wanted) if needed and not observed else None
    used = gains if request.sampled and gains is not None else K
    k_pf = None
    if request.track is not None:
        if request.track not in rig.outputs:
            raise BadInput(f"nothing called '{request.track}' is measured; --track one of {', '.join(rig.outputs)}.")
        i = rig.outputs.index(request.track)
        D = float(model.D[i, 0])
        k_pf = prefilter(model.A, model.B, model.C[i], used, D=D, sampled=model.dt is not None)
    law = replace(feedback(ways[speed], used, k_pf or 0.0), target=at_rest(model))
    t, x, u = _way_back(model, K, start)
    loops = {s: _velocity_loop(model, sampled, e, used, resolution) for s, e in ways.items()}
    cloud, chance = _cloud(rig, request, sampled, law)
    peak = _peak(sampled, law, start, float(t[-1]))
    return Designed(
        rig=rig, request=request, model=model, sampled=sampled, K=used, continuous=K, placement=placement,
        sampled_gains=gains, R=R, law=law, poles=to_s(poles_of(closed(sampled, law)), sampled.period),
        ways=tuple(loops.values()), chosen=loops[speed], k_pf=k_pf, peak=float(np.abs(u).max()),
        peak_sampled=peak, holding=_holding(request, sampled, law, start, peak, loops[speed].margins),
        swing=(t, x @ model.C.T + u @ model.D.T, u), chance=chance, cloud=cloud,
    )  # fmt: skip


def at_rest(model: StateSpace) -> Array:
    """Readings at the point about which a model holds; zero where it names none."""
    point = model.point or {}
    return np.array([point.get(name, 0.0) for name in model.outputs], dtype=np.float64)


def _plain(model: StateSpace) -> StateSpace:
    """A model to design for, commands on their way being states like any other where it is sampled."""
    if not 1 <= len(model.states) <= MOST_STATES or not model.inputs or not model.outputs:
        raise BadInput(
            f"a model to design for has 1 to {MOST_STATES} states, an input and an output, got {len(model.states)} "
            f"states, {len(model.inputs)} inputs and {len(model.outputs)} outputs."
        )
    return model if model.dt is None else replace(model, continuous=None, delay=0.0, lag=0.0)


def _held(model: StateSpace, request: DesignRequest) -> StateSpace:
    """A plain model as the loop meets it: a sample late unless it is one of samples, which holds its delay."""
    late = request.delay if request.delay is not None else 0.0 if model.dt else 1.0
    if model.D.any() and not late:
        raise BadInput(
            "with a D the readings show the command of the same sample, and no computer answers a reading by what "
            "changes it; let the command come a sample late: --delay 1."
        )
    return model.to_sampled(request.period, late, request.lag or 0.0)


def _in_s(model: StateSpace, poles: Roots) -> Roots:
    """Poles in s [1/s] of those of the model."""
    return to_s(poles, model.period) if model.dt is not None else poles


def _gains(model: StateSpace, request: DesignRequest, start: Array) -> tuple[Array, Placement | None, float | None]:
    """Gains as requested, how their poles were placed, in s, or the weight of the effort."""
    A, B = model.A, model.B
    if request.poles is not None:
        placement = _placed_samples(model, request.poles) if model.dt is not None else place(A, B, request.poles)
        return placement.K, placement, request.R
    weights, R, discrete = request.weights or (1.0,) * A.shape[0], request.R, model.dt is not None
    if R is None and (discrete or request.limit is None):
        other = "" if discrete else " or a limit (--limit)"
        raise BadInput(f"LQR needs a weight of the effort (--effort-weight){other}; give one.")
    if R is None:
        R = weight_for_effort(A, B, weights, start, request.limit or math.inf, states=model.states)
    return least_cost(A, B, weights, R, sampled=discrete, states=model.states).K, None, R


def _placed_samples(model: StateSpace, poles: Roots) -> Placement:
    """Gains of a model that is known at its samples, poles in s; placed as (z - 1)/T, which spreads those near 1."""
    requested, T = conjugate_poles(poles, model.A.shape[0]), model.period
    if np.abs(requested.imag).max() > math.pi / T:
        raise BadInput(
            f"samples of {1e3 * T:g} ms show nothing faster than {math.pi / T:.4g} rad/s, and a pole was requested at "
            f"{written(requested)}; ask for slower ones."
        )
    placement = place((model.A - np.eye(requested.size)) / T, model.B / T, (to_z(requested, T) - 1) / T)
    attained = to_s(1 + T * placement.attained, T)
    return replace(placement, requested=requested, attained=attained, miss=float(np.abs(attained - requested).max()))


def _way_back(model: StateSpace, K: Array, start: Array) -> tuple[Array, Array, Array]:
    """Motion of the model under ``u = -K x``: t (N,) [s], x (N, n) and u (N, m)."""
    if model.dt is None:
        return linear_motion(model.A, model.B, K, start)
    slowest = float(np.abs(poles_of(model.A - model.B @ K)).max())
    samples = int(np.clip(10 / -math.log(slowest) if 0 < slowest < 1 else 0, 20, 20_000))
    shown = replace(model, C=np.eye(model.A.shape[0]), D=None, outputs=())
    x, u = swing(shown, feedback(read_off(shown), K), start, samples)
    return np.arange(samples, dtype=np.float64) * model.period, x, u


def _from_encoders(
    rig: Rig, model: StateSpace, sampled: StateSpace, request: DesignRequest
) -> tuple[str, dict[str, Estimator], tuple[float, ...]]:
    """The requested velocity estimator, all that a rig has, and the steps of its encoders."""
    resolution = request.resolution or tuple(completed(rig, needs=("counts",), who="design").resolution.tolist())
    if request.limit is None and request.speed == "kalman":
        raise BadInput(
            "a Kalman filter has to know how hard the rig is pushed, a tenth of what the drive can; give the largest "
            'command (--limit 10, or [actuator] limit = "10 V" in the study).'
        )
    ways = SPEEDS if request.limit is not None else SPEEDS[:-1]
    limit = request.limit or math.inf
    return (
        request.speed,
        {s: velocities(model, sampled, s, request.memory, limit, resolution) for s in ways},
        resolution,
    )


def _late(rig: Rig, request: DesignRequest) -> float:
    """How late a command acts [samples]; what was identified from a log holds the computer's share already."""
    if request.delay is not None:
        return request.delay
    return rig.delay / request.period or 1.0


def _peak(sampled: StateSpace, law: Law, start: Array, seconds: float) -> float:
    """Largest command of the loop as it runs; infinite when it falls."""
    if np.abs(poles_of(closed(sampled, law))).max() >= 1:
        return math.inf
    samples = min(max(round(seconds / sampled.period), 100), 20_000)
    return float(np.abs(swing(sampled, law, start, samples)[1]).max())


def _holding(
    request: DesignRequest, sampled: StateSpace, law: Law, start: Array, peak: float, standing: Margins | None
) -> Holding | None:  # fmt: skip
    """What holding takes on the rig, let go near enough for half of the limit to bring it back."""
    if request.on is None or request.limit is None or not 0 < peak < math.inf:
        return None
    slowest = -float(to_s(poles_of(closed(sampled, law)), request.period).real.max())
    lost = request.on.more.get("actuator.dead_zone", 0.0)
    _, frequency = (0.0, 0.0) if standing is None else standing.dead_zone_cycle(lost)
    cycles = CYCLES * math.tau / frequency if frequency else 0.0
    seconds = min(max(SLOWEST / slowest, 6.0, cycles), ROWS * request.period)
    rig = request.on.replace(delay=sampled.delay * request.period, lag=sampled.lag)
    near = start * min(1.0, 0.5 * request.limit / peak)
    run = trial(rig, replace(law, target=0.0), at=request.at, start=near, seconds=seconds)
    scored = score(run)
    return Holding(effort=effort_at_rest(run), lost=min(scored.fell, scored.ran_out))


def _tilt(rig: Rig | StateSpace) -> Array:
    """Five degrees, or 5 cm, of the last coordinate; of plain matrices one unit of the first state."""
    if isinstance(rig, StateSpace):
        return np.eye(len(rig.states))[0]
    x = np.zeros(2 * len(rig.plant.coordinates))
    x[-2] = math.radians(5) if rig.plant.coordinates[-1].unit == "rad" else 0.05
    return x


def velocities(
    model: StateSpace, sampled: StateSpace, speed: str, memory: float, limit: float, resolution: ArrayLike
) -> Estimator:
    """States from encoders in one of the ways of `SPEEDS`.

    Parameters
    ----------
    model, sampled : StateSpace
        From the command to the coordinates.
    memory : float
        Of the filtered difference.
    limit : float
        Largest command. For the Kalman filter the process noise of every coordinate is what a tenth of it would cause:
        pushes, friction, what the model leaves out.
    resolution : float or array
        Step of each encoder [m or rad].
    """
    if speed == "kalman":
        shaking = process_noise(sampled, 0.1 * limit * np.abs(model.B[1::2, 0]))
        return kalman(sampled, shaking, np.asarray(resolution) / math.sqrt(12))
    return filtered(sampled, memory if speed == "filtered" else 0.0)


def _velocity_loop(
    model: StateSpace, sampled: StateSpace, estimator: Estimator, K: Array, resolution: tuple[float, ...] | None,
) -> VelocityLoop:  # fmt: skip
    law = feedback(estimator, K)
    poles = poles_of(closed(sampled, law))
    stands = bool(np.abs(poles).max() < 1)
    return VelocityLoop(
        name=estimator.name,
        speed_noise=None if resolution is None else estimator.noise(resolution)[1 : model.A.shape[0] : 2],
        command_noise=command_noise(sampled, law, resolution) if stands and resolution is not None else None,
        margins=margins(sampled, law) if stands else None,
        poles=to_s(poles, sampled.period),
    )


def _cloud(rig: Rig | StateSpace, request: DesignRequest, nominal: StateSpace, law: Law) -> tuple[Roots, float | None]:
    """Poles [1/s] of the loop with these gains on every rig that the fit allows, and the share that stands."""
    others = [] if isinstance(rig, StateSpace) else rig.spread(request.at)
    rows = [poles_of(closed(m.to_sampled(request.period, nominal.delay, nominal.lag), law)) for m in others]
    if not rows:
        return np.zeros(0, dtype=np.complex128), None
    z = np.array(rows)
    return to_s(z, request.period).ravel(), float(np.mean(np.abs(z).max(axis=1) < 1))
