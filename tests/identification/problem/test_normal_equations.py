"""Sums of squares in blocks, lanes and combinations, beside plain products of matrices."""

from __future__ import annotations

import numpy as np
import pytest

from upright.identification.problem.normal_equations import Normal, products, pseudo_inverse, squares

CHANCE = np.random.default_rng(8)


COLUMNS = (0, 2)
"""Of four rows, those that two sensors show."""


def lanes(samples: int, count: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Four rows of so many lanes, two outputs' targets, offsets and gains of the sensors."""
    return (
        CHANCE.normal(size=(samples, 4, count)), CHANCE.normal(size=(samples, 2)),
        CHANCE.normal(size=(2, count)), 1 + 0.1 * CHANCE.normal(size=(2, count)),
    )  # fmt: skip


def expected(simulated: list[np.ndarray], target: np.ndarray) -> np.ndarray:
    """``B'B`` with the first lane's error and the others' differences from it as columns, all outputs."""
    z = np.concatenate(simulated)
    B = np.column_stack([z[:, 0] - target.T.reshape(-1), *(z[:, 1:] - z[:, :1]).T])
    return B.T @ B


@pytest.mark.parametrize("samples", [5, 1024, 1025, 2300])
@pytest.mark.parametrize("scaled", [True, False])
@pytest.mark.parametrize("count", [1, 3, 16, 17])
def test_squares_are_those_of_errors_and_differences_whatever_the_blocks(
    samples: int, scaled: bool, count: int
) -> None:
    z, y, offset, scale = lanes(samples, count)
    weights, both = np.array([2.0, 0.5]), z[:, COLUMNS].swapaxes(0, 1)
    shown = [w * ((s if scaled else 1.0) * a + o) for w, s, a, o in zip(weights, scale, both, offset, strict=True)]
    found = squares(z, COLUMNS, y, offset, np.diag(weights), scale if scaled else None)
    assert np.allclose(found, expected(shown, y * weights), rtol=1e-12, atol=1e-12 * samples)
    held = squares(z, COLUMNS, y, offset, np.diag([0.0, 0.5]), scale if scaled else None)
    assert np.allclose(held, expected(shown[1:], 0.5 * y[:, 1:]), rtol=1e-12, atol=1e-12 * samples)


def test_samples_that_do_not_count_are_as_if_they_were_not_there() -> None:
    z, y, offset, _ = lanes(200)
    kept = np.flatnonzero(CHANCE.random(200) < 0.4)
    z[kept[0] + 1 : kept[1]] = np.nan
    found = squares(z, COLUMNS, y, offset, np.eye(2), kept=kept)
    assert np.allclose(found, squares(z[kept], COLUMNS, y[kept], offset, np.eye(2)), rtol=1e-12)


@pytest.mark.parametrize("scaled", [True, False])
def test_combinations_of_outputs_are_squared_as_such(scaled: bool) -> None:
    z, y, offset, scale = lanes(50)
    W, both = np.array([[1.0, -1.0], [0.3, 2.0]]), z[:, COLUMNS].swapaxes(0, 1)
    shown = [(s if scaled else 1.0) * a + o for s, a, o in zip(scale, both, offset, strict=True)]
    together = [W[k, 0] * shown[0] + W[k, 1] * shown[1] for k in range(2)]
    found = squares(z, COLUMNS, y, offset, W, scale if scaled else None)
    assert np.allclose(found, expected(together, y @ W.T))


def test_a_lane_that_ran_away_makes_every_square_infinite_unless_its_output_has_no_weight() -> None:
    z, y, offset, _ = lanes(20)
    z[7, COLUMNS[1], 2] = 1e200
    assert np.all(np.isinf(squares(z, COLUMNS, y, offset, np.eye(2))))
    assert np.all(np.isfinite(squares(z, COLUMNS, y, offset, np.diag([1.0, 0.0]))))


@pytest.mark.parametrize("rows", [1, 63, 64, 65, 4000])
@pytest.mark.parametrize("columns", [1, 6, 60])
def test_products_are_those_of_the_whole(rows: int, columns: int) -> None:
    J, r = CHANCE.normal(size=(rows, columns)), CHANCE.normal(size=rows)
    A, g, cost = products(J, r)
    assert np.allclose(A, J.T @ J)
    assert np.allclose(g, J.T @ r)
    assert cost == pytest.approx(r @ r)


def test_products_that_ran_away_are_infinite() -> None:
    J = np.full((70, 2), 1e200)
    A, g, cost = products(J, np.zeros(70))
    assert np.all(np.isinf(A))
    assert np.all(np.isinf(g))
    assert cost == np.inf


def test_an_inverse_sees_what_the_matrix_sees() -> None:
    """Whatever the units: a regular one is inverted, of two numbers that act alike only their sum is known."""
    J, units = CHANCE.normal(size=(30, 3)), np.array([1e-6, 1.0, 1e5])
    found = pseudo_inverse((J * units).T @ (J * units)) * np.outer(units, units)
    assert np.allclose(found, np.linalg.inv(J.T @ J))
    alike = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 4.0]])
    assert np.allclose(pseudo_inverse(alike), [[0.25, 0.25, 0.0], [0.25, 0.25, 0.0], [0.0, 0.0, 0.25]])
    assert np.allclose(pseudo_inverse(np.diag([4.0, 0.0])), np.diag([0.25, 0.0]))
    assert pseudo_inverse(np.zeros((0, 0))).shape == (0, 0)
    # singular values of the scaled Jacobian: a millionth of the largest is seen no more
    for share, seen in ((2e-6, True), (0.5e-6, False)):
        turn = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
        found = pseudo_inverse(turn @ np.diag([1.0, share**2]) @ turn)
        assert (found.max() > 1e9) == seen


@pytest.mark.parametrize("central", [False, True])
def test_differences_have_the_error_of_their_order(central: bool) -> None:
    """Of (x^2, x y): forward steps err by the step in the square, central ones not at all."""
    steps = np.array([0.01, 0.02])
    found = Normal.by_differences(
        lambda x: np.array([x[0] ** 2, x[0] * x[1]]), np.array([2.0, 3.0]), steps, central=central
    )
    J = np.array([[4.0 if central else 4.01, 0.0], [3.0, 2.0]])
    r = np.array([4.0, 6.0])
    assert found.cost == pytest.approx(52.0)
    assert found.matrix == pytest.approx(J.T @ J)
    assert found.gradient == pytest.approx(J.T @ r)


@pytest.mark.parametrize("wild", [np.nan, np.inf, 1e200])
def test_where_the_model_is_not_finite_the_cost_is_infinite(wild: float) -> None:
    for at in (2.0, 2.01):  # here, or one step on
        found = Normal.by_differences(
            lambda x, at=at: np.array([wild if x[0] == at else 1.0]), np.array([2.0]), np.array([0.01])
        )
        assert found.cost == np.inf
        assert np.array_equal(found.matrix, np.zeros((1, 1)))
        assert np.array_equal(found.gradient, np.zeros(1))
