"""Are names, powers and numbers written as a textbook has them, in text, in MathML and for matplotlib?"""

from __future__ import annotations

import math
import unicodedata

import pytest

from upright.report.symbols import (
    GREEK,
    axis,
    identifier,
    mathtext,
    number,
    parts,
    percent,
    plain,
    slanted,
    symbol,
    unit,
    with_error,
)


def test_greek_letters_are_those_that_unicode_calls_so():
    names = {"lambda": "LAMDA", "sigmaf": "FINAL SIGMA"}  # as Unicode spells it, and at a word's end
    assert len(GREEK) == 25
    for name, letter in GREEK.items():
        assert letter == unicodedata.lookup(f"GREEK SMALL LETTER {names.get(name, name).upper()}")


@pytest.mark.parametrize(
    ("name", "stem", "below", "dot"),
    [
        ("theta1_dot", "θ", "1", "."), ("b_1c", "b", "1c", ""), ("psi", "ψ", "", ""), ("x_1_dot", "x", "1", "."),
        ("J_p", "J", "p", ""), ("k_12", "k", "12", ""), ("omega_phi", "ω", "φ", ""), ("x_a_b", "x", "a,b", ""),
        ("theta1_2", "theta1", "2", ""), ("gain", "gain", "", ""),
    ],
)  # fmt: skip
def test_a_name_is_a_letter_an_index_and_a_dot(name, stem, below, dot):
    assert parts(name) == (stem, below, dot)


@pytest.mark.parametrize(
    ("name", "power", "markup"),
    [
        ("theta", "", "<mi>θ</mi>"), ("gain", "", '<mi mathvariant="normal">gain</mi>'),
        ("theta_dot", "", "<mover><mi>θ</mi><mo>˙</mo></mover>"),
        ("theta_ddot", "", "<mover><mi>θ</mi><mo>¨</mo></mover>"),
        ("b_1c", "", "<msub><mi>b</mi><mtext>1c</mtext></msub>"),
        ("r", "<mn>2</mn>", "<msup><mi>r</mi><mn>2</mn></msup>"),
        ("m_p", "<mn>2</mn>", "<msubsup><mi>m</mi><mtext>p</mtext><mn>2</mn></msubsup>"),
        ("x_1_dot", "<mn>2</mn>", "<msubsup><mover><mi>x</mi><mo>˙</mo></mover><mtext>1</mtext><mn>2</mn></msubsup>"),
    ],
)  # fmt: skip
def test_a_symbol_has_its_index_below_and_its_power_above(name, power, markup):
    assert identifier(name, power) == markup
    if not power:
        assert symbol(name) == f"<math><mrow>{markup}</mrow></math>"


@pytest.mark.parametrize(
    ("name", "html", "text", "latex"),
    [
        ("theta_dot", "<i>θ\u0307</i>", "θ\u0307", r"$\dot{θ}$"),
        ("b_1c", "<i>b<sub>1c</sub></i>", "b_1c", r"$b_{\mathrm{1c}}$"),
        ("x_1", "<i>x<sub>1</sub></i>", "x1", r"$x_{\mathrm{1}}$"), ("psi", "<i>ψ</i>", "ψ", "$ψ$"),
        ("x_1_dot", "<i>x\u0307<sub>1</sub></i>", "x\u03071", r"$\dot{x}_{\mathrm{1}}$"),
        ("gain", "<i>gain</i>", "gain", r"$\mathrm{gain}$"),
        ("J_p", "<i>J<sub>p</sub></i>", "J_p", r"$J_{\mathrm{p}}$"),
        ("a b<$", "<span>a b&lt;$</span>", "a b<$", r"a b<\$"),
    ],
)  # fmt: skip
def test_a_name_is_written_in_html_in_text_and_for_matplotlib(name, html, text, latex):
    """A page's style sets what is below upright: ``i sub`` in `report/templates/style.css`."""
    assert (slanted(name), plain(name), mathtext(name)) == (html, text, latex)
    if name == "a b<$":
        assert symbol(name) == html


@pytest.mark.parametrize(
    ("text", "shown", "label"),
    [("kg m^2", "kg m²", "y [kg m²]"), ("N*m", "N·m", "y [N·m]"), ("s**-1", "s⁻¹", "y [s⁻¹]"), ("1", "", "y"),
     ("", "", "y"), ("m/s^10", "m/s¹⁰", "y [m/s¹⁰]")],
)  # fmt: skip
def test_powers_of_units_are_raised_and_a_pure_number_has_none(text, shown, label):
    assert (unit(text), axis("y", text)) == (shown, label)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 4, "0"), (-0.0123456, 4, "−0.01235"), (0.00123456, 4, "1.235·10⁻³"), (0.01, 2, "0.010"),
        (999999.0, 3, "999999"), (1e6, 3, "1.00·10⁶"), (-2.5e-7, 2, "−2.5·10⁻⁷"), (12.3456, 2, "12"),
        (math.nan, 4, "not known"), (math.inf, 4, "∞"), (-math.inf, 4, "−∞"), (3.14159, 1, "3"),
    ],
)  # fmt: skip
def test_a_number_has_its_figures_and_powers_of_ten_from_a_million_and_below_a_hundredth(value, digits, text):
    assert number(value, digits) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(99.0, "99.0 %"), (99.01, "99.01 %"), (50.04, "50.0 %"), (-3.21, "−3.2 %"), (math.nan, "not known")],
)
def test_percents_beyond_99_have_a_figure_more(value, text):
    assert percent(value) == text


def test_a_value_without_an_error_shows_a_dash():
    assert with_error(1.23456, 0.0)[1] == "–"
    assert with_error(1.23456, 0.0123) == ("1.235", "0.012")
