"""Figures of runs, defined once, for what is predicted and for what happened; of one, or of many side by side.

Dry friction stops a body beside its reference and an encoder shows steps: the motion is measured against where it came
to rest, what is missing there is reported separately, and a band narrower than the encoder's steps is widened to them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.effort import RestEffort, busyness, quiet, rest_effort
from upright.control.trial import Trial, law_on_rig, steps_in_period
from upright.errors import BadInput
from upright.laws import Law
from upright.progress import Progress, silent
from upright.records import Array
from upright.rig import Rig
from upright.rig.drive import saturation
from upright.simulation import simulate
from upright.workers import HERE, Workers, cut, spread

FALLEN = math.pi / 2
"""Deviation beyond which a pendulum has fallen [rad]: past horizontal its pivot moves it the other way."""
BAND = math.radians(2)
"""Deviation of a pendulum within which it counts as settled [rad]."""


@dataclass(frozen=True, kw_only=True)
class Scores:
    """Figures of runs side by side; lanes on the last axis. Peaks and effort count up to the loss, if there was one.

    Attributes
    ----------
    fell : array, shape (lanes,)
        Time at which the watched coordinate was lost [s]; inf when it never was.
    ran_out : array, shape (lanes,)
        Time at which the driven coordinate came to the end of its travel, or of its speed [s]; inf when it never did.
    settled : array, shape (lanes,)
        Time from which the watched coordinate stayed within its band to the end [s]; inf when it did not, or was lost.
    peaks : array, shape (coordinates, lanes)
        Largest deviation of each coordinate [m or rad].
    final : array, shape (coordinates, lanes)
        Half of what each coordinate swings over the last third of the run [m or rad]: what dry friction and counts
        leave.
    effort_peak, effort_rms : array, shape (lanes,)
        Of the command [its unit].
    saturated : array, shape (lanes,)
        Share of the samples at the limit of command or force, 0 to 1.
    at_limit : array, shape (lanes,)
        Time spent there [s].
    rest_rms, rest_peak : array, shape (lanes,)
        Of the command over the last third of the run, as shares of its limit; see `effort.RestEffort`.
    """

    fell: Array
    ran_out: Array
    settled: Array
    peaks: Array
    final: Array
    effort_peak: Array
    effort_rms: Array
    saturated: Array
    at_limit: Array
    rest_rms: Array
    rest_peak: Array

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which runs neither fell nor came to the end of the travel."""
        return np.isinf(self.fell) & np.isinf(self.ran_out)

    @property
    def quiet(self) -> NDArray[np.bool_]:
        """In which runs the command at rest left the drive to what it is there for."""
        return quiet(self.rest_rms, self.rest_peak)


@dataclass(frozen=True, kw_only=True)
class Score:
    """Figures of one run, as in `Scores`; peaks and final by coordinate."""

    fell: float
    ran_out: float
    settled: float
    peaks: Array
    final: Array
    effort_peak: float
    effort_rms: float
    saturated: float
    at_limit: float
    rest_rms: float
    rest_peak: float

    @property
    def held(self) -> bool:
        """Whether it was held to the end, within the travel."""
        return math.isinf(self.fell) and math.isinf(self.ran_out)

    @property
    def quiet(self) -> bool:
        """Whether the command at rest left the drive to what it is there for."""
        return bool(quiet(self.rest_rms, self.rest_peak))


def effort_at_rest(run: Trial) -> RestEffort:
    """What holding took over the last third of a trial, as the encoders and the converter show it."""
    names = [c.name for c in run.rig.plant.coordinates]
    moved = run.rig.plant.inputs[0].on
    return rest_effort(
        run.t, run.u, run.rig.saturation, body=run.record[moved], count=float(run.rig.resolution[names.index(moved)])
    )


def score(run: Trial, *, watched: str = "", fallen: float = FALLEN, band: float = BAND) -> Score:
    """Figures of a trial that was to hold an equilibrium.

    Parameters
    ----------
    watched : str
        Coordinate that falls and settles; the last when omitted.
    fallen, band : float
        Deviations beyond which it counts as fallen, and within which as settled [m or rad].
    """
    all_ = scores(
        run.rig, run.t, run.deviation[:, :, None], run.u[:, None], watched=watched, fallen=fallen, band=band
    )  # fmt: skip
    lane: dict[str, Any] = {n: v[..., 0] if v.ndim > 1 else float(v[0]) for n, v in vars(all_).items()}
    return Score(**lane)


def scores(
    rig: Rig, t: Array, away: Array, u: Array, *, full: ArrayLike | None = None, watched: str = "",
    fallen: float = FALLEN, band: float = BAND,
) -> Scores:  # fmt: skip
    """Figures of runs side by side.

    Parameters
    ----------
    rig : Rig
        For its saturation, its travel and the names of its coordinates.
    t : array, shape (N,)
        Evenly spaced [s].
    away : array, shape (N, coordinates, lanes)
        Deviations from the equilibrium.
    u : array, shape (N, lanes)
        Commands as put out.
    full : array, shape (lanes,), optional
        Smallest command at which each drive gives all that it can; the rig's own when omitted.
    watched, fallen, band
        As in `score`.
    """
    names = [c.name for c in rig.plant.coordinates]
    if (watched or names[-1]) not in names:
        raise BadInput(f"nothing called '{watched}' moves there; watch one of {', '.join(names)}.")
    size = np.abs(away)
    main = size[:, names.index(watched or names[-1])]
    fell = _first(t, ~(main <= fallen))
    moved = names.index(rig.plant.inputs[0].on)
    ran_out = _first(t, ~(size[:, moved] <= rig.travel))
    if math.isfinite(rig.speed_limit):
        speed = np.abs(np.gradient(away[:, moved], t, axis=0))
        ran_out = np.minimum(ran_out, _first(t, ~(speed <= rig.speed_limit)))
    before = t[:, None] <= np.minimum(fell, ran_out)
    inside = main <= band
    # after the last sample outside
    after = t.size - np.argmax(~inside[::-1], axis=0)
    settled = np.where(inside.all(axis=0), t[0], t[np.minimum(after, t.size - 1)])
    lost = np.isfinite(fell) | np.isfinite(ran_out) | ~inside[-1]
    end = away[-max(2, t.size // 3) :]
    level = np.asarray(rig.saturation if full is None else full, dtype=np.float64)
    limited = before & (np.abs(u) >= level * (1 - 1e-9))
    rest_rms, rest_peak = busyness(u, level)
    return Scores(
        fell=fell,
        ran_out=ran_out,
        settled=np.where(lost, np.inf, settled),
        peaks=np.where(before[:, None], size, 0.0).max(axis=0),
        final=(end.max(axis=0) - end.min(axis=0)) / 2,
        effort_peak=np.where(before, np.abs(u), 0.0).max(axis=0),
        effort_rms=np.sqrt(np.sum(np.where(before, u**2, 0.0), axis=0) / before.sum(axis=0)),
        saturated=limited.sum(axis=0) / before.sum(axis=0),
        at_limit=float(t[1] - t[0]) * limited.sum(axis=0),
        rest_rms=rest_rms,
        rest_peak=rest_peak,
    )


def _first(t: Array, when: NDArray[np.bool_]) -> Array:
    """First time at which something is so, lane by lane; inf where it never is."""
    return np.where(when.any(axis=0), t[np.argmax(when, axis=0)], np.inf)


BLOCK, LEAST = 64, 16
"""Most and fewest lanes run at once; one piece of work for whoever shares it."""
ROWS = 8192
"""Samples of a run, such as 7 s of an ECP rig's, beyond which fewer lanes are run at once, to bound the memory."""


def outcomes(
    rig: Rig,
    law: Law,
    *,
    at: str,
    starts: ArrayLike,
    seconds: float,
    parameters: Mapping[str, ArrayLike] | None = None,
    workers: Workers = HERE,
    progress: Progress = silent,
) -> Scores:
    """Figures of trials side by side.

    Parameters
    ----------
    at : str
        Equilibrium to hold.
    starts : array, shape (lanes, states)
        Deviations from the equilibrium when the law is switched on.
    parameters : mapping of str to array, shape (lanes,)
        Parameters of the plant, and of the drive as ``"actuator.gain"`` and so on, in which the lanes differ from the
        rig.
    workers : Workers, optional
        Who computes blocks of lanes; the figures are the same.

    Raises
    ------
    KeyboardInterrupt
        When Ctrl-C came before the last block.
    """
    first = np.atleast_2d(np.asarray(starts, dtype=np.float64))
    lanes = first.shape[0]
    per_lane = {
        name: np.broadcast_to(np.asarray(v, dtype=np.float64), (lanes,)) for name, v in (parameters or {}).items()
    }
    size = max(LEAST, min(BLOCK, BLOCK * ROWS // (round(seconds / rig.period) + 1)) // LEAST * LEAST)
    blocks = [(first[part], {n: v[part] for n, v in per_lane.items()}) for part in cut(lanes, size)]
    work = partial(_outcomes, rig, law, at, seconds)
    scored = spread(work, blocks, workers=workers, progress=progress, what="block of rigs").all()
    if len(scored) == 1:
        return scored[0]
    return Scores(**{n: np.concatenate([getattr(s, n) for s in scored], axis=-1) for n in vars(scored[0])})


def _outcomes(
    rig: Rig, law: Law, at: str, seconds: float, block: tuple[Array, Mapping[str, Array]], _progress: Progress
) -> Scores:
    """Figures of one block: starts (lanes, states) and the parameters of its lanes."""
    starts, parameters = block
    rows = round(seconds / rig.period) + 1
    t = np.arange(rows, dtype=np.float64) * rig.period
    point = np.array(list(rig.plant.equilibrium(at).values()))
    x0 = rig.plant.state(at) + starts
    drives = [{**rig.drive, **{n: float(v[i]) for n, v in parameters.items()}} for i in range(len(x0))]
    motion = simulate(
        rig.plant, {**rig.drive, **parameters}, x0, None, rig.period, samples=rows, substeps=steps_in_period(rig),
        loop=law_on_rig(rig, law, point),
    )  # fmt: skip
    away = motion[:, 0 : x0.shape[1] : 2] - point[:, None]
    return scores(rig, t, away, motion[:, x0.shape[1]], full=[saturation(drive) for drive in drives])


@dataclass(frozen=True, kw_only=True)
class StepFigures:
    """Figures of one step, times from the moment of the step [s], lengths in the signal's unit.

    Attributes
    ----------
    change : float
        From rest before the step to rest after it, with its sign.
    rise : float
        From 10 to 90 % of the change.
    peak_time : float
        When it is farthest; the end where it creeps up to its rest.
    overshoot : float
        How far beyond its rest, as a share of the change; 0 where the encoder does not resolve it.
    settling_2, settling_5 : float
        After which it stays within 2 or 5 % of the change about its rest; inf where the record ends before it is
        known to stay.
    arrival : float
        After which it stays within 5 % of the requested step about the reference itself; inf where friction or
        swinging keep it from there.
    error : float
        Reference less rest.
    resolution : float
        Step of the encoder over the change: what the shares cannot resolve.
    """

    change: float
    rise: float
    peak_time: float
    overshoot: float
    settling_2: float
    settling_5: float
    arrival: float
    error: float
    resolution: float


TAIL = 0.1
"""Share of the record that counts as rest; a median over it hears neither a bump nor an encoder that flickers."""


def step_figures(
    t: ArrayLike, y: ArrayLike, *, before: float, reference: float, resolution: float = 0.0
) -> StepFigures:
    """Figures of a step of the reference at the first sample.

    Parameters
    ----------
    t : array, shape (N,)
        Time [s].
    y : array, shape (N,)
        What followed, from the step on.
    before : float
        Where it rested before.
    reference : float
        Where it should go.
    resolution : float
        Step of its encoder.

    Raises
    ------
    BadInput
        When there are too few samples, or it does not move by more than an encoder's step.
    """
    time, signal = np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if time.ndim != 1 or time.shape != signal.shape or time.size < 20:
        raise BadInput(f"a step needs times and positions, 20 or more of each, got {time.shape} and {signal.shape}.")
    tail = max(3, math.ceil(TAIL * time.size))
    if reference == before:
        raise BadInput(f"a step goes somewhere else; it was at {before:g} and should stay there.")
    rest = float(np.median(signal[-tail:]))
    change = rest - before
    if abs(change) <= max(resolution, 1e-12 * float(np.abs(signal).max())):
        raise BadInput(
            f"nothing stepped: it rests {abs(change):.3g} from where it began, and its encoder shows steps of "
            f"{resolution:.3g}; ask for a larger step or look at friction."
        )
    clock, share = time - time[0], (signal - before) / change
    relative = resolution / abs(change)
    top = int(np.argmax(share))
    beyond = float(share[top]) - 1.0
    return StepFigures(
        change=change,
        rise=_passed(clock, share, 0.9) - _passed(clock, share, 0.1),
        peak_time=float(clock[top]),
        overshoot=beyond if beyond > relative else 0.0,
        settling_2=_settled(clock, share, max(0.02, relative), tail),
        settling_5=_settled(clock, share, max(0.05, relative), tail),
        arrival=_settled(clock, (signal - before) / (reference - before), max(0.05, relative), tail),
        error=reference - rest,
        resolution=relative,
    )


def _passed(t: Array, share: Array, level: float) -> float:
    """When a level is passed first, by a straight line between samples."""
    i = int(np.argmax(share >= level))  # its rest is at 1, so every level below is passed
    if i == 0:
        return float(t[0])
    return float(np.interp(level, share[i - 1 : i + 1], t[i - 1 : i + 1]))


def _settled(t: Array, share: Array, band: float, tail: int) -> float:
    """After which it stays in the band; inf unless it is seen to stay there for as long as the rest was taken from."""
    error = share - 1.0
    off = np.abs(error)
    outside = np.flatnonzero(off > band * (1 + 1e-9))
    if outside.size == 0:
        return 0.0
    i = int(outside[-1])
    if i + 1 > t.size - tail:
        return math.inf
    inwards = off[i] - np.sign(error[i]) * error[i + 1]  # through zero, where the next sample lies on the other side
    return float(t[i] + (t[i + 1] - t[i]) * (off[i] - band) / inwards)
