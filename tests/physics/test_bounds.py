"""May every quantity of a shipped plant take the values that physics allows, and no others?

Positive is what the motion divides by: masses, inertias about an axis, lengths at whose end a weight pulls, gravity.
Friction takes energy and springs store it, so that neither is negative; a point mass has no inertia of its own, and a
first link may be balanced on its joint. The sine of a rig's lean stays below that of 30 degrees.
"""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import MISSING, dataclass, fields

import pytest

from upright.errors import BadInput, ImpossiblePhysics
from upright.physics import BUILT_IN, Pendulum, added_inertia, added_mass


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Names of quantities by the values that they may take; `given` has no default."""

    positive: str
    never_negative: str
    lean: str = ""
    given: str


def chain(letter: str, bodies: int) -> Bounds:
    indices = range(1, bodies + 1)
    masses = " ".join(f"{letter}_{i}" for i in indices)
    links = [f"{i}{i + 1}" for i in indices[:-1]]
    springs = " ".join(f"k_{link}" for link in links)
    more = " ".join(f"c_{link}" for link in links)
    each = " ".join(f"k_{i} c_{i} a_{i} f_{i}c f_{i}q f_{i}s v_{i}s delta_{i}" for i in indices)
    return Bounds(positive=masses, never_negative=f"{springs} {more} {each}", given=f"{masses} {springs}")


DRY_1, DRY_2 = (f"b_{i} b_{i}c b_{i}q b_{i}s v_{i}s delta_{i}" for i in (1, 2))
TWO_LINKS = Bounds(
    positive="m_1 m_2 l_1 l_c2 g", never_negative="l_c1 J_1 J_2 b_1 b_1c b_1q b_2 b_2c b_2q",
    given="m_1 m_2 l_1 l_c1 l_c2",
)  # fmt: skip
PLANTS = {
    "pendulum": Bounds(positive="m_p l_cg g", never_negative=f"J_p {DRY_2}", given="m_p l_cg"),
    "cart-pendulum": Bounds(
        positive="m_c m_p l_cg g", never_negative=f"J_p k_x {DRY_1} {DRY_2}", given="m_c m_p l_cg"
    ),
    "furuta": Bounds(
        positive="m_p l_cg r J_d g", never_negative=f"J_p J_a k_psi {DRY_1} {DRY_2}", lean="tilt_x tilt_y",
        given="m_p l_cg r J_d J_p",
    ),
    "double-pendulum": TWO_LINKS,
    "double-pendulum-absolute": TWO_LINKS,
    "flexible-link": Bounds(positive="J_h J_l", never_negative="k_s b_1 b_2 b_1c b_1q", given="J_h J_l k_s"),
    **{f"rectilinear-{n}": chain("m", n) for n in (1, 2, 3)},
    **{f"torsional-{n}": chain("J", n) for n in (1, 2, 3)},
}  # fmt: skip
ROWS = [
    (plant, name, kind)
    for plant, bounds in PLANTS.items()
    for kind in ("positive", "never_negative", "lean")
    for name in getattr(bounds, kind).split()
]
TINY = 1e-12
ALLOWED = {"positive": (TINY, 1e12), "never_negative": (0.0, TINY, 1e12), "lean": (-0.5, 0.0, 0.5)}
REFUSED = {
    "positive": (0.0, -TINY, -1.0), "never_negative": (-TINY, -1.0), "lean": (-0.5 - TINY, 0.5 + TINY, 1.0),
}  # fmt: skip


def test_every_quantity_of_every_shipped_plant_is_in_the_table():
    assert set(PLANTS) == set(BUILT_IN)
    for plant, cls in BUILT_IN.items():
        assert sorted(name for p, name, _ in ROWS if p == plant) == sorted(cls.names())


@pytest.mark.parametrize(("plant", "name", "kind"), ROWS)
def test_a_quantity_takes_what_physics_allows_and_nothing_else(plant, name, kind):
    one = BUILT_IN[plant](**dict.fromkeys(PLANTS[plant].given.split(), 0.3))
    for value in ALLOWED[kind]:
        assert getattr(one.replace(**{name: value}), name) == value
    for value in (*REFUSED[kind], math.nan, math.inf, -math.inf):
        with pytest.raises(ImpossiblePhysics, match=rf"^{name} \("):
            one.replace(**{name: value})


@pytest.mark.parametrize("plant", PLANTS)
def test_what_is_not_given_is_absent_but_for_gravity(plant):
    """No friction, no spring, no lean, nothing bolted on."""
    given = PLANTS[plant].given.split()
    assert sorted(f.name for f in fields(BUILT_IN[plant]) if f.default is MISSING) == sorted(given)
    values = BUILT_IN[plant](**dict.fromkeys(given, 0.3)).parameters()
    assert {n: v for n, v in values.items() if n not in given and v} == ({"g": 9.81} if "g" in values else {})


def test_masses_are_counted_from_none_and_weigh_something():
    """One brass mass of the ECP 205 and 210 weighs 500 g."""
    assert [added_mass(count) for count in (0, 1, 4)] == [0.0, 0.5, 2.0]
    assert added_inertia(1, 0.0) == 0.0
    assert added_inertia(2, 0.0, mass=3.0, mass_radius=0.2) == pytest.approx(2 * 3.0 * 0.2**2 / 2)  # on the axis
    for wrong in (
        lambda: added_mass(-1), lambda: added_mass(1, 0.0), lambda: added_inertia(1, -TINY),
        lambda: added_inertia(1, 0.1, mass_radius=-TINY),
    ):  # fmt: skip
        with pytest.raises(ImpossiblePhysics):
            wrong()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"m_p": 0.2, "l_cg": 0.2, "b_1": 1e-3}, "Pendulum has no parameter 'b_1'; did you mean 'b_2'"),
        ({}, r"Pendulum also needs m_p, mass of the pendulum \[kg\]; l_cg"),
        ({"m_p": 0.2}, r"Pendulum also needs l_cg, pivot to centre of gravity \[m\]"),
    ],
)
def test_a_plant_answers_for_what_is_misspelt_or_missing(given, said):
    with pytest.raises(BadInput, match=said):
        Pendulum(**given)


@pytest.mark.parametrize("name", list(BUILT_IN))
def test_the_class_of_every_plant_can_be_sent(name):
    assert pickle.loads(pickle.dumps(BUILT_IN[name])) is BUILT_IN[name]


def test_a_plant_can_be_sent_and_copied():
    rod = Pendulum(m_p=0.2, l_cg=0.2)
    assert pickle.loads(pickle.dumps(rod)) == copy.deepcopy(rod) == rod
