"""Fits of a frequency response: the paper's simplex, and least squares, side by side.

The simplex walks on the squared dB of the magnitude, linear model, the far output first and then all. Least squares
uses the phase too, weighs every point by its error, knows what dry friction did at that amplitude, and starts several
times.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, NotIdentifiable
from upright.identification.frequency.balance import Balance
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.model.grey_box import GreyBox, Parameter
from upright.physics import Plant
from upright.progress import Progress, silent

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

STICKS = 0.12
"""Share of the period nearly at rest, 0.032 for a sine, above which a joint sticks and its friction is not known."""
FLOOR = 5e-4
"""Relative error that no response is better than: what the wait for settling leaves, gains of converters, the clock."""
FRICTION = 0.001
"""How well dry friction's share of a response follows from the turning of encoders: from twins."""
SPREAD = 0.35
"""Standard deviation of the logarithm of starts."""
RESTARTS = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Way:
    """What one method found: all numbers by name, its model (F, n), and what it cost.

    `squares_dB` is the sum of squared magnitude errors [dB^2], `evaluations` counts models.
    """

    name: str
    values: Mapping[str, float]
    model: Complex
    squares_dB: float
    evaluations: int
    seconds: float
    stages: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Squares:
    """Least squares: the way, the names of its unknowns, those known within a tolerance included, and how well it fits.

    `covariance` (n, n) is that of their values [SI]. `misfit` is chi square per degree of freedom by stated errors,
    which are widened by its root when it is above 1; `sigma` (F, n) the relative error of real and of imaginary part by
    which points were weighed. `surprise` says of what was known within a tolerance how many of these it ended away,
    `reached` how many of the starts ended at the same minimum.
    """

    way: Way
    names: tuple[str, ...]
    covariance: Array
    misfit: float
    freedom: int
    sigma: Array
    surprise: Mapping[str, float]
    starts: int
    reached: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Coordinates:
    """Unknowns of a search, one number z each: ``value = size exp(z)``, or ``size z`` for those that may vanish.

    `names` include those known within a `tolerance` [in z], which are rows of the least squares; the others have an
    infinite one. `base` holds every number of the rig.
    """

    names: tuple[str, ...]
    size: Array
    log: NDArray[np.bool_]
    tolerance: Array
    base: Mapping[str, float]

    @property
    def start(self) -> Array:
        """The guesses (n,), which are also what is expected of those known within a tolerance."""
        return np.where(self.log, 0.0, 1.0)

    @property
    def lower(self) -> Array:
        """Lower bounds (n,)."""
        return np.where(self.log, -np.inf, 0.0)

    @property
    def bounded(self) -> tuple[str, ...]:
        """Names of those known within a tolerance."""
        return tuple(n for n, t in zip(self.names, self.tolerance.tolist(), strict=True) if math.isfinite(t))

    def sizes(self, z: Array) -> Array:
        """Values of those sought, in the shape of z."""
        with np.errstate(over="ignore"):
            return self.size * np.where(self.log, np.exp(np.minimum(z, 50.0)), z)

    def values(self, z: Array) -> dict[str, Any]:
        """Every number of the rig at one point (n,), or at many (lanes, n): those sought are arrays then."""
        return {**self.base, **dict(zip(self.names, self.sizes(z).T, strict=True))}

    def slope(self, z: Array) -> Array:
        """Change of the values with z."""
        return np.where(self.log, self.sizes(z), self.size)

    def known(self, z: Array) -> Array:
        """Weighed distance (lanes, rows) from what was known."""
        rows = np.isfinite(self.tolerance)
        return (z[:, rows] - self.start[rows]) / self.tolerance[rows]

    def scattered(self, rng: np.random.Generator, spread: float) -> Array:
        """Another start: every unknown off by a factor, those known by their tolerance."""
        noise = rng.normal(size=self.size.size)
        off = np.where(np.isfinite(self.tolerance), self.tolerance, spread) * noise
        moved = np.where(self.log, self.start + off, self.start * np.exp(off))
        return np.maximum(moved, np.where(self.log, -np.inf, 1e-3 * np.abs(self.start)))


def coordinates(rig: GreyBox, *, magnitude: bool = False) -> Coordinates:
    """Coordinates of a rig's unknowns.

    `magnitude` takes those that the magnitude of a linear model shows, all by their logarithm: no dry friction, no
    delay, nothing that is known within a tolerance.

    Raises
    ------
    BadInput
        When nothing is sought, or a guess is no size.
    """
    dry = nonlinear_friction(rig.plant)
    chosen: list[tuple[Parameter, bool]] = []
    base = {n: p.value for n, p in rig.parameters.items()}
    for name, p in rig.parameters.items():
        if magnitude and name in dry:
            base[name] = 0.0
        if not p.estimate and (p.uncertainty <= 0 or magnitude):
            continue
        if magnitude and (name in dry or name in ("actuator.delay", "actuator.lag")):
            continue
        always = name == "actuator.gain" or (name in rig.plant.names() and rig.plant.quantity(name).open_lower)
        if not (p.value > 0 and math.isfinite(p.value)):
            raise BadInput(f"{name} is sought and needs a guess above 0, got {p.value:g}; give its order of magnitude.")
        chosen.append((p, always or magnitude))
    if not chosen:
        raise BadInput("nothing is sought; name at least one parameter to estimate.")
    return Coordinates(
        names=tuple(p.name for p, _ in chosen),
        size=np.array([p.value for p, _ in chosen]),
        log=np.array([log for _, log in chosen]),
        tolerance=np.array([p.uncertainty / p.value if p.uncertainty > 0 else math.inf for p, _ in chosen]),
        base=base,
    )


def nonlinear_friction(plant: type[Plant]) -> set[str]:
    """Parameters of the friction that a linear model has none of."""
    return {n for j in plant.joints for n in (j.coulomb, j.quadratic, j.stiction, j.stribeck_speed, j.presliding) if n}


def usable(data: FrequencyResponse, *, dry: bool = True) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Frequencies to fit, and sentences about those left out: joints that stick, points drowned in noise."""
    noisy = data.coherence.min(axis=1) < 0.5
    stuck = (data.still.max(axis=1) > STICKS) & dry
    notes: list[str] = []
    for mask, why in ((stuck, "a joint sticks there for part of each period"), (noisy & ~stuck, "it is mostly noise")):
        if mask.any():
            notes.append(f"Left out at {', '.join(f'{w:.3g}' for w in data.omega[mask])} rad/s: {why}.")
    return ~(noisy | stuck), tuple(notes)


def simplex_dB(rig: GreyBox, at: str, data: FrequencyResponse, *, tell: Progress = silent, limit: int = 1500) -> Way:
    """The paper's way: Nelder and Mead on squared dB of the linear model, far output first, then all outputs."""
    from scipy.optimize import minimize

    began = time.perf_counter()
    balance = Balance(plant=rig.plant, at=at, data=data, linear=True)
    space = coordinates(rig, magnitude=True)
    measured = data.magnitude_dB
    stages: list[str] = []

    def squares(z: Array, columns: list[int]) -> float:
        with np.errstate(all="ignore"):
            model = 20 * np.log10(np.abs(balance.response(space.values(z))[0]))
        cost = float(np.sum((model - measured)[:, columns] ** 2))
        return cost if math.isfinite(cost) else 1e300

    def walk(z: Array, columns: list[int]) -> tuple[Array, float]:
        cost = math.inf
        for _ in range(RESTARTS):  # a simplex that has collapsed is spread anew, as long as that helps
            corners = np.vstack([z, z + 0.2 * np.eye(z.size)])
            options = {"initial_simplex": corners, "maxfev": limit, "adaptive": True, "xatol": 1e-3, "fatol": 1e-3}
            solution = minimize(squares, z, args=(columns,), method="Nelder-Mead", options=options)
            z, before, cost = np.asarray(solution.x), cost, float(solution.fun)
            if cost > 0.99 * before - 1e-3:
                break
        return z, cost

    z, every = space.start, list(range(len(data.outputs)))
    cost = math.inf
    for columns in ([every[-1]], every) if len(every) > 1 else (every,):
        z, cost = walk(z, columns)
        names = " and ".join(data.outputs[c] for c in columns)
        stages.append(f"{names}: {cost:.4g} dB², {balance.evaluations[0]} models so far")
        tell(f"simplex on {names}", 1.0)
    if cost > measured.size:  # an error of 1 dB on the whole: the far output alone has led astray
        again, less = walk(space.start, every)
        z = again if less < cost else z
        stages.append(f"all from the guess: {less:.4g} dB², {balance.evaluations[0]} models so far")
    return _way("simplex on dB", balance, space, z, data, began, tuple(stages))


def least_squares(
    rig: GreyBox, at: str, data: FrequencyResponse, *, seed: int = 0, starts: int = 6, tell: Progress = silent,
) -> Squares:  # fmt: skip
    """Complex response, weighed, dry friction at the amplitudes measured; several starts, the best walked to its end.

    Raises
    ------
    NotIdentifiable
        When there are fewer data than unknowns.
    """
    from scipy import optimize

    walk: Any = optimize.least_squares
    began = time.perf_counter()
    balance = Balance(plant=rig.plant, at=at, data=data)
    space = coordinates(rig)
    if 2 * data.response.size <= space.start.size:
        raise NotIdentifiable(
            f"{space.start.size} unknowns need more than {data.response.size} complex points; measure more frequencies."
        )
    sigma = _sigma(data, None, None)

    def residual(z: Array) -> Array:
        return _residuals(balance.response(space.values(z)), data, sigma, z[None], space)[0]

    def jacobian(z: Array) -> Array:
        steps = 1e-5 * np.eye(z.size)
        lanes = np.vstack([z + steps, z - steps])
        both = _residuals(balance.response(space.values(lanes), len(lanes)), data, sigma, lanes, space)
        return (both[: z.size] - both[z.size :]).T / 2e-5

    rng = np.random.default_rng([seed, 71])
    ends: list[tuple[float, Array]] = []
    for i in range(starts):
        z = space.start if i == 0 else space.scattered(rng, SPREAD)
        solution = walk(residual, z, jac=jacobian, bounds=(space.lower, np.inf), x_scale="jac", max_nfev=40)
        ends.append((float(solution.cost), np.asarray(solution.x)))
        tell("least squares, several starts", (i + 1) / starts)
    cost, z = min(ends, key=lambda end: end[0])
    reached = sum(c < 1.02 * cost + 1.0 for c, _ in ends)
    for _ in range(2):  # weights that know how much of the response dry friction takes
        values = space.values(z)
        without = replace(balance, plain_friction=True).response(values)[0]
        sigma = _sigma(data, balance.response(values)[0], without)
        solution = walk(residual, z, jac=jacobian, bounds=(space.lower, np.inf), x_scale="jac", max_nfev=40)
        z = np.asarray(solution.x)
    rows = 2 * data.response.size
    (r, _), (J, prior) = (np.split(x, [rows]) for x in (residual(z), jacobian(z)))
    free = max(1, rows - space.start.size + len(space.bounded))
    misfit = float(r @ r) / free
    P = np.linalg.pinv(J.T @ J / max(1.0, misfit) + prior.T @ prior)
    slope = space.slope(z)
    return Squares(
        way=_way("least squares", balance, space, z, data, began, ()), names=space.names,
        covariance=P * np.outer(slope, slope), misfit=misfit, freedom=free, sigma=sigma,
        surprise=dict(zip(space.bounded, space.known(z[None])[0].tolist(), strict=True)),
        starts=starts, reached=reached,
    )  # fmt: skip


def _residuals(model: Complex, data: FrequencyResponse, sigma: Array, z: Array, space: Coordinates) -> Array:
    """Weighed errors of the logarithm, real parts, imaginary parts and then what was known, shape (lanes, rows)."""
    with np.errstate(all="ignore"):
        off = np.log(model / data.response)
    off = np.where(np.isfinite(off), off, 1e3) / sigma
    lanes = off.shape[0]
    return np.hstack([off.real.reshape(lanes, -1), off.imag.reshape(lanes, -1), space.known(z)])


def _sigma(data: FrequencyResponse, model: Complex | None, without: Complex | None) -> Array:
    """Relative error of real and of imaginary part (F, n)."""
    own = np.hypot(data.error, FLOOR)
    if model is None or without is None:
        return np.hypot(own, 0.01)
    if data.together:  # what stands on lines not asked stands on those asked as well
        own = np.hypot(own, data.distortion)
    return np.hypot(own, FRICTION * np.minimum(np.abs(np.log(model / without)), 1.0))


def _way(
    name: str, balance: Balance, space: Coordinates, z: Array, data: FrequencyResponse, began: float,
    stages: tuple[str, ...],
) -> Way:  # fmt: skip
    values = space.values(z)
    model = balance.response(values)[0]
    squares = float(np.sum((20 * np.log10(np.abs(model)) - data.magnitude_dB) ** 2))
    return Way(name=name, values=values, model=model, squares_dB=squares, evaluations=balance.evaluations[0],
               seconds=time.perf_counter() - began, stages=stages)  # fmt: skip
