"""Does the text mean in machine code what it means in Python?"""

from __future__ import annotations

import inspect
import math
import textwrap
from functools import cache
from math import cos, exp, floor, ldexp, sin, sqrt, tan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.simulation.kernel.interpreter import functions
from tests.simulation.lowering.machine_code import compiled

FLOATS = st.floats(-1e6, 1e6, allow_subnormal=False)  # a // b is floor(a / b), another thing where a / b underflows
INTS = st.integers(-(10**6), 10**6)


def text(function):
    """A function's text as the entry of a module."""
    return "@entry\n" + textwrap.dedent(inspect.getsource(function)).replace(function.__name__, "entered", 1)


machine_code = cache(compiled)


def both(function, size, *args):
    """What a function writes into its first argument: by machine code, and by Python."""
    out = np.full((2, size), 99.0)
    machine_code(text(function))(out[0], *args)
    with np.errstate(all="ignore"):
        functions(text(function))["entered"](out[1], *args)
    return out


def arithmetic(OUT, a, b, n, m):
    OUT[0] = a + b * 2 - n / 4.0
    OUT[1] = a // 3.0
    OUT[2] = a % 7.0
    OUT[3] = n // 7 + n % 7
    OUT[4] = n // -3 + n % -3
    OUT[5] = (n & 12) | (m ^ 5)
    OUT[6] = -(a**2) + abs(b) + abs(n)
    OUT[7] = min(a, b, 3) + max(a, b)
    OUT[8] = 1.0 if a < b <= 1e5 else (2 if not n > m else -n)
    OUT[9] = float(n) + int(a) + round(b)
    OUT[10] = (a > b and n > m) or b == 0.0
    OUT[11] = floor(a) + (+n) + (n << 2) + (n >> 1)
    OUT[12] = ldexp(a, 3)
    OUT[13] = n // (m * m + 1) + n % (m * m + 1) + n // -(m * m + 1)
    OUT[14] = sin(a) + cos(b) + sqrt(abs(a)) + exp(-abs(b)) + tan(a)
    OUT[15] = (n > 0) + 2 * True
    OUT[16] = n**3 + abs(a) ** 0.5
    OUT[17] = ldexp(a, int(b * 1e-3))


@settings(max_examples=40, deadline=None)
@given(FLOATS, FLOATS, INTS, INTS)
def test_arithmetic(a, b, n, m):
    x, y = both(arithmetic, 18, float(a), float(b), n, m)
    close = np.isclose(x, y, rtol=1e-14, atol=0.0)
    # terms of both signs may cancel (a = 30, b = 0); each is right to its own last bits
    close[14] |= abs(x[14] - y[14]) <= 1e-14 * (3 + np.sqrt(abs(a)) + abs(np.tan(a)))
    assert close.all(), np.flatnonzero(~close)


def branches(OUT, n, x):
    k = 0
    for i in range(n):
        if i == 2:
            continue
        if i > 5:
            break
        k += i
    OUT[0] = k
    total = 0
    for i in range(n, -3, -2):
        total = total + i * 0.5
    OUT[1] = total
    while x > 1.0:
        x = x / 2
        if x < 1.5 and n > 3:
            break
    else_ = 0.0
    OUT[2] = x
    for item in (1, 2.5, x):
        if item > 2.0:
            else_ += item
            break
    OUT[3] = else_
    pair = (n, x) if n > 2 else (0.5, n)
    a, (b, c) = pair[0], (pair[1], len(pair) + pair[-1])
    OUT[4] = a + b * c
    OUT[5] = 0.0
    for i in range(2, 4):
        for j in range(i):
            OUT[5] += i * j


@pytest.mark.parametrize("n", [0, 1, 3, 4, 9])
@pytest.mark.parametrize("x", [0.3, 5.0, 77.7])
def test_branches_loops_and_tuples(n, x):
    ours, python = both(branches, 6, n, x)
    assert ours.tolist() == python.tolist()


FUNCTIONS = '''
@scalar
def fact(n):
    out = 1.0
    for k in range(1, n + 1):
        out *= k
    return out


@inline
def pair(a, b):
    """A tuple and a number."""
    return (a, b, a * b), fact(3)


@entry
def entered(OUT, a, b):
    (x, y, z), f = pair(a, b)
    OUT[0], OUT[1] = x + y, z * f
    OUT[2] = fact(5)
'''


def test_functions_call_each_other_and_return_tuples():
    out = np.zeros(3)
    compiled(FUNCTIONS)(out, 2.0, 5)
    assert out.tolist() == [7.0, 60.0, 120.0]


LANES = """
@entry
def entered(W, OUT, P, n):
    _over = 0.0
    for _i in range(16):
        _x = W[_i] * 2.0 if W[_i] > 3.0 else 0.0 - W[_i]
        _m = min(max(_i - n, 0), 4)
        if not (_x < 20.0):
            W[16 + _i] = nan
            _x = 1.0
        else:
            W[16 + _i] = P[_m, 1] + _i
        OUT[1, _i] = _x
        _over += _x
    OUT[0, 0] = _over
    for _i in range(16):
        if W[_i] > 11.0:
            break
        OUT[0, 1 + _i] = _i
"""


@pytest.mark.parametrize("lanes", [2, 4, 8, 16])
def test_a_loop_over_lanes_gives_every_lane_its_own(lanes):
    table = np.arange(10.0).reshape(5, 2)
    results = []
    for run in (compiled(LANES, lanes=lanes), functions(LANES)["entered"]):
        raw = np.zeros(40)
        first = (-raw.ctypes.data // 8) % 8
        W, out = raw[first : first + 32], np.zeros((2, 16))
        W[:16] = np.arange(16.0)
        run(W, out, table, 3)
        results.append((W.copy(), out))
    (W, out), (W_by_hand, by_hand) = results
    assert np.array_equal(W, W_by_hand, equal_nan=True)
    assert np.isnan(W[16:]).any()
    assert np.array_equal(out, by_hand)


SUMS = """
@entry
def entered(W, OUT):
    _some = 0.0
    _less = 100.0
    _all = 0.0
    for _i in range(16):
        if W[_i] > 3.0:
            _some += W[_i]
        _less -= W[_i]
        _all += 2.0 * W[_i]
    OUT[0], OUT[1], OUT[2] = _some, _less, _all
"""


@pytest.mark.parametrize("lanes", [1, 2, 4, 8])
def test_what_lanes_add_up_to_counts_those_that_the_condition_lets_in(lanes):
    """Of 0 to 15: all above 3 are 114, all of them 120."""
    raw = np.zeros(40)
    first = (-raw.ctypes.data // 8) % 8
    W, out = raw[first : first + 16], np.zeros(3)
    W[:] = np.arange(16.0)
    compiled(SUMS, lanes=lanes)(W, out)
    assert out.tolist() == [114.0, -20.0, 240.0]


def test_whole_numbers_divide_by_zero_without_stopping_the_process():
    def divided(OUT, n, m):
        OUT[0] = n // m
        OUT[1] = n % m
        OUT[2] = n / m

    out = np.full(3, 9.0)
    compiled(text(divided))(out, 5, 0)
    assert out.tolist() == [0.0, 0.0, math.inf]
    compiled(text(divided))(out, -(2**63), -1)  # no 64 bits hold it: it wraps
    assert out[:2].tolist() == [-(2.0**63), 0.0]
