"""Gains at work: the sampled law as a computer runs it, the loop's real poles, its margins and its noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.gains.margins import Margins, Response, balanced, of_crossings, phases, root
from upright.gains.requests import conjugate_poles, poles_of
from upright.gains.velocity import Estimator, stationary, without_feedthrough
from upright.laws import Law
from upright.laws.linear import Array
from upright.systems import StateSpace, to_z


def feedback(estimator: Estimator, K: ArrayLike, k_pf: float = 0.0) -> Law:
    """The law ``u = k_pf r - K x`` with x from an estimator; K of shape (m, n) may leave out its last states.

    It takes readings, less their values at the equilibrium as its `target`, and one reference, and is switched on as
    the estimator begins.
    """
    K = np.atleast_2d(np.asarray(K, dtype=np.float64))
    m, n = K.shape
    if n > estimator.C.shape[0] or m != estimator.E.shape[1]:
        wanted = (estimator.E.shape[1], estimator.C.shape[0])
        raise BadInput(f"gains for this estimator need shape {wanted}, got {K.shape}.")
    C, Dy = -K @ estimator.C[:n], -K @ estimator.D[:n]
    A, By = estimator.A + estimator.E @ C, estimator.B + estimator.E @ Dy
    Dr = np.full((m, 1), k_pf)
    return Law(
        A, np.hstack([By, estimator.E @ Dr]), C, np.hstack([Dy, Dr]), begin=estimator.begin, period=estimator.period,
        reference_names=("reference",),
    )  # fmt: skip


def closed(model: StateSpace, law: Law) -> Array:
    """Matrix of the loop, the model's states first."""
    without_feedthrough(model, "a loop")
    B, D = law.B[:, : law.readings], law.D[:, : law.readings]
    top = np.hstack([model.A + model.B @ D @ model.C, model.B @ law.C])
    return np.vstack([top, np.hstack([B @ model.C, law.A])])


def place_sampled(model: StateSpace, estimator: Estimator, poles: ArrayLike) -> Array:
    """Gains on *estimated* states that put as many poles of the sampled loop as there are gains exactly as requested.

    With G(z) from the command to the estimated states, held, late and differenced as they are, z is a pole of the loop
    where ``K G(z) = -1``: one linear equation for K per pole, its derivatives for a pole that repeats. The remaining
    poles (the memories of delay and differences) go where they go; look at `closed`.

    Parameters
    ----------
    model : StateSpace
        With one input.
    poles : array, shape (n,)
        [1/s], mapped to z; n without the commands on their way.

    Returns
    -------
    array, shape (1, n)
    """
    n = model.A.shape[0] - model.remembered
    requested = conjugate_poles(poles, n)
    if model.B.shape[1] != 1:
        raise BadInput(f"sampled placement is for one input, and this model has {model.B.shape[1]}; use place.")
    size = model.A.shape[0]
    total = size + estimator.A.shape[0]
    A = np.zeros((total, total))
    A[:size, :size], A[size:, :size], A[size:, size:] = model.A, estimator.B @ model.C, estimator.A
    B = np.vstack([model.B, estimator.E])[:, 0]
    C = np.hstack([estimator.D @ model.C, estimator.C])[:n]
    rows: list[Array] = []
    wanted: list[float] = []
    earlier: list[complex] = []
    try:
        for z in to_z(requested, model.period).tolist():
            if z.imag < 0:
                continue
            order = sum(abs(z - other) < 1e-9 for other in earlier)
            earlier.append(z)
            column = B.astype(np.complex128)
            for _ in range(order + 1):
                column = np.linalg.solve(z * np.eye(A.shape[0]) - A, column)
            value = C @ column
            target = -1.0 if order == 0 else 0.0
            for part, goal in ((value.real, target), (value.imag, 0.0))[: 2 if z.imag else 1]:
                rows.append(part)
                wanted.append(goal)
        matrix, goals = np.array(rows), np.array(wanted)
        size_of = np.abs(matrix).max(axis=1, keepdims=True)
        K = np.linalg.solve(matrix / size_of, goals / size_of[:, 0])
    except np.linalg.LinAlgError:
        raise BadInput("no gains put the sampled loop's poles there: a mode is out of reach, or a pole is to be where "
                       "the model has one already; ask for others.") from None  # fmt: skip
    return K[None]


def response(model: StateSpace, law: Law) -> Response:
    """The loop cut at the plant's one input, negative feedback: what a unit command comes back as, times -1.

    Raises
    ------
    BadInput
        When there are several inputs.
    """
    if model.B.shape[1] != 1:
        raise BadInput(f"margins are for one input, and this model has {model.B.shape[1]}; close all loops but one.")
    B, D = law.B[:, : law.readings], law.D[:, : law.readings]
    A = np.block([[model.A, np.zeros((model.A.shape[0], law.A.shape[0]))], [B @ model.C, law.A]])
    return balanced(A, np.vstack([model.B, np.zeros((law.A.shape[0], 1))]), -np.hstack([D @ model.C, law.C]))


def margins(model: StateSpace, law: Law) -> Margins:
    """Margins of a stable sampled loop, from every crossing of the unit circle and of the real axis.

    Parameters
    ----------
    model : StateSpace
        Sampled; of one known at its samples alone the delay margin is its phase over its frequency.

    Raises
    ------
    BadInput
        When the loop is not stable.
    """
    if not _stable(closed(model, law)):
        raise BadInput("the sampled loop is not stable, so it has no margins; ask for slower poles or sample faster.")
    L = response(model, law)
    late = _turned(L) if model.continuous is None else _delay(model.continuous, model, law)
    return of_crossings(L, lambda angles: angles / model.period, late * model.period)


def _turned(L: Response) -> float:
    """Delay [samples] that turns the loop gain through -180 degrees where it is 1."""
    w, phase = phases(L)
    return float((np.mod(phase, 2 * np.pi) / w).min(initial=np.inf))


def _delay(plant: StateSpace, model: StateSpace, law: Law) -> float:
    """Further delay [samples] at which the loop falls.

    Below a sample, by its eigenvalues. Beyond: whole samples turn the loop gain and leave its size, so a loop that is
    already `part` of a sample late falls where its turned phase reaches -180 degrees; that sum hardly varies with part.
    """

    def late(more: float) -> StateSpace:
        return plant.to_sampled(model.period, model.delay + more, model.lag)

    def stands(more: float) -> bool:
        return _stable(closed(late(more), law))

    def falls(part: float) -> float:
        return part + _turned(response(late(part), law))

    parts = np.arange(8) / 8
    # a sample more turns L(-1) into its negative, through -1 if it is larger than 1
    if abs(response(model, law).at(np.array([np.pi]))[0]) >= 1 or not all(map(stands, [*parts.tolist(), 1.0])):
        return _edge(stands, np.linspace(0, 1, 65))
    sums = np.array([falls(part) for part in parts.tolist()])
    if not np.isfinite(sums).all():  # the loop gain is 1 at some parts of a sample only, if at all
        return float(sums.min())
    steps = np.arange(np.floor(8 * sums.min()), np.ceil(8 * sums.max()) + 2) / 8
    i = int(np.argmax(sums[np.mod(np.rint(8 * steps), 8).astype(int)] <= steps))
    if i == 0:
        return float(steps[0])
    return root(lambda delay: falls(delay % 1.0) - delay, float(steps[i - 1]), float(steps[i]))


def swing(model: StateSpace, law: Law, start: ArrayLike, samples: int) -> tuple[Array, Array]:
    """States (samples, n) and commands (samples, m) of the sampled loop, let go at rest in the law's eyes.

    Parameters
    ----------
    start : array, shape (n,)
        Deviation of the model's states; drive and commands on their way are at zero.
    """
    A, n = closed(model, law), model.A.shape[0]
    out = np.hstack([law.D[:, : law.readings] @ model.C, law.C])
    state = np.zeros(A.shape[0])
    state[: n - model.remembered] = start
    if law.begin is not None:
        state[n:] = law.begin @ (model.C @ state[:n])
    rows = np.empty((samples, A.shape[0]))
    for k in range(samples):
        rows[k] = state
        state = A @ state
    return rows[:, :n], rows @ out.T


def command_noise(model: StateSpace, law: Law, resolution: ArrayLike) -> float:
    """Standard deviation of the command in the closed loop from the rounding of the encoders [the input's unit]."""
    B, D = law.B[:, : law.readings], law.D[:, : law.readings]
    sigma = np.broadcast_to(np.asarray(resolution, dtype=np.float64) / np.sqrt(12), (law.readings,))
    inlet = np.vstack([model.B @ D, B]) * sigma
    outlet = np.hstack([D @ model.C, law.C])
    spread = stationary(closed(model, law), inlet)
    direct = D * sigma
    return float(np.sqrt((outlet @ spread @ outlet.T + direct @ direct.T)[0, 0]))


def _stable(A: Array) -> bool:
    return bool(np.abs(poles_of(A)).max(initial=0.0) < 1)


def _edge(holds: Callable[[float], bool], steps: Array) -> float:
    """First of the steps, refined by halving, at which a statement that holds at the first no longer does."""
    for good, bad in zip(steps[:-1].tolist(), steps[1:].tolist(), strict=True):
        if not holds(bad):
            for _ in range(40):
                middle = (good + bad) / 2
                good, bad = (middle, bad) if holds(middle) else (good, middle)
            return good
    return float(steps[-1])
