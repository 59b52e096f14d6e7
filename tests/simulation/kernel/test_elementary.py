"""Are the kernel's own elementary functions right to a few units in the last place, wherever they are asked?"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from tests.simulation.lowering.machine_code import compiled
from upright.laws.rule import KNOWN
from upright.physics.equations import FUNCTIONS
from upright.simulation.kernel.elementary import ALWAYS, NAMES, definitions

ULP = 3.0
"""Units in the last place; the quotient of a sine and a cosine is the worst."""

HUGE = np.log(np.finfo(float).max)
RANGES = {
    "sin": (1e-20, 1e6), "cos": (1e-20, 1e6), "tan": (1e-20, 1e3), "exp": (1e-20, HUGE), "log": (1e-307, 1e308),
    "sinh": (1e-20, HUGE), "cosh": (1e-20, HUGE), "tanh": (1e-20, 40.0), "atan": (1e-20, 1e20), "asin": (1e-20, 1.0),
    "acos": (1e-20, 1.0),
}  # fmt: skip
EDGES = {
    "log": [1.0, 5e-324, 1e-310, 0.7071067811865476, 0.7071067811865475, 1.0 + 2**-52, 1.0 - 2**-53],
    "exp": [-745.0, -708.5, 0.0], "atan": [0.66, 2.414213562373095, 0.0], "asin": [1.0, -1.0, 0.0, 1.0 - 2**-53],
    "acos": [-1.0, 0.0, 1.0 - 2**-53, -1.0 + 2**-53], "tanh": [0.625, 0.0], "sinh": [1.0, 0.0],
}  # fmt: skip


def value(name, lanes, x, y=None):
    """A function of the text at each x, so many lanes at a time."""
    given = [np.concatenate([a, np.full(-len(x) % 16, a[0])]) for a in ([x] if y is None else [x, y])]
    out = np.empty_like(given[0])
    names = ["X", "Y"][: len(given)]
    text = f"""{ALWAYS}
{definitions(f"{name}(")}
@entry
def entered({", ".join(names)}, OUT, n):
    for k in range(n):
        for _i in range(16):
            OUT[16 * k + _i] = {name}({", ".join(f"{a}[16 * k + _i]" for a in names)})
"""
    compiled(text, lanes=lanes)(*given, out, len(out) // 16)
    return out[: len(x)]


def sample(name):
    low, high = RANGES[name]
    rng = np.random.default_rng(7)
    wide = np.exp(rng.uniform(np.log(low), np.log(high), 300))
    near = rng.uniform(min(1e-3, high), min(high, 4.0), 300)
    x = np.concatenate([wide, near, rng.uniform(0.0, high, 300)])
    both = 1.0 if name == "log" else rng.choice([-1.0, 1.0], x.size)
    return np.concatenate([both * x, EDGES.get(name, [])])


def units(found, exact):
    """Error in units in the last place of the exact value."""
    return float(abs(mpmath.mpf(float(found)) - exact) / mpmath.mpf(float(np.spacing(abs(float(exact))))))


@pytest.mark.parametrize("lanes", [1, 4, 16])
@pytest.mark.parametrize("name", RANGES)
def test_of_one_argument(name, lanes):
    x = sample(name)
    with mpmath.workprec(160):
        exact = [getattr(mpmath, name)(mpmath.mpf(float(a))) for a in x]
        errors = [units(f, e) for f, e in zip(value(name, lanes, x), exact, strict=True)]
    assert max(errors) < ULP, x[int(np.argmax(errors))]


@pytest.mark.parametrize("lanes", [1, 16])
def test_the_angle_of_a_point(lanes):
    rng = np.random.default_rng(2)
    x, y = (rng.choice([-1.0, 1.0], 400) * np.exp(rng.uniform(-9.0, 9.0, 400)) for _ in range(2))
    x[:8], y[:8] = [0, 0, 1, -1, 2, -2, 2, -2], [1, -1, 0, 0, 2, 2, -2, -2]
    with mpmath.workprec(160):
        exact = [mpmath.atan2(mpmath.mpf(float(b)), mpmath.mpf(float(a))) for a, b in zip(x, y, strict=True)]
        errors = [units(f, e) for f, e in zip(value("atan2", lanes, y, x), exact, strict=True)]
    assert max(errors) < ULP


def test_nothing_is_left_out():
    assert {*RANGES, "atan2"} == NAMES
    assert NAMES | {"sqrt", "floor", "pi"} == KNOWN
    assert NAMES | {"sqrt", "abs", "pi"} == {*FUNCTIONS}


@pytest.mark.parametrize("lanes", [1, 16])
def test_at_the_ends_and_outside(lanes):
    """As IEEE 754 has it, which NumPy follows; what is undefined stays visible as NaN."""
    inf, nan = math.inf, math.nan
    x = np.array([0.0, -0.0, inf, -inf, nan, -1.0, 2.0, -2.0, 800.0, -800.0])
    for name in sorted(NAMES - {"atan2", "sin", "cos", "tan"}):
        numpy = getattr(np, {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}.get(name, name))
        with np.errstate(all="ignore"):
            assert value(name, lanes, x) == pytest.approx(numpy(x), rel=1e-15, abs=0.0, nan_ok=True), name
    assert np.isnan(value("atan2", lanes, np.array([nan, 1.0]), np.array([1.0, nan]))).all()
    assert value("atan2", lanes, np.zeros(2), np.array([0.0, -1.0])).tolist() == [0.0, math.pi]


def test_a_text_brings_what_it_calls_and_no_more():
    assert definitions("k0*x - w1*(x + 2)") == ""
    assert [line.split("(")[0] for line in definitions("asin(x) + 2").splitlines() if line[:4] == "def "] == [
        "def atan", "def asin",
    ]  # fmt: skip
