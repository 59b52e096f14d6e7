"""What one verb answers, the next one takes: every form of a rig, a model and a log gives the same, or a sentence."""

from __future__ import annotations

import math
from contextlib import suppress

import control
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import upright as up

NUMBERS = {"m_p": 0.135, "l_cg": 0.19, "r": 0.16, "J_d": 0.011, "J_p": 6e-4, "b_1": 6e-3, "b_2": 2e-4}
RIG = up.Furuta(**NUMBERS)
POLES = "-4+-2j, -17, -3"
DRIVE = {"limit": 2.0, "period": "2 ms", "counts": 4096}


def measured(record: up.Record) -> up.Record:
    """What a program at the rig would log of a simulated motion: no speeds, encoders of 16,000 counts."""
    keep = [name for name in record.names if not name.endswith("_dot")]
    step = math.tau / 16_000
    signals = {n: np.round(record[n] / step) * step if n in ("psi", "theta") else record[n] for n in keep}
    return record.replace(signals=signals, units={n: record.units[n] for n in keep})


def driven(rate: float) -> up.Record:
    t = np.arange(0, 6, 2e-3)
    command = 0.1 * np.sin(math.tau * (0.3 * t + rate * t**2))
    return measured(up.simulate(RIG, start={"theta": "30 deg"}, seconds=6, u=command, dt="2 ms"))


@pytest.fixture(scope="module")
def log() -> up.Record:
    return driven(0.15)


@pytest.fixture(scope="module")
def fit(log):
    known = {n: v for n, v in NUMBERS.items() if n not in ("J_p", "b_2")}
    return up.identify(log, up.Furuta, known=known, ask=["J_p", "b_2"])


@pytest.fixture(scope="module")
def design(fit):
    return up.design(fit, poles=POLES, **DRIVE)


@pytest.fixture(scope="module")
def forms(fit, tmp_path_factory):
    """The same rig in every form that a verb of rigs takes."""
    path = fit.save(tmp_path_factory.mktemp("fit") / "fit.json")
    return {
        "fit": fit,
        "path": path,
        "text": str(path),
        "folder": path.parent,
        "plant": fit.plant,
        "study": fit.study,
        "rig": fit.rig,
    }


RIGS = ("fit", "path", "text", "folder", "plant", "rig")


@pytest.mark.parametrize("form", RIGS)
def test_a_design_is_the_same_whatever_the_rig_came_in(form, forms, design):
    again = up.design(forms[form], poles=POLES, **DRIVE)
    np.testing.assert_allclose(again.K, design.K, rtol=1e-9)


def test_a_design_places_what_it_was_asked_on_the_fitted_plant(fit, design):
    model = fit.plant.linear("inverted")
    found = np.linalg.eigvals(model.A - model.B @ design.K)
    np.testing.assert_allclose(
        np.sort_complex(found), np.sort_complex(np.array([-4 + 2j, -4 - 2j, -17, -3])), rtol=1e-6
    )


@pytest.mark.parametrize("form", RIGS)
def test_a_chance_is_the_same_whatever_the_rig_came_in(form, forms, design):
    if form == "plant":  # nothing is drawn where nothing was identified
        with pytest.raises(up.BadInput):
            up.chance(forms[form], design.K[0])
        return
    one, other = (up.chance(f, design.K[0], **DRIVE).numbers for f in (forms["fit"], forms[form]))
    assert one == other


@pytest.mark.parametrize("form", ["fit", "path", "plant", "rig"])
def test_mujoco_gets_the_fitted_rig_whatever_it_came_in(form, forms, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    answer = up.export(forms[form], to="mjcf", out=tmp_path)
    model = mujoco.MjModel.from_xml_path(str(answer.files[0]))
    assert model.nq == 2


@pytest.mark.parametrize("form", ["fit", "path"])
@pytest.mark.parametrize("given", ["record", "frame", "file", "study"])
def test_a_held_out_log_is_predicted_whatever_it_came_in(form, given, forms, tmp_path):
    """The fit is of the true plant, so that another motion is explained but for the encoders' rounding."""
    other = driven(0.05)
    if given == "frame":
        other = other.to_pandas()
    elif given == "file":
        frame = other.to_pandas()
        other = tmp_path / "other.csv"
        frame.to_csv(other)
    elif given == "study":
        other = forms["study"]
    scores = up.predict(forms[form], other).value
    assert min(p for run in scores.values() for p in run.fit_percent.values()) > 99


@pytest.mark.parametrize("form", ["fit", "path", "text", "folder"])
def test_a_fit_is_compared_with_itself_whatever_it_came_in(form, forms):
    compared = up.compare([forms["fit"], forms[form]], driven(0.05))
    one, other = (compared.table.iloc[:, k].tolist() for k in (0, 1))
    assert one == pytest.approx(other, rel=1e-9)
    (by,) = compared.agree.values()
    assert {a.word for a in by.values()} == {"agree"}
    assert {a.difference for a in by.values()} == {0.0}


def test_the_fit_predicts_as_the_verb_does(fit):
    assert fit.predict(driven(0.05)).value.runs["log"].fit_percent == pytest.approx(
        up.predict(fit, driven(0.05)).value["log"].fit_percent
    )


def test_a_law_goes_from_the_fit_to_a_run_and_to_a_program_without_a_file(fit, design, tmp_path):
    run = up.simulate(fit, design.law, start={"theta": "3 deg"}, seconds="4 s")
    assert run["theta"][-1] == pytest.approx(math.pi, abs=1e-3)
    program = up.export(design, to="python", out=tmp_path)
    assert program.files


@pytest.mark.slow
@pytest.mark.parametrize("form", ["fit", "plant"])
def test_a_rig_in_memory_is_regulated_and_swung_up(form, forms, tmp_path):
    held = up.regulate(forms[form], poles=POLES, draws=20, seconds=2, out=tmp_path / "r", **DRIVE)
    assert "SIMULATED" in repr(held).splitlines()[0]
    swung = up.swing_up(forms["fit"], travel=6, seconds=6, out=tmp_path / "s", **DRIVE)
    assert swung.numbers


@pytest.mark.slow
def test_a_shaft_in_memory_is_tracked(tmp_path):
    shaft = up.chain(2, "torsional")(J_1=0.0108, J_2=0.0103, k_12=1.37, c_1=0.007, c_2=0.001)
    done = up.track(shaft, limit=0.5, period="0.884 ms", counts=16_000, sets=1, out=tmp_path)
    assert done.numbers["verdict"].startswith(("Do not rely", "Set")) or done.numbers["verdict"]


@pytest.mark.parametrize("form", ["fit", "path", "plant", "class", "name"])
def test_a_log_is_examined_whatever_the_rig_came_in(form, forms, log):
    rig = {"class": up.Furuta, "name": "furuta", **forms}[form]
    assert not up.doctor(log, rig=rig).value.wrong


@pytest.mark.parametrize("form", ["fit", "rig"])
def test_another_log_of_a_rig_is_asked_for_what_was_identified_before(form, fit):
    """What was given stays known, so that nothing but the inertia and the friction is estimated once more."""
    again = up.identify(driven(0.05), fit if form == "fit" else fit.rig)
    numbers = [n for n, e in again.value.estimates.items() if e.status not in ("known", "left out")]
    assert numbers == ["J_p", "b_2"]
    for name in numbers:
        low, high = again[name].interval
        assert low <= NUMBERS[name] * (1 + 1e-3)
        assert high >= NUMBERS[name] * (1 - 1e-3)


def test_a_rig_whose_command_is_turned_is_identified_from_its_log():
    """The gain of the rig turns its command; the log, made by the rig itself, has it as it was given."""
    turned = up.Rig.known(RIG, gain="-0.05 N m/V", limit="10 V", period="2 ms", counts=16_000)
    t = np.arange(0, 6, 2e-3)
    command = 2 * np.sin(math.tau * (0.3 * t + 0.15 * t**2))
    log = measured(up.simulate(turned, start={"theta": "30 deg"}, seconds=6, u=command, dt="2 ms"))
    fit = up.identify(log, turned, ask=["J_p", "actuator.gain"])
    assert fit["actuator.gain"].value == pytest.approx(-0.05, rel=1e-3)
    assert fit["J_p"].value == pytest.approx(NUMBERS["J_p"], rel=1e-3)
    assert (fit.rig.limit, fit.rig.period) == (10.0, 0.002)
    assert fit.rig.counts == pytest.approx((16_000, 16_000))
    with pytest.raises(up.BadInput, match=r"commanded in V, and column T of its log is in N m; pass its plant alone"):
        up.identify(log.replace(units={**log.units, "T": "N m"}), turned)


def test_a_rig_that_is_known_altogether_has_no_friction_left_to_find():
    """A drag-free, dry-frictionless pendulum: the log shows none, and the answer says so instead of failing."""
    swing = up.Pendulum(m_p=0.2235, l_cg=0.2, J_p=0.0035, b_2=2e-4)
    fit = up.identify(measured(up.simulate(swing, start={"theta": "30 deg"}, seconds=10, dt="2 ms")), swing)
    assert {e.status for e in fit.value.estimates.values()} <= {"known", "left out"}
    assert fit["J_p"].value == 0.0035


def test_assumed_numbers_of_a_rig_stay_assumed(fit, log):
    rig = fit.rig.replace(sources={**fit.rig.sources, "l_cg": "assumed"})
    again = up.identify(log, rig)
    assert again.study.model.parameters["l_cg"].assumed
    assert "l_cg" in again.verdict


@pytest.mark.parametrize("form", ["fit", "study", "log and rig"])
def test_a_ladder_is_climbed_whatever_it_was_handed(form, fit, log):
    handed = {"fit": (fit,), "study": (fit.study,), "log and rig": (log, fit.rig)}[form]
    assert up.ladder(*handed).value.steps


def test_a_rig_alone_has_no_runs():
    for verb in (up.identify, up.ladder):
        with pytest.raises(up.BadInput, match=rf"a rig has no runs; .* up.{verb.__name__}\(log, rig\)"):
            verb(DRIVEN)


def test_a_number_of_a_fit_is_asked_by_its_name(fit):
    assert fit["J_p"].value == pytest.approx(NUMBERS["J_p"], rel=1e-3)
    assert fit["m_p"].value == NUMBERS["m_p"]
    with pytest.raises(up.BadInput, match="did you mean 'J_p'"):
        fit["J_q"]


MODELS = {
    "state space": lambda m: m,
    "control": lambda m: m.to_control(),
    "matrices": lambda m: tuple(m),
    "pair": lambda m: (m.A, m.B),
}
VERBS = {
    "place": lambda m: up.place(m, [-4 + 2j, -4 - 2j, -17, -3]).K,
    "lqr": lambda m: up.lqr(m, [1, 0, 10, 0], 1.0).K,
    "hold": lambda m: up.hold(m, "2 ms").A,
    "margins": lambda m: up.margins(m, up.lqr(m, [1, 0, 10, 0], 1.0)).delay,
    "dlqr": lambda m: up.dlqr(up.hold(m, 2e-3), [1, 0, 10, 0], 1.0).K,
    "prefilter": lambda m: up.prefilter(m, up.lqr(m, [1, 0, 10, 0], 1.0)),
    "design": lambda m: up.design(m, poles=POLES, period="2 ms", limit=2, start={}, speed="observer").K,
}


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("form", MODELS)
def test_a_linear_model_gives_the_same_whatever_its_form(verb, form):
    model = RIG.linear("inverted")
    np.testing.assert_allclose(VERBS[verb](MODELS[form](model)), VERBS[verb](model), rtol=1e-6)


def test_a_transfer_function_is_held_as_python_control_does():
    transfer = control.tf([2], [1, 0.3, 4])
    ours, theirs = up.hold(transfer, 1e-2), control.c2d(transfer, 1e-2)
    omega = np.array([0.5, 2.0, 20.0])
    np.testing.assert_allclose(ours.response(omega)[:, 0, 0], theirs(np.exp(1j * omega * 1e-2)), rtol=1e-9)


def test_gains_that_do_not_hold_the_plant_are_told():
    with pytest.raises(up.BadInput, match="grows without bound"):
        up.simulate(RIG, 40 * np.ones((1, 4)), at="inverted", start={"theta": 0.1}, seconds=60)


DRIVEN = up.Rig.known(RIG, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096)
SWING = up.simulate(RIG, start={"theta": 0.3}, seconds=2)
ANYTHING = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 3), st.floats(allow_nan=True), st.text(max_size=6), st.just([]),
    st.just({}), st.just(object()), st.just(up.Furuta), st.just(RIG),
    st.just(DRIVEN), st.just(np.zeros((2, 3))), st.just(np.zeros(0)),
    st.just((np.eye(2), np.ones(2))), st.just(RIG.linear("inverted")), st.just([[1, "a"]]), st.just({"theta": "5 kg"}),
    st.just({"psi": None}), st.just(control.tf([1], [1, 1])),
)  # fmt: skip
CALLS = {
    "place": lambda a, b: up.place(a, b),
    "lqr": lambda a, b: up.lqr(a, b, 1.0),
    "lqr's R": lambda a, b: up.lqr(RIG.linear("inverted"), [1, 0, 1, 0], b),
    "dlqr": lambda a, b: up.dlqr(a, b, 1.0),
    "hold": lambda a, b: up.hold(a, b),
    "margins": lambda a, b: up.margins(a, b),
    "prefilter": lambda a, b: up.prefilter(a, b),
    "observer": lambda a, b: up.observer(a, b),
    "simulate": lambda a, b: up.simulate(a, b, seconds=0.01),
    "start": lambda a, b: up.simulate(RIG, start=a, seconds=b if isinstance(b, str | None.__class__) else 0.01),
    "u": lambda a, b: up.simulate(RIG, u=a, seconds=0.01, at=b if isinstance(b, str) else None),
    "plant": lambda a, b: up.Furuta(**{**NUMBERS, "m_p": a}),
    "design": lambda a, b: up.design(a, poles=b if isinstance(b, str) and b else POLES),
    "chance": lambda a, b: up.chance(a, b),
    "regulate": lambda a, b: up.regulate(a if a is not None else 3, draws=2),
    "track": lambda a, b: up.track(a if a is not None else 3),
    "doctor": lambda a, b: up.doctor(a, rig=b),
    "predict": lambda a, b: up.predict(a, b),
    "ladder": lambda a, b: up.ladder(a, b),
    "ladder of a log": lambda a, b: up.ladder(SWING, a if a is not None else 3, known=b),
    "survey": lambda a, b: up.survey(a),
    "export": lambda a, b: up.export(a, to="mjcf"),
    "show": lambda a, b: up.show(a),
    "identify": lambda a, b: up.identify(a, b),
    "identify a log": lambda a, b: up.identify(SWING, a if a is not None else 3, known=b),
    "frequency": lambda a, b: up.frequency(a, rig=b if isinstance(b, str) else ""),
    "loadings": lambda a, b: up.loadings(a),
    "swing_up": lambda a, b: up.swing_up(a if a is not None else 3),
    "init": lambda a, b: up.init(a),
    "law": lambda a, b: up.law(a),
    "read": lambda a, b: up.read(a),
    "lab": lambda a, b: up.lab(rig=a if isinstance(a, str) and a else np.zeros(2)),
    "run": lambda a, b: up.run(a, law=b),
    "rig_doctor": lambda a, b: up.rig_doctor(a),
    "log_show": lambda a, b: up.log_show(a),
    "log_replay": lambda a, b: up.log_replay(a),
    "export a law": lambda a, b: up.export(a, to=b),
    "start of a design": lambda a, b: up.design(DRIVEN, poles=POLES, start=a),
    "start of a chance": lambda a, b: up.chance(DRIVEN, [1.0, 1.0, 1.0, 1.0], start=a, draws=2),
    "a rig": lambda a, b: up.Rig.known(a, gain=b),
    "numbers of a rig": lambda a, b: DRIVEN.replace(limit=a, counts=b),
    "a rig's plant": lambda a, b: DRIVEN.replace(plant=a, travel=b),
    "equilibrium": lambda a, b: DRIVEN.linear(a),
    "limit of a motion": lambda a, b: up.simulate(DRIVEN, limit=a, counts=b, seconds=0.01),
    "drive of a motion": lambda a, b: up.simulate(RIG, actuator=a, memory=b, seconds=0.01),
    "counts of a design": lambda a, b: up.design(DRIVEN, poles=POLES, counts=a, limit=b),
}


@pytest.mark.parametrize("verb", [pytest.param(v, marks=pytest.mark.slow) if v == "regulate" else v for v in CALLS])
def test_whatever_a_verb_is_given_it_answers_or_says_in_a_sentence(verb, tmp_path_factory, monkeypatch):
    monkeypatch.chdir(tmp_path_factory.mktemp("anything"))

    @settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(ANYTHING, ANYTHING)
    def check(a, b):
        with suppress(up.UprightError, FileNotFoundError):  # the command line makes a sentence of the second
            CALLS[verb](a, b)

    check()


GAINS = up.place(RIG.linear("inverted"), [-4 + 2j, -4 - 2j, -17, -3])
LOGS = {"record", "frame", "file"}
FITS = {"fit", "fit.json"}
RIGGED = FITS | {"study", "rig", "plant"}
LINEAR = {"state space", "control", "matrices"}
FEEDBACK = {"gains", "array"}
SHORT = {"draws": 2, "seconds": 0.1}
TABLE = {  # a plant alone has no encoders, a log in N m is none of a rig that takes volts
    "read": (up.read, LOGS),
    "show": (up.show, LOGS),
    "init": (up.init, LOGS),
    "law": (lambda x: up.law(x, command="T", measured="theta"), LOGS),
    "doctor": (up.doctor, LOGS),
    "rig of a doctor": (lambda x: up.doctor(driven(0.15), rig=x), RIGGED | {"class", "none"}),
    "identify": (up.identify, LOGS | {"fit", "study"}),
    "rig of identify": (lambda x: up.identify(driven(0.15), x), RIGGED - {"rig"} | {"class", "none"}),
    "predict with": (lambda x: up.predict(x, driven(0.05)), FITS),
    "design": (lambda x: up.design(x, poles=POLES, **DRIVE), RIGGED),
    "design without counts": (
        lambda x: up.design(x, poles=POLES, period="2 ms", limit=2.0),
        RIGGED - {"plant"} | LINEAR | {"sampled"},
    ),
    "chance": (lambda x: up.chance(x, GAINS, **SHORT, **DRIVE), RIGGED),
    "gains of chance": (lambda x: up.chance(DRIVEN, x, **SHORT), FEEDBACK),
    "play": (lambda x: up.play(x, **SHORT, **DRIVE), RIGGED),
    "simulate": (lambda x: up.simulate(x, seconds=0.1), RIGGED | LINEAR | {"sampled", "transfer"}),
    "law of a motion": (lambda x: up.simulate(DRIVEN, x, at="inverted", seconds=0.1), FEEDBACK | {"law", "none"}),
    "gains of matrices": (lambda x: up.simulate(RIG.linear("inverted"), x, seconds=0.1), FEEDBACK | {"none"}),
    "export": (lambda x: up.export(x, to="mjcf"), RIGGED),
    "place": (lambda x: up.place(x, [-4, -5, -6, -7]), LINEAR | {"sampled"}),
    "lqr": (lambda x: up.lqr(x, [1, 0, 1, 0], 1.0), LINEAR | {"sampled"}),
    "dlqr": (lambda x: up.dlqr(x, [1, 0, 1, 0], 1.0), {"sampled", "matrices"}),
    "hold": (lambda x: up.hold(x, "2 ms"), LINEAR | {"transfer"}),
    "margins": (lambda x: up.margins(x, GAINS), LINEAR | {"sampled"}),
    "prefilter": (lambda x: up.prefilter(x, GAINS), LINEAR | {"sampled"}),
    "observer": (lambda x: up.observer(x, [0.1, 0.11, 0.12, 0.13]), {"sampled"}),
    "survey": (up.survey, set()),
    "loadings": (lambda x: up.loadings(x, added="0 kg"), set()),
    "frequency": (up.frequency, {"file"}),
}
"""What a verb is called with, and the forms that it answers; every other one gets a sentence."""


@pytest.fixture(scope="module")
def everything(fit, log, tmp_path_factory):
    """One of each thing that can be handed over."""
    at = tmp_path_factory.mktemp("handed")
    log.to_csv(at / "log.csv")
    model = RIG.linear("inverted")
    return {
        "record": log, "frame": log.to_pandas(), "file": at / "log.csv", "arrays": (log.t, log["theta"]),
        "study": fit.study, "fit": fit, "fit.json": fit.save(at / "fit.json"), "rig": DRIVEN, "plant": RIG,
        "class": up.Furuta, "state space": model, "sampled": up.hold(model, "2 ms"), "control": model.to_control(),
        "transfer": control.tf([1], [1, 0.2, 4]), "matrices": (model.A, model.B), "gains": GAINS,
        "array": np.array(GAINS.K), "law": up.design(DRIVEN, poles=POLES).law, "none": None,
        "no file": at / "nowhere.csv",
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("verb", TABLE)
def test_every_verb_answers_every_form_that_it_takes_and_says_what_else_it_needs(
    verb, everything, tmp_path, monkeypatch
):  # fmt: skip
    monkeypatch.chdir(tmp_path)
    call, takes = TABLE[verb]
    answered = set()
    for form, handed in everything.items():
        with suppress(up.UprightError):
            call(handed)
            answered.add(form)
    assert answered == takes


def test_an_array_of_gains_for_a_force_is_not_taken_for_gains_of_a_command():
    """The drive turns the command round, so that what stabilises the plant by its force drives the rig away."""
    turned = DRIVEN.replace(gain="-0.65 N m/V")
    by_force = np.array(up.place(RIG.linear("inverted"), [-4 + 2j, -4 - 2j, -17, -3]).K)
    with pytest.raises(up.BadInput, match=r"by a force \[N m\], and not the rig by its command \[V\]"):
        up.simulate(turned, by_force, at="inverted", start={"theta": 0.02})
    held = up.simulate(turned, by_force / -0.65, at="inverted", start={"theta": 0.02}, seconds=4)
    assert abs(held["theta"][-1] - np.pi) < 0.01
    assert abs(up.simulate(RIG, by_force, at="inverted", start={"theta": 0.02}, seconds=4)["theta"][-1] - np.pi) < 0.01


def test_what_dir_shows_of_a_fit_is_there_and_documented(fit):
    """Nothing of the search's own bookkeeping, and each name in the class's table or with a docstring of its own."""
    from upright.verbs.model.fit import FitAnswer

    needed = {"residuals", "parameters", "verdict", "plot", "predict", "report", "rig"}
    assert needed <= set(dir(fit))
    assert len(dir(fit)) <= 25
    table = (FitAnswer.__doc__ or "").partition("Attributes\n")[2]
    for name in dir(fit):
        assert getattr(fit, name) is not None
        documented = any(name in line.split(" : ")[0].split(", ") for line in map(str.strip, table.splitlines()))
        assert documented or getattr(FitAnswer, name).__doc__, name


DIRECTORIES = {
    "rig": (
        lambda fit: fit.rig,
        {"plant", "linear", "plot", "replace", "limit", "period", "counts", "gain", "sources"},
    ),
    "record": (lambda fit: SWING, {"t", "signals", "units", "window", "plot", "to_pandas", "from_pandas", "period"}),
}


@pytest.mark.parametrize("kind", DIRECTORIES)
def test_what_dir_shows_of_a_rig_and_a_record_is_there_and_documented(kind, fit):
    made, needed = DIRECTORIES[kind]
    shown = made(fit)
    assert needed <= set(dir(shown))
    assert len(dir(shown)) <= 26
    table = (type(shown).__doc__ or "").replace("Attributes\n", "Parameters\n").partition("Parameters\n")[2]
    tabled = {name for line in table.splitlines() for name in line.strip().split(" : ")[0].split(", ")}
    for name in dir(shown):
        assert hasattr(type(shown), name) or hasattr(shown, name)
        assert name in tabled or getattr(type(shown), name).__doc__, name


def test_a_number_of_a_rig_is_asked_for_as_one_of_a_fit():
    assert DRIVEN["l_cg"] == RIG.l_cg
    assert DRIVEN.replace(plant=RIG.replace(l_cg=0.2))["l_cg"] == 0.2
    with pytest.raises(up.BadInput, match="did you mean 'l_cg'"):
        DRIVEN["l_c"]


def test_what_dir_shows_of_a_design_is_there(design):
    assert {"K", "poles", "law", "rig", "verdict", "plot", "report", "numbers"} <= set(dir(design))
    assert len(dir(design)) <= 25
    for name in dir(design):
        getattr(design, name)


def test_methods_of_a_fit_name_arguments_where_the_command_line_names_options(fit):
    with pytest.raises(up.BadInput, match="command limit") as missing:
        fit.play()
    assert "limit=10" in str(missing.value)
    assert "--" not in str(missing.value)
