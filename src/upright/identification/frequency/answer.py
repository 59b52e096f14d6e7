"""What a frequency response says about a rig: both fits, the numbers with their errors, and the pole to be held."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.errors import NotIdentifiable
from upright.identification.frequency.balance import Balance
from upright.identification.frequency.fitting import Squares, Way, least_squares, simplex_dB, usable
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.inference.covariance import student
from upright.identification.inference.poles import poles
from upright.identification.model.fit import Estimate, Fit, Pole
from upright.identification.model.grey_box import GreyBox
from upright.progress import Progress, silent

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

GROWS = 0.5
"""Real part [1/s] from which a pole counts as unstable; free coordinates sit at 0."""
ODD = 4.0
"""Tolerances that a number may end away from what was known of it."""
POOR = 9.0
"""Chi square per degree of freedom above which the model does not explain the response."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyFit:
    """Everything that follows from one response, measured `at` an equilibrium of a rig as known and requested.

    `used` are the points of the `data` that were fitted, `left_out` says why the others were not. `fit` is for
    `fit.json`: estimates with covariance, poles at every equilibrium, verdict. `key` is the pole that a design has to
    know best, after its equilibrium and what it is, `simplex_pole` the same by the simplex [1/s].
    """

    rig: GreyBox
    at: str
    data: FrequencyResponse
    used: FrequencyResponse
    left_out: tuple[str, ...]
    simplex: Way
    squares: Squares
    fit: Fit
    key: tuple[str, str, Pole]
    simplex_pole: complex


def explain(
    rig: GreyBox, at: str, data: FrequencyResponse, *, seed: int = 0, tell: Progress = silent,
    stopped: Callable[[], bool] = lambda: False,
) -> FrequencyFit:  # fmt: skip
    """Fit a response in both ways.

    Parameters
    ----------
    rig : GreyBox
        Plant with its numbers: to estimate from a guess, known, or known within an uncertainty, which then counts as
        one measurement more. Masses, forces and the drive's gain scale together: one of them must be known.
    at : str
        Equilibrium about which it was measured.
    seed : int
        Of the starts of least squares.
    tell : callable, optional
        Called with the current step and its share completed.
    stopped : callable
        Called between the fits: whether to stop.

    Raises
    ------
    NotIdentifiable
        When too few frequencies can be used.
    """
    Balance(plant=rig.plant, at=at, data=data)  # are its outputs coordinates of this plant?
    usable_rows, left_out = usable(data, dry=_has_dry(rig))
    used = data.only(usable_rows)
    if len(used) < 4:
        raise NotIdentifiable(
            f"{len(used)} usable frequencies are too few for a fit; measure more. {' '.join(left_out)}"
        )
    squares = least_squares(rig, at, used, seed=seed, tell=tell)
    if stopped():
        raise KeyboardInterrupt
    simplex = simplex_dB(rig, at, used, tell=tell)
    q = student(squares.freedom)
    values = squares.way.values
    by_equilibrium = poles(rig, values, list(squares.names), squares.covariance, q)
    key = _key(by_equilibrium, at)
    fit = _fit(rig, squares, by_equilibrium, key, q, left_out)
    other = poles(rig, simplex.values, [], np.zeros((0, 0)), q)
    there = next((p for p in other.get(key[0], ()) if _what(p) == key[1]), None)
    reached = complex(there.real.value, there.imag.value) if there is not None else complex(math.nan, math.nan)
    return FrequencyFit(
        rig=rig, at=at, data=data, used=used, left_out=left_out, simplex=simplex, squares=squares, fit=fit, key=key,
        simplex_pole=reached,
    )  # fmt: skip


def _has_dry(rig: GreyBox) -> bool:
    return any(rig.parameters[j.coulomb].value > 0 for j in rig.plant.joints if j.coulomb in rig.parameters)


def _what(p: Pole) -> str:
    if p.real.value > GROWS and p.imag.value == 0:
        return "unstable pole"
    return "mode" if p.imag.value > 0 else ""


def _key(by_equilibrium: Mapping[str, tuple[Pole, ...]], at: str) -> tuple[str, str, Pole]:
    """The pole by which it falls, or the mode that swings fastest where it was measured."""
    falling = [(name, p) for name, ps in by_equilibrium.items() for p in ps if _what(p) == "unstable pole"]
    if falling:
        name, p = max(falling, key=lambda pair: pair[1].real.value)
        return name, "unstable pole", p
    here = by_equilibrium.get(at, ())
    if not here:
        raise NotIdentifiable("The fitted rig has no equilibrium to stand at; check what was taken as known.")
    swinging = [p for p in here if _what(p) == "mode"]
    p = max(swinging or here, key=lambda p: (p.imag.value, p.real.value))
    return at, _what(p), p


def key_value(key: tuple[str, str, Pole]) -> Estimate:
    """The number of the key pole that is reported: its real part when it grows, its frequency when it swings."""
    return key[2].real if key[1] == "unstable pole" else key[2].imag


def digits(number: Estimate) -> int:
    """Significant digits that show an interval's ends apart."""
    width = number.interval[1] - number.interval[0]
    if not (0 < width < math.inf) or number.value == 0:
        return 4
    return int(np.clip(math.ceil(math.log10(abs(number.value) / width)) + 2, 3, 8))


def _fit(
    rig: GreyBox, squares: Squares, by_equilibrium: Mapping[str, tuple[Pole, ...]], key: tuple[str, str, Pole],
    q: float, left_out: tuple[str, ...],
) -> Fit:  # fmt: skip
    sigma = np.sqrt(np.maximum(np.diag(squares.covariance), 0.0))
    estimates: dict[str, Estimate] = {}
    for name, s in zip(squares.names, sigma.tolist(), strict=True):
        value, unit = squares.way.values[name], rig.parameters[name].unit
        if s == 0:  # nothing of the response depends on it, so its row of the pseudo-inverse is zero
            estimates[name] = Estimate(
                value=value, stderr=math.inf, interval=(-math.inf, math.inf), unit=unit, status="unseen"
            )
            continue
        low, high = value - q * s, value + q * s
        weak = high - low > abs(value) or Estimate.within(value, s, q * s).zero_wide
        bound = value < 1e-6 * rig.parameters[name].value
        status = "at bound" if bound else "poorly determined" if weak else "well determined"
        estimates[name] = Estimate(value=value, stderr=s, interval=(max(low, 0.0), high), unit=unit, status=status)
    size = np.where(sigma > 0, sigma, 1.0)  # what the response does not depend on has no variance
    sentence, trusted = verdict(squares, key)
    return Fit(
        model=rig, estimates=estimates, per_run={}, runs={}, verdict=sentence, trusted=trusted,
        method="least squares on the complex response", evaluations=squares.way.evaluations,
        seconds=squares.way.seconds, cost=squares.misfit * squares.freedom, names=squares.names,
        correlation=squares.covariance / np.outer(size, size), warnings=left_out, poles=by_equilibrium,
    )  # fmt: skip


def verdict(squares: Squares, key: tuple[str, str, Pole]) -> tuple[str, bool]:
    """What was found, and whether to build on it."""
    at, what, _ = key
    number = key_value(key)
    unit = "1/s" if what == "unstable pole" else "rad/s"
    low, high = number.interval
    name = f"The unstable pole at '{at}'" if what == "unstable pole" else f"The fastest mode at '{at}'"
    d = digits(number)
    text = f"{name} is {number.value:.{d}g} {unit}, 95 % interval {low:.{d}g} to {high:.{d}g}."
    if squares.misfit > POOR:
        return (
            f"The model leaves {math.sqrt(squares.misfit):.1f} times the errors stated unexplained, and intervals are "
            f"widened by that: a part of the rig is missing in it, or an encoder has a wrong scale. {text}"
        ), False
    odd = max(squares.surprise, key=lambda n: abs(squares.surprise[n]), default="")
    if odd and abs(squares.surprise[odd]) > ODD:
        return (
            f"The response contradicts what is known of {odd}: it would have to be {squares.way.values[odd]:.4g}, "
            f"{abs(squares.surprise[odd]):.0f} times its tolerance away. Was it measured wrongly, or does an encoder "
            f"have a wrong scale? {text}"
        ), False
    if 2 * squares.reached < squares.starts:
        few = f"Only {squares.reached} of {squares.starts} starts reached this minimum; there may be a lower one."
        return f"{few} {text}", False
    share = (high - low) / 2 / abs(number.value)
    if share > 0.05:
        return f"{text} That is {100 * share:.2g} % either way, too wide to design from: measure closer to it.", False
    return text, True


def curves(answer: FrequencyFit) -> tuple[tuple[Array, Complex], tuple[Array, Complex]]:
    """Frequencies and responses (F, n) of least squares and of the simplex on a close grid.

    Least squares knows dry friction at the amplitudes measured; between frequencies these are taken from both sides.
    """
    data = answer.used
    w = np.geomspace(data.omega[0], data.omega[-1], 240)
    dry = np.column_stack([_between(w, data.omega, data.dry[:, j]) for j in range(len(data.outputs))])
    close = FrequencyResponse(
        omega=w, response=np.ones((w.size, len(data.outputs)), dtype=np.complex128), outputs=data.outputs,
        drive=np.full(w.size, 1e-9, dtype=np.complex128), dry=dry, hold=data.hold,
    )  # fmt: skip
    squares = Balance(plant=answer.rig.plant, at=answer.at, data=close)
    simplex = Balance(plant=answer.rig.plant, at=answer.at, data=close, linear=True)
    return (w, squares.response(answer.squares.way.values)[0]), (w, simplex.response(answer.simplex.values)[0])


def _between(w: Array, at: Array, values: Complex) -> Complex:
    """Sizes by their logarithm, phases as they are."""
    safe = np.where(np.abs(values) > 0, values, 1e-300)
    size = np.interp(np.log(w), np.log(at), np.log(np.abs(safe)))
    phase = np.interp(np.log(w), np.log(at), np.unwrap(np.angle(safe)))
    return np.asarray(np.exp(size + 1j * phase), dtype=np.complex128)
