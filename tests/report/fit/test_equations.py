"""Are the formulas on the page those of the plant?"""

import re
from html.parser import HTMLParser

import pytest

from tests.physics.bumpers import Bumpers
from upright.physics import BUILT_IN, CartPendulum, Furuta, Pendulum, find
from upright.report.fit.equations import equations
from upright.report.symbols import symbol

RARE = ("b_1q", "b_2q", "k_psi", "k_x", "tilt_x", "tilt_y")


def read(markup):
    """Formulas as a person would type them: subscripts and powers marked, one row per equation."""
    rows = []
    for row in re.findall(r"<mtr>(.*?)</mtr>", markup):
        row = re.sub(r"<msubsup>(.*?)<mtext>(.*?)</mtext>(.*?)</msubsup>", r"\1_\2^\3", row)
        row = re.sub(r"<msub>(.*?)<mtext>(.*?)</mtext></msub>", r"\1_\2", row)
        row = re.sub(r"<msup>(?:<mrow>)?(.*?)(?:</mrow>)?<mn>(\d)</mn></msup>", r"\1^\2", row)
        row = re.sub(r"<[^>]*>|&#x206[12];|\s", "", row)
        if "=" in row:
            rows.append(row)
        else:
            rows[-1] += row
    return rows


def test_the_pendulum_s_equation_is_the_textbook_s():
    (row,) = read(equations(Pendulum, zero=RARE))
    assert row == "(J_p+m_pl_cg^2)θ¨=T−m_pl_cggsinθ−b_2θ˙−b_2csgn(θ˙)"


def test_the_cart_s_equations_are_the_appendix_s():
    x, theta = read(equations(CartPendulum, zero=RARE))
    assert x == "(m_c+m_p)x¨+m_pl_cgcosθθ¨=F+m_pl_cgsinθθ˙^2−b_1x˙−b_1csgn(x˙)"
    assert theta == "m_pl_cgcosθx¨+(J_p+m_pl_cg^2)θ¨=−m_pl_cggsinθ−b_2θ˙−b_2csgn(θ˙)"


def test_furuta_s_equations_are_eq_3_corrected():
    psi, theta = read(equations(Furuta, zero=(*RARE, "b_1c", "b_2c", "b_1", "b_2")))
    own = "((J_p+m_pl_cg^2−J_a)sin^2θ+J_a+J_d+m_pr^2)ψ¨"
    assert psi == f"{own}−m_pl_cgrcosθθ¨=T−2(J_p+m_pl_cg^2−J_a)cosθsinθψ˙θ˙−m_pl_cgrsinθθ˙^2"
    assert theta == "(J_p+m_pl_cg^2)θ¨−m_pl_cgrcosθψ¨=(J_p+m_pl_cg^2−J_a)cosθsinθψ˙^2−m_pl_cggsinθ"


def test_a_term_whose_parameter_is_zero_is_left_out():
    text = "".join(read(equations(Furuta, zero=("b_1", "tilt_x", "tilt_y", "k_psi"))))
    assert "tilt" not in text
    assert "b_1ψ˙" not in text
    assert "b_2θ˙" in text


def test_a_force_in_pieces_is_written_with_its_conditions():
    x = read(equations(Bumpers))[0]
    assert "k(2(gap+x)ifgap+x≤0else0)" in x  # a spring that only pushes, and |x|^3 as -x^2 sgn(x) - 2 x |x|
    assert "−(1ifx≥0else−1)x^2" in x
    assert "−2(xifx≥0else−x)x" in x


class Balanced(HTMLParser):
    def __init__(self, markup):
        super().__init__()
        self.open = []
        self.feed(markup)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_startendtag(self, tag, attrs):
        pass


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_plant_is_written_with_every_name_explained(name):
    plant = find(name)
    markup = equations(plant)
    Balanced(markup)
    rows = read(markup)
    assert len(rows) == len(plant.coordinates)
    assert not re.search(r"\b[kswc]\d", "".join(rows).replace("_", "")) or name.startswith(("recti", "tors"))


@pytest.mark.parametrize("name", ["actuator.gain", "<script>", "a b", "x&y"])
def test_what_is_no_symbol_is_written_as_text(name):
    assert "<script" not in symbol(name)
    assert "&y" not in symbol(name)
