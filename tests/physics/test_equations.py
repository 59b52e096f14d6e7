"""Do the derived equations, their linear models and their energies agree with each other, for every plant?"""

import os
import subprocess
import sys

import numpy as np
import pytest
import sympy as sp

from tests.paper.symbolic import linear
from tests.physics.specimens import EXAMPLES, SPECIMENS
from tests.physics.text import acceleration, slope, swing
from upright.physics import Plant, find, lagrange
from upright.physics.generate import variants
from upright.physics.lagrange import derive
from upright.physics.plant import stem
from upright.physics.stored import FOLDER, file_text

MOTOR = find("qube_motor.py:QubeMotor", EXAMPLES)(
    m_p=0.024, l_cg=0.0645, r=0.085, J_d=2.3e-4, J_p=3.3e-5, b_1=5e-4, b_2=1e-5
)
PLANTS = {name: specimen.plant for name, specimen in SPECIMENS.items()} | {"qube motor": MOTOR}
CASES = [(name, at) for name, plant in PLANTS.items() for at in plant.equilibria]


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.mark.parametrize(("name", "at"), CASES)
def test_linear_model_is_the_slope_of_the_nonlinear_one(name, at):
    """Central differences of step h err by h^2 times a third derivative, some 1e-9 of the largest entry here."""
    plant, h = PLANTS[name], 1e-5
    model = plant.linear(at)
    n, m = len(model.states), len(model.inputs)
    rest, still = np.zeros(n), np.zeros(m)
    rest[0::2] = list(model.point.values())
    columns = [
        (slope(plant, lambda t, u=u: u)(0, rest + dx) - slope(plant, lambda t, u=u: -u)(0, rest - dx)) / (2 * h)
        for dx, u in [(h * e, still) for e in np.eye(n)] + [(np.zeros(n), h * e) for e in np.eye(m)]
    ]
    numeric = np.column_stack(columns)
    exact = np.hstack([model.A, model.B])
    np.testing.assert_allclose(exact, numeric, rtol=1e-7, atol=1e-7 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("name", "at"), [(n, a) for n, a in CASES if "level" not in n and "-3" not in n and "-4" not in n]
)
def test_linear_model_in_numbers_is_the_one_in_symbols(name, at):
    plant = PLANTS[name]
    values = {sp.Symbol(k, real=True): v for k, v in plant.parameters().items()}
    symbolic = [np.array(m.subs(values), dtype=float) for m in linear(type(plant), at, without=plant.optional)]
    for ours, theirs in zip((plant.linear(at).A, plant.linear(at).B), symbolic, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.parametrize("name", PLANTS)
def test_energy_grows_by_the_work_done_and_falls_by_the_heat(name, rng):
    """dE/dt = u . v - power lost, at random states; the derivative along the motion by central differences."""
    plant, h = PLANTS[name], 1e-6
    derived = plant.derived()
    driven = [derived.coordinates.index(i.on) for i in plant.inputs]
    for _ in range(5):
        x, u = rng.uniform(-1, 1, len(plant.state_names())), rng.uniform(-1, 1, len(plant.inputs))
        f = slope(plant, lambda t, u=u: u)
        v, a = x[1::2], f(0, x)[1::2]
        ahead, behind = x.copy(), x.copy()
        for y, dt in ((ahead, h), (behind, -h)):
            y[0::2], y[1::2] = x[0::2] + v * dt + a * dt**2 / 2, v + a * dt
        rate = (plant.energy(ahead) - plant.energy(behind)) / (2 * h)
        expected = u @ v[driven] - plant.power_lost(x)
        assert rate == pytest.approx(expected, rel=1e-5, abs=1e-7 * (1 + np.abs(a).max()))


@pytest.mark.parametrize("name", PLANTS)
def test_accelerations_are_those_of_an_unabridged_derivation(name, rng):
    """Lumps, named sines and common steps change nothing: SymPy's own Lagrange equations, evaluated plainly."""
    plant = PLANTS[name]
    M, f = lagrange.symbolic_mass_and_force(type(plant))
    _, q, v, u = lagrange.symbols(type(plant))
    values = {sp.Symbol(k, real=True): value for k, value in plant.parameters().items()}
    plain = sp.lambdify([q, v, u], [M.subs(values), f.subs(values)])
    ours = acceleration(plant.derived_for(plant.parameters()), plant.parameters())
    for _ in range(5):
        at = [rng.uniform(-2, 2, len(x)) for x in (q, v, u)]
        mass, force = plain(*at)
        theirs = np.linalg.solve(np.array(mass, dtype=float), np.array(force, dtype=float).ravel())
        np.testing.assert_allclose(ours(*at), theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize(("plant", "without"), variants(), ids=lambda x: getattr(x, "__name__", None))
def test_generated_equations_are_those_of_the_energies(plant, without):
    """If this fails: python -m upright.physics.generate."""
    path = FOLDER / f"{stem(plant, without)}.json"
    assert path.read_text(encoding="utf-8") == file_text(derive(plant, without=without))


@pytest.mark.slow
def test_derivation_does_not_depend_on_the_order_of_hashes():
    """Generated text is compared, so it must be the same in every process."""
    program = (
        "import sys; from pathlib import Path; from upright.physics import Furuta, find; "
        "from upright.physics.lagrange import derive; "
        f"print(derive(Furuta), derive(find('double_pendulum.py:DoublePendulum', Path({str(EXAMPLES)!r}))))"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True, encoding="utf-8", check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }  # fmt: skip
    assert len(texts) == 1


@pytest.mark.parametrize("name", PLANTS)
def test_names_in_the_text_are_known_and_safe(name):
    """Every name is a parameter, a state, an input, a function or defined before it is used."""
    derived = PLANTS[name].derived()
    velocities = [f"{c}_dot" for c in derived.coordinates]
    functions = {"sin", "cos", "sqrt", "exp", "log", "tan", "pi"}

    def used(text):
        return set(compile(text, "text", "eval").co_names)

    known = functions | set(derived.parameters)
    for lump in derived.lumps:
        assert used(lump) <= known
    moving = {f"k{i}" for i in range(len(derived.lumps))} | {*derived.coordinates, *velocities, *derived.inputs}
    for s, c, argument in derived.trig:
        assert used(argument) <= moving
        moving |= {s, c}
    for step, text in derived.steps:
        assert used(text) <= moving | functions
        moving |= {step}
    for text in (*derived.mass, *derived.force):
        assert used(text) <= moving | functions
    everything = [*derived.parameters, *derived.coordinates, *velocities, *derived.inputs]
    assert len(set(everything)) == len(everything)
    assert all(n.isidentifier() for n in everything)
    assert not {f"{letter}{i}" for letter in "kscw" for i in range(100)} & set(everything)


def frictionless(plant: Plant) -> Plant:
    lossy = [n for n in plant.names() if n.startswith(("b_", "c_", "f_", "R_m"))]
    return plant.replace(**{n: 0.0 for n in lossy if plant.quantity(n).unit != "ohm"})


@pytest.mark.parametrize("name", ["furuta", "double pendulum"])
def test_two_routes_of_energy_agree_along_a_motion(name):
    """Frictionless, by Dormand and Prince: what the energies say of the motion does not change."""
    plant = frictionless(PLANTS[name])
    x = swing(plant, plant.state(theta=2.0), 5.0, samples=50, rtol=1e-12)
    energy = plant.energy(x)
    assert np.ptp(energy) < 1e-9 * (1 + np.abs(energy).max())
