"""Is a wrong plant of the user's own answered in one sentence that says what to do?"""

import math

import numpy as np
import pytest

from tests.physics.specimens import EXAMPLES
from upright.errors import BadInput, ImpossiblePhysics
from upright.physics import find

HEAD = """
from upright.physics import Coordinate, Input, Joint, Plant
from upright.quantities import quantity

class Mine(Plant):
    m: float = quantity("kg", "mass", above=0)
    coordinates = (Coordinate("x", "m", "position"),)
"""
ENERGIES = """
    @staticmethod
    def energies(p, q, v):
        return p.m * v[0]**2 / 2, 0, 0
"""
RIGHT = HEAD + ENERGIES

WHEN_MADE = {
    "no energies": (HEAD, r"Mine states no energies; define energies\(p, q, v\)"),
    "no coordinates": (RIGHT.replace("coordinates =", "coordinate ="), "Mine has no coordinates; write coordinates"),
    "parameter without unit": (RIGHT + "    k: float = 3.0\n", "parameter 'k' has no unit; write k: float = quantity"),
    "parameter without type": (
        RIGHT + "    k = quantity('N/m', 'spring')\n",
        "k = quantity.* needs a type; write k: float",
    ),
    "parameter like a coordinate": (RIGHT.replace('"x"', '"m"', 1), "'m' is both coordinate and parameter; rename"),
    "parameter like a velocity": (
        RIGHT + "    x_dot: float = quantity('m/s', 'speed')\n",
        "'x_dot' is both velocity and parameter",
    ),
    "parameter like an intermediate result": (
        RIGHT + "    k1: float = quantity('N/m', 'spring')\n",
        "parameter 'k1' is a name that equations use themselves; call it 'k_1'",
    ),
    "parameter like a name of the kernel": (
        RIGHT + "    _h: float = quantity('m', 'height')\n",
        "parameter '_h' starts with '_', as names that equations use themselves do; call it 'h'",
    ),
    "coordinate like a keyword": (RIGHT.replace('"x"', '"lambda"', 1), "coordinate 'lambda' is no Python name"),
    "parameter like a keyword": (
        RIGHT + "    lambda: float = quantity('m', 'wavelength')\n",
        r"mine\.py has a syntax error in line 11",
    ),
    "coordinate like an argument": (RIGHT.replace('"x"', '"at"', 1), r"coordinate 'at' hides an argument of state"),
    "parameter that hides a method": (
        RIGHT + "    energy: float = quantity('J', 'energy')\n",
        "parameter 'energy' hides what a plant itself calls energy",
    ),
    "coordinate that is no name": (RIGHT.replace('"x"', '"x 1"', 1), "coordinate 'x 1' is no Python name"),
    "unknown coordinate in a joint": (
        RIGHT + "    joints = (Joint('y'),)\n",
        "a joint is on 'y': 'y' is no coordinate; valid names: x",
    ),
    "unknown parameter in a joint": (
        RIGHT + "    joints = (Joint('x', coulomb='mm'),)\n",
        "the joint on x names 'mm'; did you mean 'm'",
    ),
    "unknown coordinate of an input": (
        RIGHT + "    inputs = (Input('F', 'N', 'force', on='X'),)\n",
        "input F names 'X'",
    ),
    "unknown coordinate of an equilibrium": (
        RIGHT + "    equilibria = {'up': {'theta': 3.1}}\n",
        "equilibrium 'up' names 'theta'",
    ),
    "syntax error": (RIGHT + "    joints = (\n", r"mine\.py has a syntax error in line 11"),
    "error while it runs": (RIGHT + "    l = lenght\n", r"mine\.py stops in line 11: NameError: name 'lenght'"),
    "another class": (RIGHT.replace("Mine", "Mime"), "has no plant 'Mine'; did you mean 'Mime'"),
}

WHEN_DERIVED = {
    "T of third order": (RIGHT.replace("v[0]**2", "v[0]**3"), "T must be quadratic in the velocities"),
    "V with a velocity": (RIGHT.replace("/ 2, 0, 0", "/ 2, v[0], 0"), "V must not depend on velocities"),
    "no inertia": (RIGHT.replace("p.m * v[0]**2 / 2", "0"), "x has no inertia, so its acceleration is undefined"),
    "misspelt parameter": (RIGHT.replace("p.m *", "p.mm *"), r"uses p\.mm; did you mean 'm'"),
    "two energies": (RIGHT.replace("/ 2, 0, 0", "/ 2, 0"), "must return T, V, D"),
    "text for an energy": (RIGHT.replace("/ 2, 0, 0", "/ 2, 'heavy', 0"), "must return SymPy expressions or numbers"),
    "math instead of sympy": (
        "import math\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, math.cos(q[0]), 0"),
        "does not run: TypeError: .* write it with SymPy's sin, cos and sqrt",
    ),
    "foreign symbol": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, sympy.Symbol('h'), 0"),
        "uses h, which is none of its own symbols; take them from p, q and v",
    ),
    "function beyond the elementary ones": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, sympy.erf(q[0]) + sympy.floor(q[0]), 0"),
        r"uses erf, floor, which the kernel does not know; it knows SymPy's sin, cos, tan, asin, .* and Piecewise",
    ),
    "function without a definition": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, sympy.Function('V')(q[0]), 0"),
        "uses V, which the kernel does not know",
    ),
    "number that is not real": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, sympy.I * q[0], 0"),
        "uses ImaginaryUnit, which the kernel does not know",
    ),
    "pieces that leave cases open": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, sympy.Piecewise((q[0]**2, q[0] > 1)), 0"),
        r"Piecewise\(\(x\*\*2, x > 1\)\) leaves cases open; let its last piece hold for True",
    ),
    "energy that jumps": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, sympy.Heaviside(q[0] - p.m), 0"),
        "its potential energy V jumps where m - x = 0, and the kernel steps over jumps; let it rise over",
    ),
    "force that jumps": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, sympy.Abs(sympy.sin(q[0])), 0"),
        r"the force on x jumps where sin\(x\) = 0",
    ),
    "dry friction among the viscous": (
        "import sympy\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, 0, p.m * sympy.Abs(v[0])"),
        "the force on x jumps where x_dot = 0, .* state dry friction in a Joint",
    ),
    "self in energies": (RIGHT.replace("(p, q, v)", "(self, p, q, v)"), "does not run: TypeError"),
}


def write(folder, text):
    (folder / "mine.py").write_text(text.lstrip("\n"), encoding="utf-8")
    return folder


@pytest.mark.parametrize("case", WHEN_MADE)
def test_a_plant_wrongly_stated_is_refused_when_read(case, tmp_path):
    text, sentence = WHEN_MADE[case]
    with pytest.raises(BadInput, match=sentence) as refused:
        find("mine.py:Mine", write(tmp_path, text))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("case", WHEN_DERIVED)
def test_energies_of_no_mechanical_system_are_refused_when_derived(case, tmp_path):
    text, sentence = WHEN_DERIVED[case]
    plant = find("mine.py:Mine", write(tmp_path, text))
    with pytest.raises(BadInput, match=sentence) as refused:
        plant.derived()
    assert "\n" not in str(refused.value)


def test_a_right_plant_is_derived(tmp_path):
    plant = find("mine.py:Mine", write(tmp_path, RIGHT))
    assert plant.derived().mass == ("k0",)
    assert plant(m=2.0).energy([0.0, 3.0]) == 9.0


def test_an_inertia_that_can_be_negative_is_refused_in_numbers(tmp_path):
    text = RIGHT.replace("above=0", "default=1.0").replace("p.m * v", "(p.m - 2) * v")
    with pytest.raises(ImpossiblePhysics, match="positive definite mass matrix"):
        find("mine.py:Mine", write(tmp_path, text))().linear()


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("nowhere.py:Mine", r"nowhere\.py does not exist; give it relative to the study file"),
        ("double_pendulum.py", "name the class in the file too"),
        ("double_pendulum.py:DoublePendulums", "did you mean 'DoublePendulum'"),
    ],
)
def test_a_file_that_cannot_be_used_is_named(name, sentence):
    with pytest.raises(BadInput, match=sentence):
        find(name, EXAMPLES)


@pytest.mark.parametrize("name", ["Plant", "Joint", "quantity", "HALF"])
def test_what_a_file_imports_or_defines_besides_is_no_plant_of_its(name, tmp_path):
    with pytest.raises(BadInput, match=f"has no plant '{name}'"):
        find(f"mine.py:{name}", write(tmp_path, RIGHT + "\nHALF = 0.5\n"))


def test_a_constant_angle_and_a_gear_ratio_are_taken_out_of_the_sines(tmp_path):
    """cos(x + alpha) by the addition theorem, cos(n x) with its ratio as a lump: both against plain evaluation."""
    from math import sin

    from tests.physics.text import acceleration

    text = "from sympy import cos\n" + RIGHT.replace("/ 2, 0, 0", "/ 2, cos(q[0] + p.alpha) + cos(p.n * q[0]), 0")
    text = text.replace(
        "    coordinates",
        "    alpha: float = quantity('rad', 'a')\n    n: float = quantity('1', 'ratio')\n    coordinates",
    )
    plant = find("mine.py:Mine", write(tmp_path, text))(m=2.0, alpha=0.3, n=1.7)
    a = acceleration(plant.derived(), plant.parameters())([0.9], [0.2], [])
    assert a == pytest.approx([(sin(1.2) + 1.7 * sin(1.7 * 0.9)) / 2.0], rel=1e-12)


LETTERS = """
from sympy import cos

from upright.physics import Coordinate, Input, Joint, Plant
from upright.quantities import quantity

class Mine(Plant):
    p: float = quantity("kg", "mass", above=0)
    q: float = quantity("N/m", "spring", above=0)
    v: float = quantity("N s/m", "damping", at_least=0)
    self: float = quantity("m", "where the spring is slack")
    coordinates = (Coordinate("t", "m", "position"),)
    inputs = (Input("u", "N", "force", on="t"),)

    @staticmethod
    def energies(p, q, v):
        return p.p * v[0]**2 / 2, p.q * (q[0] - p.self)**2 / 2, p.v * v[0]**2 / 2
"""


def test_quantities_may_be_called_as_the_arguments_of_the_energies_are(tmp_path):
    """p t'' = -q (t - self) - v t' + u: matrices, energy, step response and estimates by hand."""
    from upright.identification import GreyBox, Parameter, Run, identify
    from upright.simulation import simulate

    plant = find("mine.py:Mine", write(tmp_path, LETTERS))(p=0.5, q=20.0, v=0.2, self=0.1).replace(self=0.0)
    linear = plant.linear()
    assert np.allclose(linear.A, [[0.0, 1.0], [-20 / 0.5, -0.2 / 0.5]], rtol=1e-12)
    assert np.allclose(linear.B, [[0.0], [1 / 0.5]], rtol=1e-12)
    assert plant.energy(plant.state(t=0.3, t_dot=2.0)) == pytest.approx(0.5 * 2.0**2 / 2 + 20 * 0.3**2 / 2)
    assert plant.power_lost(plant.state(t_dot=2.0)) == pytest.approx(0.2 * 2.0**2)
    t = np.arange(301) * 0.01
    x = simulate(plant, {}, plant.state(), np.ones((301, 1)), 0.01, samples=301, substeps=4)[:, [0], 0]
    decay, omega = 0.2, math.sqrt(40 - 0.2**2)
    step = (1 - np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))) / 20
    assert x[:, 0] == pytest.approx(step, abs=1e-8)
    numbers = plant.parameters()
    parameters = {n: Parameter(name=n, value=v, unit=type(plant).quantity(n).unit) for n, v in numbers.items()}
    parameters["p"] = Parameter(name="p", value=0.4, unit="kg", estimate=True)
    run = Run(label="step", role="fit", t=t, y=step[:, None], u=np.ones((301, 1)), measured=("t",))
    fit = identify(GreyBox(plant=type(plant), parameters=parameters, substeps=4), [run])
    assert fit.estimates["p"].value == pytest.approx(0.5, rel=1e-5)
