"""What is proportional to an assumed gain scales with it, what is not stays; without it the data speak in volts."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.identification import Fit, GreyBox, Parameter, Run, identify
from upright.identification.inference.assumptions import per_length, proportional, untouched
from upright.identification.inference.verdict.evidence import USABLE
from upright.physics import find
from upright.simulation import simulate
from upright.study import load_study

DISK = find("torsional-1")
TRUTH = {"J_1": 2.4e-3, "k_1": 0.9, "c_1": 6e-3, "f_1c": 4e-3}
GAIN, QUANTUM, DT = 0.4, 2 * math.pi / 16000, 2e-3


def steps(gain: float = GAIN, added: float = 0.0, label: str = "step") -> Run:
    """A disk on a spring, three steps of 1 V, read by an encoder."""
    t = np.arange(2501) * DT
    u = np.where((t > 0.2) & (t < 1.8), 1.0, np.where((t > 3.0) & (t < 4.0), -0.6, 0.0))[:, None]
    values = TRUTH | {"actuator.gain": gain}
    plant = DISK(**TRUTH, a_1=added)
    x = simulate(plant, {"actuator.gain": values["actuator.gain"]}, [0.0, 0.0], u, DT, samples=t.size)
    y = QUANTUM * np.round(x[:, [0], 0] / QUANTUM)
    return Run(
        label=label, role="fit", t=t, u=u, y=y, measured=(DISK.coordinates[0].name,), resolution=(QUANTUM,),
        known={"a_1": added}, unknown=(), initial=dict.fromkeys(DISK.state_names(), 0.0),
    )  # fmt: skip


def rig(gain: Parameter) -> GreyBox:
    """The disk with wrong guesses of everything but the gain."""
    parameters = {
        n: Parameter(name=n, value=1.3 * TRUTH.get(n, 0.0), unit=DISK.quantity(n).unit, estimate=n in TRUTH)
        for n in DISK.names()
        if n in TRUTH
    }
    return GreyBox(plant=DISK, parameters=parameters | {"actuator.gain": gain})


def gained(**fields) -> Parameter:
    return Parameter(name="actuator.gain", unit="N m/V", **fields)


def test_numbers_per_assumed_gain_are_those_of_the_true_rig():
    fit = identify(rig(gained(value=1.0, assumed=True)), [steps()])
    (a,) = fit.assumptions
    assert set(proportional(a)) == set(TRUTH)
    # per V and count: inertia and stiffness carry 1/count, a Coulomb torque does not
    per_count = {"J_1": QUANTUM, "k_1": QUANTUM, "c_1": QUANTUM, "f_1c": 1.0}
    units = {"J_1": "V s^2/count", "k_1": "V/count", "c_1": "V s/count", "f_1c": "V"}
    for name, e in a.without.items():
        truth = TRUTH[name] / GAIN * per_count[name]
        assert e.unit == units[name]
        assert abs(e.value - truth) < 4 * e.stderr  # four numbers, so two standard errors would often fail
        assert e.stderr < 1e-3 * truth
    assert "is assumed, not known" in fit.verdict


def test_an_assumed_gain_changes_what_is_proportional_and_nothing_else():
    one, two = (identify(rig(gained(value=g, assumed=True)), [steps()]) for g in (1.0, 3.0))
    for name in TRUTH:
        assert abs(two.estimates[name].value / one.estimates[name].value / 3.0 - 1) < 1e-3
        a, b = one.assumptions[0].without[name], two.assumptions[0].without[name]
        assert abs(a.value / b.value - 1) < 1e-3


def test_one_known_added_inertia_gives_the_gain():
    fit = identify(rig(gained(value=1.0, estimate=True)), [steps(), steps(added=2e-3, label="loaded")])
    for name, truth in {**TRUTH, "actuator.gain": GAIN}.items():
        e = fit.estimates[name]
        assert abs(e.value - truth) < 4 * e.stderr
        assert e.stderr < 1e-2 * truth
        assert e.status == "well determined"
    assert not fit.assumptions


def test_what_an_assumed_length_does_not_touch_is_named():
    pendulum = find("pendulum")
    t = np.arange(1001) * 0.01
    truth = pendulum(m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3)
    x = simulate(truth, {}, [1.0, 0.0], None, 0.01, samples=t.size)
    run = Run(label="swing", role="fit", t=t, u=np.zeros((t.size, 1)), y=x[:, [0], 0], measured=("theta",))
    numbers = {
        "m_p": Parameter(name="m_p", value=0.2, unit="kg", assumed=True),
        "l_cg": Parameter(name="l_cg", value=0.3, unit="m"),
        "J_p": Parameter(name="J_p", value=3e-3, unit="kg m^2", estimate=True),
        "b_2": Parameter(name="b_2", value=3e-3, unit="N m s/rad", estimate=True),
    }
    fit = identify(GreyBox(plant=pendulum, parameters=numbers), [run])
    (a,) = fit.assumptions
    assert set(proportional(a)) == {"J_p", "b_2"}
    assert untouched(a) == []
    heavier = replace(numbers["m_p"], value=0.22)
    other = identify(GreyBox(plant=pendulum, parameters=numbers | {"m_p": heavier}), [run])
    for name in ("J_p", "b_2"):
        assert abs(other.estimates[name].value / fit.estimates[name].value / 1.1 - 1) < 1e-3


@pytest.mark.parametrize(
    ("unit", "force", "expected"),
    [
        ("kg", "N", (2, -1)), ("N s/m", "N", (1, -1)), ("N/m", "N", (0, -1)), ("N", "N", (0, 0)),
        ("N s^2/m^2", "N", (2, -2)), ("kg m^2", "N m", (2, -1)), ("N m s^2/rad^2", "N m", (2, -2)),
        ("N m", "N m", (0, 0)), ("rad/s", "N m", None), ("m", "N", None),
    ],
)  # fmt: skip
def test_units_divided_by_a_force(unit, force, expected):
    assert per_length(unit, force) == expected


def test_a_guess_cannot_be_assumed(tmp_path):
    text = """
    [rig]
    plant = "torsional-1"
    [parameters]
    J_1 = { guess = "1e-3 kg m^2", assumed = true }
    """
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(BadInput, match="assumed has no meaning"):
        load_study(tmp_path / "s.toml")


SWING = {"m_p": 0.2235, "l_cg": 0.2, "J_p": 3e-3, "b_2": 1e-3, "b_2c": 8e-4}


def swing(seed: int = 5) -> Run:
    """A pendulum let go at 1.2 rad, read with 0.3 mrad of noise."""
    t = np.arange(1501) * 0.01
    x = simulate(find("pendulum")(**SWING), {}, [1.2, 0.0], None, 0.01, samples=t.size, substeps=2)
    y = x[:, [0], 0] + 3e-4 * np.random.default_rng(seed).normal(size=(t.size, 1))
    return Run(label="swing", role="fit", t=t, u=np.zeros((t.size, 1)), y=y, measured=("theta",))


def hanging(assumed: dict[str, float], known: dict[str, float], asked: dict[str, float]) -> GreyBox:
    pendulum = find("pendulum")
    numbers = {
        n: Parameter(name=n, value=v, unit=pendulum.quantity(n).unit, estimate=n in asked, assumed=n in assumed)
        for n, v in {**assumed, **known, **asked}.items()
    }
    return GreyBox(plant=pendulum, parameters=numbers)


def usable(fit: Fit) -> set[str]:
    """Names that the verdict lists as usable."""
    (answer,) = (a for a in fit.answers if a.question == USABLE)
    listed = re.search(r"numbers can be used: (.*?)\.(?: |$)", answer.headline)
    return set(listed[1].split(", ")) if listed else set()


def test_what_would_move_with_an_assumed_length_is_not_usable_though_it_is_not_proportional_to_it():
    # of a swing only w^2 = m g l/(J + m l^2) is seen: J = m l (g/w^2 - l), so dJ/dl l/J = (g/w^2 - 2 l)/(g/w^2 - l)
    fit = identify(hanging({"l_cg": 0.22}, {"m_p": 0.2235}, {"J_p": 2e-3, "b_2": 1e-3, "b_2c": 1e-3}), [swing()])
    equal = (SWING["J_p"] + SWING["m_p"] * SWING["l_cg"] ** 2) / (SWING["m_p"] * SWING["l_cg"])  # g/w^2
    expected = (equal - 2 * 0.22) / (equal - 0.22)
    assert abs(fit.assumptions[0].follows["J_p"] - expected) < 0.02 * abs(expected)
    assert fit.estimates["J_p"].status == "rests on l_cg"
    assert fit.estimates["J_p"].rests_on == ("l_cg",)
    assert not usable(fit)


def test_what_an_assumed_zero_moves_rests_on_it():
    # J = 0 makes a simple pendulum of length L = J_A/(m l) of it: friction per m L^2 in the place of friction per J_A
    fits = [
        identify(hanging({"J_p": J}, {"m_p": SWING["m_p"]}, {"l_cg": 0.25, "b_2": 1e-3, "b_2c": 1e-3}), [swing()])
        for J in (0.0, SWING["J_p"])
    ]
    simple, whole = (f.estimates for f in fits)
    equal = (SWING["J_p"] + SWING["m_p"] * SWING["l_cg"] ** 2) / (SWING["m_p"] * SWING["l_cg"])
    for name in ("b_2", "b_2c"):
        ratio = simple[name].value / whole[name].value
        assert abs(ratio - equal / SWING["l_cg"]) < 0.02 * ratio
    assert {name for name, e in simple.items() if e.rests_on == ("J_p",)} == {"l_cg", "b_2", "b_2c"}
    low, high = simple["l_cg"].interval
    assert low < SWING["l_cg"] < high  # the centre of gravity, which this fit did not see
    (known,) = fits[0].assumptions[0].ratios.items()
    assert known[0] == "J_A/(m_p l_cg)"
    assert known[1].interval[0] < equal < known[1].interval[1]
    assert known[1].status == "well determined"
    assert not usable(fits[0])
    assert "equivalent point pendulum" in fits[0].verdict


def test_what_is_known_per_one_assumed_number_holds_what_another_may_be():
    """A mass of 1 kg and no inertia are assumed: friction per m_p depends on the inertia, per m_p l_cg on neither."""
    fit = identify(hanging({"m_p": 1.0, "J_p": 0.0}, {}, {"l_cg": 0.25, "b_2": 1e-3, "b_2c": 1e-3}), [swing()])
    known = {n: e for a in fit.assumptions for n, e in a.ratios.items()}
    for name in ("b_2", "b_2c"):
        e = known[f"{name}/(m_p l_cg)"]
        assert e.rests_on == ()
        assert abs(e.value - SWING[name] / (SWING["m_p"] * SWING["l_cg"])) < 3 * e.stderr
        assert e.interval[1] - e.interval[0] < 0.02 * e.value  # where the two assumed numbers may be anything
    equal = (SWING["J_p"] + SWING["m_p"] * SWING["l_cg"] ** 2) / (SWING["m_p"] * SWING["l_cg"])
    e = known["J_A/(m_p l_cg)"]
    assert e.rests_on == ()
    assert e.value == pytest.approx(equal, rel=1e-3)


def test_the_verdict_names_the_measurement_that_frees_a_number():
    asked = {"l_cg": 0.25, "b_2": 1e-3, "b_2c": 1e-3}
    light = identify(hanging({"m_p": 1.0}, {"J_p": 0.0}, asked), [swing()])
    assert usable(light) == {"l_cg"}  # J_p is known to be 0, so it is the length of a simple pendulum
    assert "b_2, b_2c rest on m_p (assumed)." in light.verdict
    assert 'Measure m_p and give it as known, m_p = "... kg" under [parameters].' in light.verdict
    weighed = identify(hanging({}, {"J_p": SWING["J_p"], "m_p": SWING["m_p"]}, asked), [swing()])
    assert usable(weighed) == set(asked)
    for name in asked:
        e = weighed.estimates[name]
        assert abs(e.value - SWING[name]) < 4 * e.stderr
        assert not e.rests_on


def test_an_interrupted_fit_calls_nothing_usable_that_may_rest_on_an_assumed_number():
    def stop(stage: str, share: float) -> None:
        if share > 0:
            raise KeyboardInterrupt

    fit = identify(hanging({"m_p": 1.0}, {"J_p": 0.0}, {"l_cg": 0.25, "b_2": 1e-3}), [swing()], progress=stop)
    assert fit.interrupted
    assert not usable(fit)
    assert "was not evaluated" in fit.verdict


def test_the_pole_upright_rests_on_an_assumed_number_unless_the_swing_fixes_it():
    # w^2 = m g l/J_A hanging is what the pole upright is, whatever length is assumed beside it; without J_A it is not
    friction = {"b_2": 1e-3, "b_2c": 1e-3}
    seen = identify(hanging({"l_cg": 0.22}, {"m_p": 0.2235}, {"J_p": 2e-3, **friction}), [swing()])
    (fastest, _) = seen.poles["inverted"]
    J_A = SWING["J_p"] + SWING["m_p"] * SWING["l_cg"] ** 2
    loss = SWING["b_2"] / (2 * J_A)
    true = (SWING["m_p"] * 9.81 * SWING["l_cg"] / J_A + loss**2) ** 0.5 - loss
    assert not fastest.real.rests_on
    assert fastest.real.value == pytest.approx(true, rel=1e-4)
    assert "the fastest pole is " in seen.answers[2].headline
    blind = identify(hanging({n: SWING[n] for n in ("l_cg", "J_p")}, {"m_p": 0.2235}, friction), [swing()])
    assert blind.poles["inverted"][0].real.rests_on == ("l_cg", "J_p")
    assert blind.answers[2].headline == "Inverted, the fastest pole is not known: it rests on l_cg, J_p (assumed)."
