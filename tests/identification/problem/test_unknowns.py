"""Which numbers are sought, in which coordinate, from where, and what they make of a run."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, rig
from upright.closed_loop.structures import ClosedLoop
from upright.errors import BadInput
from upright.identification import GreyBox, Parameter, Run
from upright.identification.problem.residuals import Problem, formulate, idle, unreached, unresolved
from upright.identification.problem.simulated import with_noise
from upright.identification.problem.tracks import nearest_equilibrium, prepare
from upright.identification.problem.unknowns import Unknown, friction_names, matters, shared_unknowns
from upright.laws import state_feedback
from upright.physics import CartPendulum, Furuta, Pendulum, find

CART = find("rectilinear-1")
DT, N = 0.01, 500
VALUES = {"m_1": 2.0, "k_1": 50.0, "c_1": 1.0, "f_1c": 0.1}


def swung(**about: Any) -> Run:
    t = DT * np.arange(N)
    base: dict[str, Any] = {"label": "run", "role": "fit", "t": t, "u": np.zeros((N, 1)), "measured": ("x_1",)}
    return Run(**{**base, "y": 0.3 * np.cos(5 * t)[:, None], **about})


def sought(name: str, **fields: Any) -> Unknown:
    """One parameter of a cart's rig, as it is sought."""
    p = Parameter(**{"name": name, "value": 4.0, "estimate": True, **fields})
    numbers = {n: Parameter(name=n, value=v) for n, v in VALUES.items()} | {name: p}
    (found,) = shared_unknowns(GreyBox(plant=CART, parameters=numbers))
    return found


@pytest.mark.parametrize(
    ("name", "fields", "log", "lower", "upper", "scale"),
    [
        ("m_1", {}, True, 4e-9, 4e9, 1.0),  # a mass is positive
        ("m_1", {"lower": 1.0, "upper": 5.0}, True, 1.0, 5.0, 1.0),
        ("k_1", {}, False, 0.0, math.inf, 4.0),  # a stiffness may vanish
        ("c_1", {"value": 0.0}, False, 0.0, math.inf, 1e-3),
        ("c_1", {"value": 9.0, "upper": 5.0}, False, 0.0, 5.0, 5.0),
        ("actuator.gain", {"value": -4.0}, False, -math.inf, math.inf, 4.0),
        ("actuator.gain", {"value": 0.0}, False, -math.inf, math.inf, 1.0),
        ("actuator.slope", {}, False, 0.0, math.inf, 4.0),
        ("actuator.lag", {"value": 0.0}, False, 0.0, math.inf, 5e-3),
        ("actuator.delay", {"value": 0.0}, False, 0.0, math.inf, 5e-3),
        ("actuator.offset", {"value": 0.0}, False, -math.inf, math.inf, 1e-2),
        ("actuator.start", {}, False, -math.inf, math.inf, 0.1),
        ("actuator.end", {}, False, -math.inf, math.inf, 0.1),
        ("actuator.knee", {}, True, 4e-9, 4e9, 1.0),
        ("actuator.force_limit", {}, True, 4e-9, 4e9, 1.0),
        ("noise.x_1", {"lower": -5.0}, True, 4e-9, 4e9, 1.0),
    ],
)
def test_a_number_is_sought_in_the_coordinate_that_suits_it(
    name: str, fields: dict[str, float], log: bool, lower: float, upper: float, scale: float
) -> None:
    u = sought(name, **fields)
    value = min(max(fields.get("value", 4.0), lower), upper)
    assert (u.log, u.lower, u.upper, u.scale) == (log, pytest.approx(lower), pytest.approx(upper), scale)
    assert (u.value, u.estimated, u.prior, u.shared, u.group) == (value, True, None, True, "")
    assert u.coordinate(u.value) == pytest.approx(math.log(value) if log else value)
    ends = (math.log(lower), math.log(upper)) if log else (lower, upper)
    assert u.bounds == pytest.approx(ends)


def test_what_is_known_within_a_tolerance_is_sought_but_not_asked() -> None:
    mass = sought("m_1", estimate=False, uncertainty=0.2)
    assert (mass.estimated, mass.prior) == (False, (pytest.approx(math.log(4.0)), pytest.approx(0.05)))
    spring = sought("k_1", estimate=False, uncertainty=0.2)
    assert (spring.estimated, spring.prior, spring.scale) == (False, (4.0, 0.2), 4.0)
    none = sought("c_1", estimate=False, uncertainty=0.2, value=0.0)
    assert (none.prior, none.scale) == ((0.0, 0.2), 0.2)
    known = {n: Parameter(name=n, value=v) for n, v in VALUES.items()}
    assert shared_unknowns(GreyBox(plant=CART, parameters=known)) == []


def test_an_open_bound_has_no_logarithm() -> None:
    u = Unknown(name="m", runs=(), value=1.0, lower=0.0, upper=math.inf, log=True, scale=1.0)
    assert u.bounds == (-math.inf, math.inf)


def posed(run: Run, *asked: str) -> Problem:
    numbers = {n: Parameter(name=n, value=v, estimate=n in asked) for n, v in VALUES.items()}
    numbers |= {n: Parameter(name=n, value=v) for n, v in (("actuator.gain", 3.0), ("actuator.offset", 0.2))}
    return formulate(GreyBox(plant=CART, parameters=numbers), [run], thin=False)


def own(run: Run) -> dict[str, Unknown]:
    return {u.name: u for u in posed(run).unknowns}


def test_a_first_state_is_known_as_well_as_it_was_measured() -> None:
    """Of a swing of 0.3 m and 1.5 m/s: a fiftieth of how the place varies, a tenth of how the speed does."""
    found = own(swung())
    assert set(found) == {"initial.x_1", "initial.x_1_dot"}
    place, speed = found["initial.x_1"], found["initial.x_1_dot"]
    spread = 0.3 / math.sqrt(2)
    assert (place.value, speed.value) == (pytest.approx(0.3, abs=1e-3), pytest.approx(0.0, abs=0.02))
    assert (place.scale, speed.scale) == (pytest.approx(spread, rel=0.03), pytest.approx(5 * spread, rel=0.03))
    assert place.prior == (place.value, pytest.approx(0.02 * place.scale))
    assert speed.prior == (speed.value, pytest.approx(0.1 * speed.scale))
    assert set(own(swung(initial={"x_1": 0.3}))) == {"initial.x_1_dot"}
    assert own(swung(horizon=0.5)) == {}
    assert own(swung(unknown=())) == {}
    free = own(swung(unknown=("initial", "scale.x_1")))
    assert free["initial.x_1"].prior is None


def test_factors_and_offsets_start_from_none_with_their_spread() -> None:
    names = ("gain", "friction", "scale.x_1", "offset.x_1", "input_offset")
    u = np.sin(DT * np.arange(N))[:, None]
    found = own(swung(unknown=names, u=u, spread={"gain": 0.4}))
    priors = {"gain": 0.4, "friction": 0.3, "scale.x_1": 1.0}
    for name, sigma in priors.items():
        f = found[name]
        assert (f.value, f.log, f.prior, f.lower, f.upper) == (1.0, True, (0.0, sigma), 0.0, math.inf)
    assert found["offset.x_1"].value == found["input_offset"].value == 0.0
    assert found["offset.x_1"].scale == pytest.approx(0.3 / math.sqrt(2), rel=0.03)
    assert found["input_offset"].scale == pytest.approx(float(np.std(u)))
    assert own(swung(unknown=names))["input_offset"].scale == 1.0
    assert "offset.x_1" in own(swung(unknown=("offset",)))  # the spring feels where the cart is
    assert "offset.x_1" not in own(swung(unknown=("offset",), held={"x_1": 0.0}))
    shared = own(swung(unknown=(), shared={"friction": "Monday"}))
    assert shared["friction"].group == "Monday"


@pytest.mark.parametrize(
    ("guesses", "start", "end"),
    [
        ({}, (1.01, 1.0, 3.0), (2.99, 1.0, 3.0)),
        ({"input_end": 2.0}, (1.01, 1.0, 3.0), (2.0, 1.0, 3.0)),
        ({"input_end": 2.99}, (1.01, 1.0, 3.0), (2.99, 2.74, 3.0)),
        ({"input_start": 1.005, "input_end": 0.2}, (1.005, 1.0, 1.255), (1.0, 1.0, 3.0)),
    ],
)
def test_a_drive_acts_within_its_command(
    guesses: dict[str, float], start: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    """A command from 1 s to 3 s, sought from a sample inside; near a guess that is the log's own, within 0.25 s."""
    t = DT * np.arange(N)
    u = np.where((t > 0.995) & (t < 2.995), 1.0, 0.0)[:, None]
    found = own(swung(u=u, unknown=("input_start", "input_end"), guesses=guesses))
    for name, told in (("input_start", start), ("input_end", end)):
        x = found[name]
        assert (x.value, x.lower, x.upper) == pytest.approx(told)
        assert (x.scale, x.log) == (0.1, False)
    assert set(own(swung(unknown=("input_start",)))) == set()  # nothing is commanded


def test_a_zero_that_nothing_feels_is_sought_where_a_law_reads_it() -> None:
    """A cart without a spring may stand anywhere, but for the law that pulls it to where its sensor reads zero."""
    numbers = {n: Parameter(name=n, value=v) for n, v in {"m_1": 2.0, "k_1": 0.0}.items()}
    free = GreyBox(plant=CART, parameters=numbers)
    run = swung(unknown=("offset",))
    assert formulate(free, [run]).unknowns == []
    loop = ClosedLoop(law=state_feedback([-6.0, -1.8], DT, measured=("x_1",)))
    assert [u.name for u in formulate(free, [replace(run, loop=loop)]).unknowns] == ["offset.x_1"]


def test_own_numbers_act_where_they_belong() -> None:
    """The cart without spring and friction: each changes the motion by hand as it does here."""
    t = DT * np.arange(N)
    names = ("gain", "scale.x_1", "offset.x_1", "input_offset")
    run = swung(u=np.ones((N, 1)), unknown=("initial", *names), initial={"x_1_dot": 0.1})
    numbers = {n: Parameter(name=n, value=v) for n, v in {"m_1": 2.0, "k_1": 0.0, "actuator.gain": 3.0}.items()}
    numbers["actuator.offset"] = Parameter(name="actuator.offset", value=0.2)
    problem = formulate(GreyBox(plant=CART, parameters=numbers), [run], thin=False)
    chosen = {"initial.x_1": 0.4, "gain": 1.5, "scale.x_1": 1.1, "offset.x_1": -0.05, "input_offset": 0.3}
    x = problem.place({f"run: {n}": v for n, v in chosen.items()})
    assert problem.values_at(x) == pytest.approx({f"run: {n}": v for n, v in chosen.items()})
    y = problem.simulate(0, x[:, None], N)[:, 0, 0, 0]
    acceleration = 3.0 * 1.5 * (1.0 + 0.2 + 0.3) / 2.0
    assert y == pytest.approx(1.1 * (0.4 + 0.1 * t + acceleration * t**2 / 2) - 0.05, rel=1e-6)


def test_what_the_sensors_are_off_by_is_taken_off_the_state_where_it_restarts() -> None:
    """A reading of y = 1.1 q - 0.05 restarted there shows itself again."""
    t = DT * np.arange(N)
    run = swung(y=(0.2 + 0.1 * t)[:, None], unknown=("scale.x_1", "offset.x_1"), horizon=1.0)
    numbers = {n: Parameter(name=n, value=v) for n, v in {"m_1": 2.0, "k_1": 0.0}.items()}
    problem = formulate(GreyBox(plant=CART, parameters=numbers), [run], thin=False)
    x = problem.place({"run: scale.x_1": 1.1, "run: offset.x_1": -0.05})
    y = problem.simulate(0, x[:, None], problem.tracks[0].length)[:, :, 0, 0]
    starts = problem.tracks[0].restarts
    assert starts.tolist() == [0, 100, 200, 300]
    rows = starts[None, :] + np.arange(101)[:, None]
    # the speed is divided by the gain and shown multiplied by it
    assert y == pytest.approx(run.y[rows, 0], abs=1e-9)


def test_a_friction_factor_multiplies_all_that_rubs() -> None:
    assert friction_names(posed(swung()).rig) == ("c_1", "f_1c", "f_1q", "f_1s")
    run = swung(unknown=("friction",), initial={"x_1": 0.3, "x_1_dot": 0.0})
    twice = posed(run).place({"run: friction": 2.0})
    problem = posed(run)
    there = problem.simulate(0, twice[:, None], N)[:, 0, 0, 0]
    numbers = dict(problem.rig.parameters)
    numbers |= {n: replace(numbers[n], value=2 * VALUES[n]) for n in ("c_1", "f_1c")}
    other = formulate(replace(problem.rig, parameters=numbers), [replace(run, unknown=())], thin=False)
    assert there == pytest.approx(other.simulate(0, np.zeros((0, 1)), N)[:, 0, 0, 0], abs=1e-9)


def test_a_coordinate_matters_where_gravity_or_a_spring_feels_it() -> None:
    assert matters(posed(swung()).rig, "x_1")
    furuta = rig(Furuta, FURUTA, {})
    assert [matters(furuta, c) for c in ("psi", "theta")] == [False, True]
    assert not matters(furuta, "theta", by=2 * math.pi)
    assert not matters(rig(CART, {"m_1": 1.0, "k_1": 0.0}, {}), "x_1")
    assert matters(rig(CART, {"m_1": 1.0}, {"k_1": 0.0}), "x_1")  # a stiffness that is asked counts


def test_runs_of_one_group_share_one_number_that_a_prediction_is_given() -> None:
    runs = [swung(label=label, unknown=(), shared={"friction": day}) for label, day in zip("abc", "xyx", strict=True)]
    rig_ = posed(swung()).rig
    problem = formulate(rig_, runs)
    assert [(u.name, u.group, u.runs) for u in problem.unknowns] == [("friction", "x", (0, 2)), ("friction", "y", (1,))]
    assert [problem.key(i) for i in range(2)] == ["group x: friction", "group y: friction"]
    assert [problem.sought_in(i).tolist() for i in range(3)] == [[0], [1], [0]]
    given = formulate(rig_, runs[:1], stated={"x": {"friction": 1.3}, "y": {"friction": 9.0}})
    assert [(u.value, u.lower, u.upper) for u in given.unknowns] == [(1.3, 1.3, 1.3)]


@pytest.mark.parametrize(("resolution", "lower"), [((0.01,), 0.01 / math.sqrt(12)), ((), 0.0)])
def test_a_presliding_length_is_no_shorter_than_the_rounding_that_sees_it(
    resolution: tuple[float, ...], lower: float
) -> None:
    numbers = {n: Parameter(name=n, value=v) for n, v in VALUES.items()}
    numbers["delta_1"] = Parameter(name="delta_1", value=1e-4, unit="m", estimate=True, lower=0.0)
    problem = formulate(GreyBox(plant=CART, parameters=numbers), [swung(resolution=resolution, unknown=())])
    (u,) = problem.unknowns
    assert (u.lower, u.value) == (pytest.approx(lower, abs=1e-8), pytest.approx(max(lower, 1e-4)))
    if resolution:
        assert unresolved(problem, problem.start) == ("delta_1",)
        assert unresolved(problem, problem.place({"delta_1": 1.001 * lower})) == ()


def test_a_limit_that_no_run_reaches_leaves_the_cost_as_it_is() -> None:
    """The drive gives 3 N at most here: a limit of 4 N is idle, one of 2 N is not."""
    for limit, no_matter in ((4.0, ("actuator.force_limit",)), (2.0, ())):
        numbers = {n: Parameter(name=n, value=v) for n, v in VALUES.items()}
        numbers["actuator.gain"] = Parameter(name="actuator.gain", value=3.0)
        numbers["actuator.force_limit"] = Parameter(name="actuator.force_limit", value=limit, estimate=True)
        run = swung(u=np.sin(3 * DT * np.arange(N))[:, None], unknown=())
        free = formulate(GreyBox(plant=CART, parameters={**numbers, "actuator.force_limit": replace(
            numbers["actuator.force_limit"], estimate=False)}), [run], thin=False)  # fmt: skip
        y = free.simulate(0, np.zeros((0, 1)), N)[:, 0, :, 0]
        problem = formulate(
            GreyBox(plant=CART, parameters=numbers), [replace(run, y=y + 1e-3 * np.cos(DT * np.arange(N))[:, None])]
        )
        assert unreached(problem, problem.start) == no_matter


@pytest.mark.parametrize(("damping", "unseen"), [(0.0, {"actuator.relaxation": "actuator.damping"}), (0.4, {})])
def test_in_how_much_time_a_braking_of_nothing_builds_up_leaves_the_cost_as_it_is(damping, unseen) -> None:
    numbers = {n: Parameter(name=n, value=v) for n, v in VALUES.items()}
    numbers["actuator.damping"] = Parameter(name="actuator.damping", value=damping)
    numbers["actuator.relaxation"] = Parameter(name="actuator.relaxation", value=0.3)
    run = swung(u=np.sign(np.sin(3 * DT * np.arange(N)))[:, None] * (DT * np.arange(N) < 3)[:, None], unknown=())
    known = formulate(GreyBox(plant=CART, parameters=numbers), [run], thin=False)
    y = known.simulate(0, np.zeros((0, 1)), N)[:, 0, :, 0]
    for name in ("actuator.damping", "actuator.relaxation"):
        numbers[name] = replace(numbers[name], estimate=True, lower=0.0)
    noisy = replace(run, y=y + 1e-4 * np.cos(DT * np.arange(N))[:, None])
    problem = formulate(GreyBox(plant=CART, parameters=numbers), [noisy])
    assert idle(problem, problem.start) == unseen


def test_the_nearest_equilibrium_counts_turns_from_the_record() -> None:
    asked = rig(Furuta, FURUTA, {})
    t = DT * np.arange(200)
    for mean, told in ((3.3, math.pi), (0.4, 0.0), (2 * math.pi - 0.3, 2 * math.pi), (3 * math.pi + 0.2, 3 * math.pi)):
        y = np.column_stack([0.7 + 0 * t, mean + 0.1 * np.sin(9 * t)])
        run = Run(label="r", role="fit", t=t, u=np.zeros((200, 1)), y=y, measured=("psi", "theta"))
        assert nearest_equilibrium(asked, run) == pytest.approx([0.7, 0.0, told, 0.0], abs=1e-6)
    held = replace(run, y=y[:, 1:], measured=("theta",), held={"psi": -0.2})
    assert nearest_equilibrium(asked, held)[0] == pytest.approx(-0.2)


def filtered(**about: Any) -> Run:
    t = DT * np.arange(2000)
    y = np.column_stack([0.02 * np.sin(t), 0.1 * np.cos(5 * t)])
    base = {"label": "r", "role": "fit", "t": t, "u": 2.0 * np.sin(3 * t)[:, None], "y": y, "unknown": ()}
    return Run(**{**base, "measured": ("x", "theta"), "horizon": (0.5, 0.1), "restart": "kalman", **about})


CRANE = {"m_c": 0.4, "m_p": 0.3, "l_cg": 0.3, "J_p": 5e-3, "b_2": 5e-3}


def test_a_filter_plans_its_horizons_its_warming_up_and_what_it_begins_with() -> None:
    asked = rig(CartPendulum, CRANE, {})
    track = prepare(asked, filtered(resolution=(0.0, 0.012), score_from=3.0), thin=True)
    plan = track.ahead
    assert plan is not None
    assert (plan.samples, plan.warm) == ((10, 50), 200)
    assert track.restarts.tolist() == list(range(300, 1950, 10))
    assert plan.weight == pytest.approx([1.0, 0.2**1.5])
    assert plan.sensor[1] == pytest.approx(0.012**2 / 12)
    assert plan.sensor[0] < 1e-6 * 0.02**2
    assert plan.drift == pytest.approx([(0.003 * float(np.std(track.run.u))) ** 2])
    assert plan.initial[[0, 2]] == pytest.approx(plan.sensor)
    assert plan.initial[1] == pytest.approx(0.02**2 / 2, rel=0.1)  # of speeds the whole spread
    assert plan.initial[3] == pytest.approx(0.5**2 / 2, rel=0.1)
    assert (track.length, track.spacing, track.duration) == (2, pytest.approx(0.1), pytest.approx(0.5))
    assert [track.within(h) for h in (0.05, 0.1, 0.3, 0.5, math.inf)] == [1, 1, 1, 2, 2]
    assert prepare(asked, filtered(), thin=True).restarts[0] == 200
    rows = track.targets(2)
    assert rows[0, 0] == pytest.approx(track.y[310])
    assert rows[1, 0] == pytest.approx(track.y[350] * 0.2**1.5)


def test_a_filter_refuses_what_it_cannot_follow() -> None:
    asked = rig(CartPendulum, CRANE, {})
    with pytest.raises(BadInput, match="holds x in motion"):
        prepare(asked, filtered(held={"x": np.zeros(2000)}), thin=True)
    with pytest.raises(BadInput, match=r"lasts 2\.5 s; a filter that warms up for 2 s and looks 0\.5 s ahead"):
        prepare(asked, filtered().samples(slice(250)), thin=True)
    with pytest.raises(BadInput, match="several horizons"):
        prepare(asked, filtered(restart="smooth"), thin=True)
    assert prepare(asked, filtered().samples(slice(261)), thin=True).restarts.tolist() == [200, 210]


def test_noise_is_sought_where_a_filter_meets_it() -> None:
    """A twentieth of the force that moves a coordinate by its spread within a horizon; a tenth of a command's drift."""
    asked = rig(CartPendulum, CRANE, {})
    told = with_noise(asked, [filtered(), filtered(u=np.zeros((2000, 1)))])
    new = {n: p for n, p in told.parameters.items() if n not in asked.parameters}
    assert set(new) == {"noise.x", "noise.theta", f"noise.{CartPendulum.inputs[0].name}"}
    assert all(p.estimate and p.lower == 0.0 for p in new.values())
    y = filtered().y
    inertia = CRANE["J_p"] + CRANE["m_p"] * CRANE["l_cg"] ** 2
    for name, mass, k, unit in (("noise.x", 0.7, 0, "N s^(1/2)"), ("noise.theta", inertia, 1, "N m s^(1/2)")):
        expected = 0.05 * mass * float(np.std(y[:, k])) / 0.1**2 * math.sqrt(0.1)
        assert (new[name].value, new[name].unit) == (pytest.approx(expected), unit)
    drift = new[f"noise.{CartPendulum.inputs[0].name}"]
    assert drift.value == pytest.approx(0.1 * 0.003 * float(np.std(filtered().u)))
    assert drift.unit == "1 s^(-1/2)"
    assert with_noise(told, [filtered()]) is told
    assert with_noise(asked, [filtered(horizon=None)]) is asked
    assert "noise.x" not in with_noise(asked, [filtered(held={"x": 0.0})]).parameters
    still = with_noise(asked, [filtered(u=np.ones((2000, 1)))])
    assert not any(n.startswith("noise.F") for n in still.parameters)


@pytest.mark.parametrize("fold", [0, 1, 2])
def test_every_third_of_nine_blocks_judges_the_others(fold: int) -> None:
    asked = rig(Pendulum, PENDULUM, {"b_2": 1e-3})
    t = DT * np.arange(900)
    run = Run(label="r", role="fit", t=t, u=np.sin(t)[:, None], y=np.cos(5 * t)[:, None], measured=("theta",))
    judges, rest = prepare(asked, run, thin=False).hidden(fold)
    expected = [(100 * (fold + 3 * k), 100 * (fold + 3 * k + 1)) for k in range(3)]
    assert np.flatnonzero(judges).tolist() == [i for a, b in expected for i in range(a, b)]
    assert rest.retained is not None
    assert np.array_equal(rest.retained, ~judges)
    windows, fewer = prepare(asked, replace(run, horizon=0.1), thin=False).hidden(fold)
    assert (windows.sum(), windows.size) == (fewer.restarts.size and windows.size - fewer.restarts.size, 89)
    assert len(fewer.x0) == len(fewer.variance) == fewer.restarts.size
    short, same = prepare(asked, run.samples(slice(199)), thin=False).hidden(fold)
    assert not short.any()
    assert same.retained is None
    assert prepare(asked, run.samples(slice(200)), thin=False).hidden(fold)[0].any()


def test_a_free_run_is_cut_to_a_horizon_and_counts_from_where_it_is_scored() -> None:
    asked = rig(Pendulum, PENDULUM, {"b_2": 1e-3})
    t = DT * np.arange(900)
    run = Run(label="r", role="fit", t=t, u=np.sin(t)[:, None], y=np.cos(5 * t)[:, None], measured=("theta",))
    track = prepare(asked, replace(run, score_from=1.995), thin=False)
    assert (track.first, track.duration, track.spacing) == (200, pytest.approx(8.99), pytest.approx(DT))
    assert [track.within(h) for h in (0.0, 0.005, 1.0, 8.98, 8.99, 99.0)] == [2, 2, 101, 899, 900, 900]
    assert track.weights == pytest.approx([math.sqrt(2)], rel=0.02)
    y = track.y[:, None] + 0.1
    assert track.errors(y)[:, 0, 0] == pytest.approx(0.1 * track.weights[0])
    assert len(track.errors(y)) == 700
    assert prepare(asked, replace(run, horizon=0.5, score_from=2.0), thin=False).first == 0
    windows = prepare(asked, replace(run, horizon=0.5), thin=False)
    assert (windows.length, windows.restarts[1], windows.within(0.1)) == (51, 50, 51)
