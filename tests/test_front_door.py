"""The front door: what a notebook types, what it sees, and what `import upright` costs."""

from __future__ import annotations

import json
import subprocess
import sys

import control
import numpy as np
import pandas as pd
import pytest

import upright as up
from upright.cli import COMMANDS
from upright.files import plain_values

TRUTH = {"m_p": 0.2235, "l_cg": 0.2, "J_p": 2e-3, "b_2": 2e-4, "b_2c": 4e-4}
FURUTA = {"m_p": 0.135, "l_cg": 0.19, "r": 0.16, "J_d": 0.011, "J_p": 6e-4}
POLES = [-4 + 2j, -4 - 2j, -17, -3]


def swing(tilt: str, seconds: float = 20.0) -> pd.DataFrame:
    """Angle of a pendulum let go, as a program would log it: rounded to 1e-4 rad."""
    run = up.simulate(up.Pendulum(**TRUTH), start={"theta": tilt}, seconds=seconds, dt=5e-3)
    return run.to_pandas()[["theta"]].round(4)


@pytest.fixture(scope="module")
def log_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "swing.csv"
    swing("60 deg").rename(columns={"theta": "theta [rad]"}).to_csv(path, index_label="time [s]")
    return path


@pytest.fixture(scope="module")
def fit(log_file):
    log = up.read(log_file)
    known = {"m_p": TRUTH["m_p"], "J_p": TRUTH["J_p"]}
    return up.identify(log, up.Pendulum, known=known, ask=["l_cg", "b_2", "b_2c"], columns={"theta": log.names[0]})


def test_the_fit_of_a_file_holds_the_truth_in_its_intervals(fit):
    table = fit.parameters
    assert list(table.columns) == ["value", "stderr", "low", "high", "unit", "status"]
    assert set(table.index) == {"l_cg", "b_2", "b_2c"}
    # the period fixes m l/(J + m l^2) to the rounding of the log: 1e-4 rad over 20 s
    assert table.value["l_cg"] == pytest.approx(TRUTH["l_cg"], rel=1e-4)
    assert ((table.low <= table.value) & (table.value <= table.high)).all()
    # viscous and dry friction trade against each other; together they take the energy that was lost
    assert table.value["b_2"] == pytest.approx(TRUTH["b_2"], rel=0.05)
    assert table.value["b_2c"] == pytest.approx(TRUTH["b_2c"], rel=0.05)


def test_a_fit_shows_its_verdict_intervals_and_units(fit):
    for shown in (repr(fit), fit._repr_html_()):
        assert "l_cg" in shown
        assert "95 % interval" in shown
        assert fit.answers[0].headline in shown
    assert "<table" in fit._repr_html_()
    assert "<svg" in fit._repr_html_()
    assert "actuator" not in repr(fit)


def test_a_fit_predicts_another_swing_and_knows_a_different_rig(fit):
    same = fit.predict(swing("40 deg", 10.0))
    assert min(same.runs["log"].fit_percent.values()) > 99
    other = up.simulate(up.Pendulum(**{**TRUTH, "l_cg": 0.25}), start={"theta": "40 deg"}, seconds=10.0, dt=5e-3)
    assert max(fit.predict(other.to_pandas()[["theta"]]).runs["log"].fit_percent.values()) < 50
    assert len(same.plot().axes) >= 2


@pytest.mark.slow
def test_a_fit_goes_to_a_file_that_the_commands_read(fit, tmp_path):
    from upright.study.stored_fit import read_fit

    assert read_fit(fit.save(tmp_path / "fit.json")).values["l_cg"] == fit.parameters.value["l_cg"]
    assert json.loads((tmp_path / "fit.json").read_text(encoding="utf-8")) == plain_values(fit.numbers)
    page = fit.report(tmp_path / "fit.html").read_text(encoding="utf-8")
    assert fit.answers[0].headline in page
    with pytest.raises(up.BadInput, match=r"ending in \.html or \.pdf"):
        fit.report(tmp_path / "fit.doc")


def test_a_record_a_frame_and_a_study_give_the_same_fit(fit, tmp_path):
    frame = swing("60 deg")
    known = {"m_p": TRUTH["m_p"], "J_p": TRUTH["J_p"]}
    again = up.identify(frame, "pendulum", known=known, ask=["l_cg", "b_2", "b_2c"])
    assert again.parameters.value["l_cg"] == pytest.approx(fit.parameters.value["l_cg"], rel=1e-5)
    study = tmp_path / "swing.toml"
    frame.to_csv(tmp_path / "log.csv", index_label="t")
    study.write_text(
        '[rig]\nplant = "pendulum"\n[parameters]\nm_p = 0.2235\nJ_p = 2e-3\nl_cg = { guess = 0.25 }\n'
        'b_2 = { guess = 1e-4 }\nb_2c = { guess = 1e-4 }\n[sensors.theta]\ncolumn = "theta"\nunit = "rad"\n'
        '[[runs]]\nfile = "log.csv"\nunknown = ["initial", "offset"]\n',
        encoding="utf-8",
    )
    assert up.identify(study).parameters.value["l_cg"] == pytest.approx(TRUTH["l_cg"], rel=1e-4)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"known": {"m": 1.0}}, "has no number 'm'"),
        ({"known": {"m_p": 1.0}, "ask": ["m_p"]}, "known and estimated at once"),
        ({"ask": ["l_cgg"]}, "did you mean 'l_cg'"),
        ({"columns": {"theta": "angle"}}, "no column 'angle'"),
        ({"units": {"angle": "deg"}}, "units names columns"),
        ({"method": "newton"}, "there is no 'newton'"),
        ({"plant": 3}, "a plant such as up.Pendulum"),
        ({"plant": "pendulumm"}, "no plant is called"),
    ],
)
def test_a_wrong_argument_of_identify_gets_one_sentence(options, sentence):
    plant = options.pop("plant", up.Pendulum)
    with pytest.raises(up.BadInput, match=sentence):
        up.identify(swing("10 deg", 5.0), plant, **options)


def test_a_log_that_is_none_is_named():
    with pytest.raises(up.BadInput, match="a Record or a pandas DataFrame"):
        up.identify(3.0)


@pytest.mark.parametrize("given", ["linear", "pair", "control", "transfer"])
def test_place_takes_every_kind_of_model_and_moves_its_poles(given):
    model = up.Furuta(**FURUTA).linear("inverted")
    system = {
        "linear": lambda: model, "pair": lambda: (model.A, model.B), "control": model.to_control,
        "transfer": lambda: control.ss2tf(model["theta", "T"].to_control()),
    }[given]()  # fmt: skip
    gains = up.place(system, POLES)
    closed = np.linalg.eigvals(gains.model.A - gains.model.B @ gains)  # numpy takes gains for the array K
    assert np.sort_complex(closed) == pytest.approx(np.sort_complex(np.array(POLES)), abs=1e-6)
    assert pytest.approx(gains.K) == up.place(system, "-4+-2j, -17, -3").K
    if given in ("linear", "control"):
        assert gains.states == ("psi", "psi_dot", "theta", "theta_dot")


@pytest.mark.parametrize("period", [None, "2 ms"])
def test_python_control_takes_a_model_unpacked_or_converted(period):
    """Its poles and its answer at a frequency are ours; `control.ss(model)` is refused by python-control itself."""
    model = up.Furuta(**FURUTA).linear("inverted")
    if period is not None:
        model = up.hold(model, period)
    for theirs in (control.ss(*model), model.to_control()):
        assert np.sort_complex(theirs.poles()) == pytest.approx(np.sort_complex(model.poles()), abs=1e-9)
        at = 1j * 5.0 if model.dt is None else np.exp(5j * model.dt)
        by_hand = model.C @ np.linalg.solve(at * np.eye(4) - model.A, model.B) + model.D
        np.testing.assert_allclose(theirs(at), by_hand, rtol=1e-9)
        assert theirs.dt == (model.dt or 0)
    assert "control.ss(*model)" in up.StateSpace.__doc__
    assert "to_control" in up.StateSpace.__doc__


def test_least_cost_agrees_with_python_control():
    control = pytest.importorskip("control")
    model = up.Furuta(**FURUTA).linear("inverted")
    Q, R = np.diag([1.0, 0.0, 10.0, 0.0]), np.array([[2.0]])
    K, S, E = up.lqr(model, Q, R)
    K_c, S_c, E_c = control.lqr(model.to_control(), Q, R)
    assert pytest.approx(K_c, rel=1e-6) == K
    assert pytest.approx(S_c, rel=1e-6) == S
    assert np.sort_complex(E) == pytest.approx(np.sort_complex(E_c), rel=1e-6)
    assert pytest.approx(K_c, rel=1e-6) == up.lqr((model.A, model.B), [1, 0, 10, 0], 2.0).K
    sampled = control.c2d(model.to_control(), 0.01)
    assert pytest.approx(control.dlqr(sampled, Q, R)[0], rel=1e-6) == up.lqr(sampled, Q, R).K


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda m: up.place(), r"place\(model, poles\): missing a required argument: 'model'"),
        (lambda m: up.place(m), "missing a required argument: 'poles'"),
        (lambda m: up.place(m, [-1, -2]), "poles"),
        (lambda m: up.place(up.Furuta(**FURUTA), POLES), r'\.linear\("inverted"\)'),
        (lambda m: up.place(([[0, 1], [1, 0]], [[1], [2], [3]]), [-1, -2]), "shape"),
        (lambda m: up.lqr(m, [1, 2], 1.0), "Q needs shape"),
        (lambda m: up.lqr(m, "a,b,c,d", 1.0), "Q takes numbers"),
        (lambda m: up.simulate(up.Furuta), "a plant with numbers"),
        (lambda m: up.simulate(up.Furuta(**FURUTA), start={"thetaa": 1}), "did you mean 'theta'"),
        (lambda m: up.simulate(up.Furuta(**FURUTA), [1, 2]), "need shape"),
        (lambda m: up.simulate(up.Furuta(**FURUTA), seconds=-1), "above 0"),
        (lambda m: up.simulate(up.Furuta(**FURUTA), start=[0.1, 0]), "or 4 numbers: psi, psi_dot, theta, theta_dot"),
        (lambda m: up.simulate(up.Furuta(**FURUTA), up.place(m, POLES), at="hanging"), "which is inverted"),
        (lambda m: up.simulate(up.Furuta(**FURUTA), slow(m), dt=1e-3), "for a period of 20 ms, and dt is 1 ms"),
        (lambda m: up.Pendulum(m_p="100 m", l_cg=0.1), "mass of the pendulum|kg"),
        (lambda m: up.Pendulum(m_p=None, l_cg=0.1), "a number in kg or a text with its unit"),
        (lambda m: up.survey(3), "a CSV file or a pandas DataFrame"),
        (lambda m: up.observer(m, [0.1]), "hold\\(model, period\\)"),
        (lambda m: up.simulate(up.Furuta(**FURUTA), actuator={"gian": 1}), "did you mean 'gain'"),
        (lambda m: up.chance(3, [1, 2, 3, 4]), "what up.identify answered"),
    ],
)
def test_a_wrong_argument_gets_one_sentence(call, sentence):
    with pytest.raises(up.BadInput, match=sentence):
        call(up.Furuta(**FURUTA).linear("inverted"))


def slow(model):
    """Gains for the model at samples of 20 ms."""
    return up.place(up.hold(model, "20 ms"), np.exp(0.02 * np.array(POLES)))


def test_gains_of_a_sampled_model_close_the_loop_about_its_point_at_its_period():
    """Poles in z are those of the motion from sample to sample: 20 ms decay as exp(-3 t) in the end."""
    rig = up.Furuta(**FURUTA)
    run = up.simulate(rig, slow(rig.linear("inverted")), start=[0, 0, 1e-4, 0], seconds="4 s")
    assert run.period == pytest.approx(0.02)
    assert np.abs(run["theta"][-1] - np.pi) < 1e-4 * 20 * np.exp(-3 * 4)


def test_a_law_that_was_designed_upright_starts_and_stays_upright():
    rig = up.Furuta(**FURUTA)
    law = up.design(rig.linear("inverted"), poles="-4+-2j, -17, -3", period="5 ms", limit=5).law
    for at in (None, "inverted"):
        run = up.simulate(rig, law, at=at, start={"theta": "2 deg"}, seconds=4)
        assert run.period == pytest.approx(0.005)
        assert run["theta"][-1] == pytest.approx(np.pi, abs=1e-4)
    with pytest.raises(up.BadInput, match="regulates about"):
        up.simulate(rig, law, at="hanging")


def test_loose_matrices_are_read_for_one_version_with_a_warning():
    with pytest.deprecated_call(match="place\\(\\(A, B\\), ...\\)"):
        assert pytest.approx(np.array([[10.0, 5.0]])) == up.place([[0, 1], [4, 0]], [0, 1], [-2, -3]).K


def test_a_plant_takes_its_numbers_with_their_units():
    assert up.Pendulum(m_p="100 g", l_cg="20 cm", J_p=1e-3).parameters() == (
        up.Pendulum(m_p=0.1, l_cg=0.2, J_p=1e-3).parameters()
    )


def test_gains_unpack_as_python_controls_do():
    K, S, E = up.place(([[0, 1], [4, 0]], [0, 1]), [-2, -3])
    assert S is None  # no cost was minimised
    assert sorted(E.real) == pytest.approx([-3, -2])
    assert pytest.approx(np.array([[10.0, 5.0]])) == K


def test_effort_that_costs_nothing_settles_in_one_sample():
    """R = 0: the cost of a scalar model is least where the next state is 0, K = a/b, at the cost of this sample."""
    K, S, _ = up.dlqr(([[1.3]], [[0.5]]), [2.0], 0.0)
    assert (K[0, 0], S[0, 0]) == pytest.approx((2.6, 2.0))


def test_effort_that_costs_nothing_is_the_limit_of_effort_that_costs_little():
    """The Riccati difference equation with R = 0, run to its end, on a model of three states."""
    rng = np.random.default_rng(4)
    A, B, Q = rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), np.diag([1.0, 2.0, 0.5])
    X = Q
    for _ in range(500):
        X = Q + A.T @ X @ A - A.T @ X @ B @ np.linalg.solve(B.T @ X @ B, B.T @ X @ A)
    K, S, _ = up.dlqr((A, B), Q, [0.0, 0.0])
    np.testing.assert_allclose(S, X, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(K, np.linalg.solve(B.T @ X @ B, B.T @ X @ A), rtol=1e-8, atol=1e-10)


def test_a_survey_is_read_from_a_frame_as_from_its_file(tmp_path):
    pd = pytest.importorskip("pandas")
    frame = pd.DataFrame({"id": [1, 2, 3], "feedback pre": [1, 2, 2], "feedback post": [3, 3, 4]})
    frame.to_csv(tmp_path / "survey.csv", index=False)
    assert up.survey(frame).numbers["found"] == up.survey(tmp_path / "survey.csv").numbers["found"]


def test_a_small_motion_in_the_loop_decays_as_its_poles_say():
    rig = up.Furuta(**FURUTA)
    gains = up.place(rig.linear("inverted"), POLES)
    run = up.simulate(rig, gains, start={"theta": 1e-3}, seconds=2, dt=1e-4)
    model = rig.linear("inverted")
    values, vectors = np.linalg.eig(model.A - model.B @ gains)
    x = vectors @ (np.exp(np.outer(values, run.t)) * np.linalg.solve(vectors, [0, 0, 1e-3, 0])[:, None])
    # differences are late by half a sample of 0.1 ms, and the loop's fastest pole is 17/s
    assert run["theta"] - np.pi == pytest.approx(x[2].real, abs=1e-3 * 17 * 1e-4 * 4)
    assert run.units["theta"] == "rad"


def test_a_free_swing_keeps_its_energy():
    plant = up.Pendulum(m_p=0.2, l_cg=0.3, J_p=1e-3)
    run = up.simulate(plant, start={"theta": "90 deg"}, seconds=3)
    x = np.column_stack([run["theta"], run["theta_dot"]])
    assert np.ptp(plant.energy(x)) < 1e-9
    assert run["theta"][0] == pytest.approx(np.pi / 2)


def test_chance_asks_for_a_limit_in_the_unit_of_the_fit():
    """A Furuta pendulum known exactly: gains that hold are told from gains that do nothing."""
    plant = up.Furuta(**FURUTA)
    rng = np.random.default_rng(0)
    u = 0.05 * np.sin(np.cumsum(rng.uniform(0, 0.02, 2001)))
    log = up.simulate(plant, start={"theta": "20 deg"}, seconds=10, dt=5e-3, u=u)
    log = log.to_pandas()[["psi", "theta", "T"]].round(5)
    known = {n: v for n, v in FURUTA.items() if n != "J_d"} | {"b_1": "0 N m s/rad"}
    fit = up.identify(log, up.Furuta, known=known, ask={"J_d": "9e-3 kg m^2"})
    gains = up.place(fit.plant.linear("inverted"), POLES)
    with pytest.raises(up.BadInput, match=r"limit=10 .*period=\"2 ms\" ") as asked:
        up.chance(fit, gains)
    assert "counts" not in str(asked.value)  # five digits bound what an encoder's steps could be
    told = {
        "tilt": "3 deg",
        "push": 0.0,
        "limit": 0.6,
        "period": "1 ms",
        "counts": (4096, 4096),
        "draws": 16,
        "seconds": 2.0,
    }
    assert up.chance(fit, gains, **told).numbers["chance"] == 1.0
    assert up.chance(fit, 0.0 * gains.K, **told).numbers["chance"] == 0.0


def test_what_is_shown_wears_units_and_draws():
    plant = up.Furuta(**FURUTA)
    model = plant.linear("inverted")
    run = up.simulate(plant, start={"theta": 1.0}, seconds=1.0)
    for value, words in ((plant, "kg m²"), (model, "theta_dot'"), (up.place(model, POLES), "Poles of the loop"),
                         (run, "measured")):  # fmt: skip
        assert words in repr(value)
        assert "<table" in value._repr_html_()
        assert value.plot().axes
    assert len(run.plot("theta", "T").axes) == 2
    with pytest.raises(up.BadInput, match="did you mean 'theta'"):
        run.plot("thetaa")
    assert len(list(run.animate().new_frame_seq())) == 25
    assert list(up.place(model, POLES).to_pandas().columns) == list(model.states)


def test_dir_offers_every_verb_of_the_command_line():
    verbs = {name.replace("-", "_") for name in COMMANDS}
    assert verbs <= set(dir(up))
    assert all(callable(getattr(up, name)) for name in verbs)
    assert all(getattr(up, name).__doc__ for name in verbs)
    rooms = {name for name in dir(up) if hasattr(getattr(up, name), "__path__")}
    assert rooms == set()


def test_importing_upright_brings_nothing_heavy():
    code = (
        "import sys, upright; dir(upright);"
        "print([n for n in ('numpy', 'llvmlite', 'sympy', 'matplotlib', 'scipy', 'pandas') if n in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="'identifi'"):
        up.identifi  # noqa: B018
