"""Is a drive stated as arithmetic computed as written, and is nothing but arithmetic obeyed?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upright.errors import BadInput
from upright.study.expressions import evaluate

T = np.linspace(0.0, 2.0, 201)
Z = 0.1 * np.sin(3 * T)
COLUMNS = {"z": Z, "/joint0/position": 2 * Z}


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("2.5*(0.2 - z)", 2.5 * (0.2 - Z)),
        ("z", Z),
        ("/joint0/position", 2 * Z),
        ("`/joint0/position` / 2 - z", 0 * Z),
        ("where(t < 1, 0, 0.5)", np.where(T < 1, 0, 0.5)),
        ("0.5 if 0.5 <= t < 1 and not z < 0 else -0.5", np.where((T >= 0.5) & (T < 1) & (Z >= 0), 0.5, -0.5)),
        ("4 if mod(t, 2) < 1 or t > 1.5 else -4", np.where((T % 2 < 1) | (T > 1.5), 4.0, -4.0)),
        ("clip(10*z, -0.5, 0.5)", np.clip(10 * Z, -0.5, 0.5)),
        ("sin(2*pi*t)**2 + cos(2*pi*t)**2", np.ones_like(T)),
        ("max(z, 0) + min(z, 0)", Z),
        ("sign(z)*abs(z) - +z", 0 * Z),
        ("3", np.full_like(T, 3.0)),
    ],
)
def test_an_expression_means_what_it_says(expression, expected):
    np.testing.assert_allclose(evaluate(expression, COLUMNS, T), expected, atol=1e-15)


@given(a=st.floats(-9, 9), b=st.floats(-9, 9))
def test_numbers_written_into_an_expression_arrive_unchanged(a, b):
    np.testing.assert_array_equal(evaluate(f"{a!r}*z + {b!r}", COLUMNS, T), a * Z + b)


@pytest.mark.parametrize(
    ("expression", "says"),
    [
        ("2.5*(0.2 - zz)", "did you mean 'z'?"),
        ("2.5*(0.2 - z", "neither a column nor arithmetic"),
        ("sine(t)", "did you mean 'sin'?"),
        ("sin(t, 2)", "takes 1 values, got 2"),
        ("1/z", "not finite at t = 0 s"),
        ("`/joint1/position`", "did you mean '/joint0/position'?"),
        ("", "neither a column nor arithmetic"),
        ("z[0]", "no arithmetic on columns"),
        ("z.tofile('x')", "no arithmetic on columns"),
        ("__import__('os').system('true')", "no arithmetic on columns"),
        ("(lambda: 1)()", "no arithmetic on columns"),
        ("[t for t in z]", "no arithmetic on columns"),
        ("'a'*9", "no arithmetic on columns"),
        ("9**9**9**9", "not finite"),
        ("(" * 500 + "t" + ")" * 500, "neither a column nor arithmetic"),
        ("t+" * 3000 + "t", "neither a column nor arithmetic"),
    ],
)
def test_what_is_no_arithmetic_is_refused_with_a_sentence(expression, says):
    with pytest.raises(BadInput) as error:
        evaluate(expression, COLUMNS, T)
    assert says in str(error.value)


@given(st.text(max_size=40))
def test_no_text_does_more_than_yield_numbers_or_a_sentence(text):
    try:
        value = evaluate(text, COLUMNS, T)
    except BadInput:
        return
    assert value.shape == T.shape
    assert np.isfinite(value).all()


def test_an_integral_is_that_of_the_curve_through_the_samples():
    t = np.linspace(0.5, 3.5, 301)
    found = evaluate("integral(2*cos(3*`t`) + 1)", {"t": t}, t)
    # a cubic spline's error is h^4 times the fourth derivative at most, over the length
    np.testing.assert_allclose(found, 2 / 3 * (np.sin(3 * t) - np.sin(1.5)) + t - 0.5, rtol=0, atol=3 * 162 * 0.01**4)


def test_an_integral_of_a_constant_is_a_line_and_atan2_keeps_the_quadrant():
    t = np.linspace(0, 1, 11)
    np.testing.assert_allclose(evaluate("integral(2)", {}, t), 2 * t, atol=1e-12)
    np.testing.assert_allclose(evaluate("atan2(-1, -1)", {}, t), -0.75 * np.pi)
