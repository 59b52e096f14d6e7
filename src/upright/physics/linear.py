"""What does a plant look like close to rest?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import ImpossiblePhysics, NotIdentifiable
from upright.physics.plant import Plant, evaluate

if TYPE_CHECKING:
    from upright.physics.derived import Derived

Matrix = NDArray[np.float64]
Roots = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class Linear:
    """State space ``x' = A x + B u, y = C x`` about `point`, states in the paper's order.

    `mass` is the mass matrix at that point; `outputs` are the coordinates.
    """

    A: Matrix
    B: Matrix
    C: Matrix
    mass: Matrix
    point: dict[str, float]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def D(self) -> Matrix:
        """Direct feedthrough, zero for a mechanical system with measured positions."""
        return np.zeros((self.C.shape[0], self.B.shape[1]))

    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of A [1/s], the fastest growing first."""
        poles = np.linalg.eigvals(self.A).astype(np.complex128)
        return poles[np.lexsort((poles.imag, -poles.real))]

    def response(self, omega: Any) -> NDArray[np.complex128]:
        """Frequency response, shape (len(omega), outputs, inputs), at angular frequencies `omega` [rad/s]."""
        s = 1j * np.atleast_1d(np.asarray(omega, dtype=np.float64))
        n = self.A.shape[0]
        return self.C @ np.linalg.solve(s[:, None, None] * np.eye(n) - self.A, self.B[None].astype(np.complex128))

    def to_control(self) -> Any:
        """The same model as a `control.StateSpace` with named signals."""
        import control

        return control.StateSpace(
            self.A,
            self.B,
            self.C,
            self.D,
            states=list(self.states),
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )

    def transfer_functions(self) -> dict[tuple[str, str], tuple[Matrix, Matrix]]:
        """Numerator and denominator, highest power first, by (output, input); zeros and poles that meet are cancelled.

        They count as met when they are closer than 1e-6 of the fastest pole.
        """
        poles = self.poles()
        near = 1e-6 * np.abs(poles).max(initial=0.0)
        out: dict[tuple[str, str], tuple[Matrix, Matrix]] = {}
        for i, y in enumerate(self.outputs):
            for j, u in enumerate(self.inputs):
                # det(sI - A + b c) = det(sI - A) + c adj(sI - A) b
                num = np.poly(self.A - np.outer(self.B[:, j], self.C[i])).real - np.poly(self.A).real
                num[np.abs(num) < 1e-12 * np.abs(num).max(initial=0.0)] = 0.0
                num = np.trim_zeros(num, "f") if num.any() else np.zeros(1)
                zeros, left = _cancel(np.roots(num).astype(np.complex128), poles, near)
                out[y, u] = num[0] * _polynomial(zeros, near), _polynomial(left, near)
        return out


def _cancel(zeros: Roots, poles: Roots, near: float) -> tuple[Roots, Roots]:
    """Zeros and poles without the pairs that lie closer than `near`."""
    kept: list[complex] = []
    left = list(poles)
    for zero in zeros:
        distance = [abs(zero - p) for p in left]
        if distance and min(distance) <= near:
            left.pop(int(np.argmin(distance)))
        else:
            kept.append(complex(zero))
    return np.array(kept, dtype=np.complex128), np.array(left, dtype=np.complex128)


def _polynomial(roots: Roots, near: float) -> Matrix:
    """Monic polynomial with these roots; those closer to 0 than `near` are taken as 0."""
    return np.atleast_1d(np.poly(np.where(np.abs(roots) <= near, 0.0, roots))).real.astype(np.float64)


def linearize(plant: Plant, at: str | None = None) -> Linear:
    """Linear model about a named equilibrium; with the rig out of level, about the equilibrium nearest to it.

    Raises
    ------
    NotIdentifiable
        When the named point is no equilibrium and none is found near it.
    ImpossiblePhysics
        When the mass matrix there is not positive definite.
    """
    derived = plant.derived_for(plant.parameters())
    point = _rest(plant, derived, plant.equilibrium(at))
    scope = {**plant.parameters(), **point}
    n, m = len(derived.coordinates), len(derived.inputs)
    mass = _mass(derived, scope)
    if np.linalg.eigvalsh(mass).min() <= 0:
        raise ImpossiblePhysics(
            f"{type(plant).__name__} needs a positive definite mass matrix, got {mass.tolist()}; check its inertias."
        )
    solve = np.linalg.solve(
        mass,
        np.hstack(
            [
                -_matrix(derived.stiffness, scope, n, n),
                -_matrix(derived.damping, scope, n, n),
                _matrix(derived.gain, scope, n, m),
            ]
        ),
    )
    A, B, C = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, m)), np.zeros((n, 2 * n))
    for i in range(n):
        A[2 * i, 2 * i + 1] = 1.0
        C[i, 2 * i] = 1.0
        A[2 * i + 1, 0::2] = solve[i, :n]
        A[2 * i + 1, 1::2] = solve[i, n : 2 * n]
        B[2 * i + 1] = solve[i, 2 * n :]
    return Linear(
        A=A,
        B=B,
        C=C,
        mass=mass,
        point=point,
        states=plant.state_names(),
        inputs=derived.inputs,
        outputs=derived.coordinates,
    )


def _matrix(entries: tuple[str, ...], scope: dict[str, float], rows: int, columns: int) -> Matrix:
    return np.array([float(evaluate(e, scope)) for e in entries], dtype=np.float64).reshape(rows, columns)


def _motion(derived: Derived, scope: Mapping[str, Any]) -> tuple[Matrix, Matrix]:
    """Mass matrix and force vector at one point."""
    scope = resolved(derived, scope)
    n = len(derived.coordinates)
    M = np.zeros((n, n))
    M[np.triu_indices(n)] = [float(evaluate(e, scope)) for e in derived.mass]
    return M + np.triu(M, 1).T, np.array([float(evaluate(e, scope)) for e in derived.force])


def resolved(derived: Derived, scope: Mapping[str, Any]) -> dict[str, Any]:
    """The scope with the intermediate results in it."""
    scope = dict(scope)
    for i, lump in enumerate(derived.lumps):
        scope[f"k{i}"] = evaluate(lump, scope)
    for s, c, argument in derived.trig:
        a = evaluate(argument, scope)
        scope[s], scope[c] = np.sin(a), np.cos(a)
    for name, step in derived.steps:
        scope[name] = evaluate(step, scope)
    return scope


def small_motions(derived: Derived, values: Mapping[str, Any], lanes: int) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Matrices of ``M a + D v + K q = G u`` about a point at rest, for many sets of numbers.

    Parameters
    ----------
    derived : Derived
        Equations of the plant.
    values : mapping
        Parameters and the coordinates of the point by name, each a number or an array (lanes,).
    lanes : int
        Number of sets.

    Returns
    -------
    tuple of arrays
        M, D and K (lanes, n, n) and G (lanes, n, inputs).
    """
    n, m = len(derived.coordinates), len(derived.inputs)
    still = {**{f"{c}_dot": 0.0 for c in derived.coordinates}, **dict.fromkeys(derived.inputs, 0.0)}
    scope = resolved(derived, {**still, **values})

    def matrix(entries: tuple[str, ...], columns: int) -> Matrix:
        rows = [np.broadcast_to(evaluate(e, scope), (lanes,)) for e in entries]
        return np.array(rows, dtype=np.float64).reshape(n, columns, lanes).transpose(2, 0, 1).copy()

    M = np.zeros((lanes, n, n))
    i, j = np.triu_indices(n)
    M[:, i, j] = np.array([np.broadcast_to(evaluate(e, scope), (lanes,)) for e in derived.mass]).T
    M[:, j, i] = M[:, i, j]
    return M, matrix(derived.damping, n), matrix(derived.stiffness, n), matrix(derived.gain, m)


def _mass(derived: Derived, scope: dict[str, float]) -> Matrix:
    still = {**{f"{c}_dot": 0.0 for c in derived.coordinates}, **dict.fromkeys(derived.inputs, 0.0)}
    return _motion(derived, {**still, **scope})[0]


def _rest(plant: Plant, derived: Derived, point: dict[str, float]) -> dict[str, float]:
    """Nearest true equilibrium to a nominal one; a coordinate that floats there is also tried from either side."""
    aside = [{**point, name: value + d} for name, value in point.items() for d in (0.5, -0.5)]
    for start in (point, *aside):
        found = _newton(plant, derived, start)
        if found is not None:
            return found
    raise NotIdentifiable(
        f"{type(plant).__name__} has no equilibrium near {point}; level the rig or anchor the free coordinate."
    )


def _newton(plant: Plant, derived: Derived, point: dict[str, float]) -> dict[str, float] | None:
    """Newton's steps, none longer than 0.3, to where no force is left."""
    still = {**{f"{c}_dot": 0.0 for c in derived.coordinates}, **dict.fromkeys(derived.inputs, 0.0)}
    n = len(point)
    for _ in range(50):
        scope = {**plant.parameters(), **still, **point}
        force = _motion(derived, scope)[1]
        stiffness = _matrix(derived.stiffness, scope, n, n)
        scale = np.abs(stiffness).max(axis=1, initial=0.0)
        if np.all(np.abs(force) <= 1e-12 * scale):
            return point
        even = 1 / np.sqrt(np.where(scale > 0, scale, 1.0))  # a stiff anchor must not hide a soft pendulum
        step = even * np.linalg.lstsq(stiffness * even[:, None] * even, force * even, rcond=1e-9)[0]
        step *= min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-300))
        point = {name: value + float(d) for (name, value), d in zip(point.items(), step, strict=True)}
    return None
