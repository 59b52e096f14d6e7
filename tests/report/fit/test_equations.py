"""Are the formulas on the page those of the plant?"""

import ast
import re
from html.parser import HTMLParser

import pytest

from tests.physics.bumpers import Bumpers
from upright.physics import BUILT_IN, CartPendulum, Derived, DoublePendulumAbsolute, Furuta, Pendulum, find
from upright.physics.equations import DryJoint
from upright.report.fit.equations import MathWriter, equations
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


@pytest.mark.slow
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


def stripped(markup):
    """Markup as a person would type it: fractions with a slash, roots and powers in braces."""
    markup = re.sub(r"<mfrac><mrow>(.*?)</mrow><mrow>(.*?)</mrow></mfrac>", r"{\1/\2}", markup)
    markup = re.sub(r"<msqrt>(.*?)</msqrt>", r"root{\1}", markup)
    markup = re.sub(r"<msup><mi>(.*?)</mi><mn>(\d)</mn></msup>", r"\1^\2", markup)
    markup = re.sub(r"<msup><mrow>(.*)</mrow><m(n|row)>(.*?)</m(?:n|row)></msup>", r"{\1}^{\3}", markup)
    return re.sub(r"<[^>]*>|&#x206[12];|\s", "", markup)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("b*a", "ab"),  # parameters in the plant's order
        ("x*b*2*a", "2abx"),  # a number first, what moves last
        ("sin(x)*b", "bsinx"), ("cos(x)*sin(x)", "cosxsinx"), ("abs(x)*x", "x|x|"), ("(a + b)*a", "a(a+b)"),
        ("(a + b)*x", "(a+b)x"), ("sin(x)*(a + b)", "(a+b)sinx"), ("a*a*b", "a^2b"), ("a*b*a*a", "a^3b"),
        ("sin(x)*sin(x)", "sin^2x"), ("sin(x + a)*sin(x + a)", "sin^2(x+a)"), ("-(a*b)", "−ab"),
        ("a + -b", "a−b"), ("-a + b", "b−a"),  # what adds stands first
        ("-(a + b)", "−(a+b)"), ("a*-b", "a(−b)"), ("a/b", "{a/b}"), ("a*(b/x)", "{b/x}a"),
        ("sqrt(a + b)", "root{a+b}"),
        ("abs(a + b)", "|a+b|"), ("sgn(x)", "sgn(x)"), ("tanh(x)", "tanhx"), ("tanh(a*x)", "tanh(ax)"),
        ("a if x > 0 else b", "aifx&gt;0elseb"), ("2*(a if x <= 0 else b)", "2(aifx≤0elseb)"),
        ("1 if x < a and x >= b else 0", "1ifx&lt;aandx≥belse0"),
        ("1 if x == a or x > b else 0", "1ifx=aorx&gt;belse0"),
        ("a**0.5", "{a}^{0.5}"), ("(a + b)**2", "{(a+b)}^{2}"), ("a if x != 0 else b", "aifx!=0elseb"),
    ],
)  # fmt: skip
def test_an_expression_is_set_as_in_print(text, shown):
    markup = MathWriter(("a", "b"))(ast.parse(text, mode="eval").body)
    Balanced(markup)
    assert stripped(markup) == shown


def test_long_equations_are_broken_between_terms_with_their_signs():
    """38 names on a line, the left side's included: 2 and 36 of one letter each."""
    terms = [f"q{i}" for i in range(37)]
    right = ast.parse(" + ".join(terms), mode="eval").body
    left = ast.parse("m*x", mode="eval").body
    markup = MathWriter(())
    rows = re.findall(r"<mtr>(.*?)</mtr>", markup.aligned([(left, right)]))
    assert len(rows) == 2
    first, second = (re.sub(r"<[^>]*>|&#x206[12];|\s", "", row) for row in rows)
    assert first.count("+") == 35
    assert first.startswith("mx=q0+")
    assert second == "+q36"
    short = ast.parse(" + ".join(terms[:36]), mode="eval").body
    assert markup.aligned([(left, short)]).count("<mtr>") == 1
    wide = ast.parse("m*x*y", mode="eval").body  # the longest left side counts for all
    assert markup.aligned([(left, short), (wide, left)]).count("<mtr>") == 3


def test_a_joint_between_two_bodies_rubs_on_the_difference_of_their_speeds():
    """Of the double pendulum in absolute angles the second hinge turns by theta_2 - theta_1, against both."""
    one, two = read(equations(DoublePendulumAbsolute))
    assert "+b_2csgn(" in one
    assert "−b_2csgn(" in two
    assert "−b_1csgn(" in one
    assert "b_1c" not in two


class ByHand:
    """A plant whose equations were typed here: two coordinates, and every kind of intermediate name."""

    @staticmethod
    def derived(without):
        return Derived(
            name="ByHand", coordinates=("x", "y"), inputs=("F",), parameters=("m", "J", "a", "b", "k", "c", "q"),
            lumps=("m + J",), trig=(("s0", "c0", "a*y"),), steps=(("n0", "a*s0"),), mass=("k0", "b*c0", "J"),
            force=("F - b*n0 - 0*k", "b/k - sqrt(c0)*x"), stiffness=(), damping=(), gain=(), kinetic="0",
            potential="0", power_lost="0",
            joints=(DryJoint(direction=(1.0, 0.0), coulomb="c", quadratic="q"),
                    DryJoint(direction=(-1.0, 2.0), coulomb="c", quadratic="")),
        )  # fmt: skip


def by_hand(*zero):
    rows = re.findall(r"<mtr>(.*?)</mtr>", equations(ByHand, zero=zero))
    return [stripped(re.sub(r"<mover>(.*?)<mo>(.)</mo></mover>", r"\1\2", row)).replace("\u202f", "") for row in rows]


def test_intermediate_names_are_put_back_and_what_is_zero_is_worked_out():
    x, y = by_hand("c", "q")
    assert x == "(m+J)x¨+bcos(ay)y¨=F−absin(ay)"
    assert y == "bcos(ay)x¨+Jy¨={b/k}−root{cos(ay)}x"
    assert by_hand("c", "q", "a") == ["(m+J)x¨+by¨=F", "bx¨+Jy¨={b/k}−x"]  # sin 0 = 0, cos 0 = 1, root of 1 = 1
    assert by_hand("c", "q", "b") == ["(m+J)x¨=F", "Jy¨=−root{cos(ay)}x"]
    assert by_hand("c", "q", "m", "a", "b") == ["Jx¨=F", "Jy¨=−x"]


def test_dry_friction_acts_along_each_joint_with_its_factor():
    x, y = by_hand("a", "b")
    assert x.startswith("(m+J)x¨=F")
    told = x.removeprefix("(m+J)x¨=F")
    assert told.count("csgn(") == 2
    assert "−csgn(x˙)" in told
    assert "−qx˙|x˙|" in told
    assert "+csgn(" in told  # against the second joint, which turns by 2 y - x
    assert y.count("sgn(") == 1
    assert "−2csgn(" in y.replace("2.0", "2")
    assert "q" not in y
    assert "q" not in by_hand("a", "b", "q")[0]
