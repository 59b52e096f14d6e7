"""Does somebody else's installed package add one of each thing, with upright as it is?

A reader, export targets, a driver of rigs, a plant with its drawing, an experiment; commands: `cli/test_elsewhere.py`.
"""

import textwrap

import numpy as np
import pytest

import upright as up
from upright.experiments.laboratory import chosen_experiments
from upright.physics import find
from upright.rig.makes import make_rig
from upright.rigs.rigfile import read_rig_file
from upright.running.rig import usual_limits

HEAD = "Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """What installs a package of one module, as pip would: the module, and its metadata with its entry points."""

    def install(name, source, **groups):
        site = tmp_path / f"site-{name}"
        about = site / f"{name}-1.0.dist-info"
        about.mkdir(parents=True)
        (site / f"{name}.py").write_text(textwrap.dedent(source), encoding="utf-8")
        (about / "METADATA").write_text(HEAD.format(name=name), encoding="utf-8")
        points = "".join(f"[upright.{group}]\n{entry}\n" for group, entry in groups.items())
        (about / "entry_points.txt").write_text(points, encoding="utf-8")
        monkeypatch.syspath_prepend(site)

    return install


READER = """
    import numpy as np
    from upright.readers.reader import Reader
    from upright.records import Record

    def read(source):
        rows = source.data[8:]
        if len(rows) % 16:
            raise source.bad("expected whole rows of two numbers; log again")
        t, theta = np.frombuffer(rows).reshape(-1, 2).T
        return Record(t=t, signals={"theta": theta}, units={"theta": "rad"}, provenance=source.provenance("its"))

    READER = Reader(
        name="its", files="ITS-LOGs", recognises=lambda source: source.data.startswith(b"ITS-LOG\\0"), read=read
    )
"""
T = np.arange(100) * 0.01
ROWS = np.column_stack([T, 0.1 * np.cos(5 * T)])


def test_a_log_of_its_format_is_read_and_a_damaged_one_refused_in_its_words(installed, tmp_path):
    installed("its_reader", READER, readers="its = its_reader:READER")
    (tmp_path / "a.log").write_bytes(b"ITS-LOG\0" + ROWS.tobytes())
    (tmp_path / "b.log").write_bytes(b"ITS-LOG\0" + ROWS.tobytes()[:-3])
    log = up.read(tmp_path / "a.log")
    np.testing.assert_array_equal(log["theta"], ROWS[:, 1])
    assert log.provenance.reader == "its"
    np.testing.assert_array_equal(up.read(tmp_path / "a.log", reader="its").t, T)
    with pytest.raises(up.BadInput, match=r"b\.log': expected whole rows of two numbers"):
        up.read(tmp_path / "b.log")


def test_formats_of_this_package_are_recognised_as_before(installed, tmp_path):
    installed("its_reader", READER, readers="its = its_reader:READER")
    (tmp_path / "log.csv").write_text("t,theta\n" + "".join(f"{t:.2f},{x:.6f}\n" for t, x in ROWS))
    assert up.read(tmp_path / "log.csv").provenance.reader == "table"


BROKEN = {
    "raises": ("raise RuntimeError('no licence')", "'its' of the package raises does not load .RuntimeError: no lice"),
    "lacks": ("", "'its' of the package lacks does not load .AttributeError"),
    "counts": ("THING = 3", "'its' of the package counts is none: counts:THING is of int"),
}


@pytest.mark.parametrize("how", BROKEN)
def test_a_package_that_does_not_load_is_named_and_the_rest_works(how, installed, tmp_path):
    source, said = BROKEN[how]
    installed(how, source, readers=f"its = {how}:THING")
    (tmp_path / "log.csv").write_text("t,theta\n" + "".join(f"{t:.2f},{x:.6f}\n" for t, x in ROWS))
    with pytest.warns(UserWarning, match=said):
        assert len(up.read(tmp_path / "log.csv")) == 100
    assert len(up.read(tmp_path / "log.csv", reader="table")) == 100
    with pytest.raises(up.BadInput, match=said):
        up.read(tmp_path / "log.csv", reader="its")
    (tmp_path / "its.log").write_text("ITS-LOG")
    with pytest.warns(UserWarning, match=said), pytest.raises(up.BadInput, match=said):
        up.read(tmp_path / "its.log")  # the command line shows no warnings, its sentence has to tell


def test_a_reader_that_stops_while_it_looks_leaves_the_log_to_the_others(installed, tmp_path):
    source = """
        from upright.readers.reader import Reader
        READER = Reader(name="its", files="", recognises=lambda source: 1 / 0, read=lambda source: None)
    """
    installed("hasty", source, readers="its = hasty:READER")
    (tmp_path / "log.csv").write_text("t,theta\n0,1\n1,2\n2,3\n")
    with pytest.warns(UserWarning, match="'its' stops at .*ZeroDivisionError"):
        assert up.read(tmp_path / "log.csv").provenance.reader == "table"


def test_what_this_package_has_keeps_its_name(installed, tmp_path):
    installed("bold", READER.replace('"its"', '"table"'), readers="table = bold:READER")
    (tmp_path / "log.csv").write_text("t,theta\n0,1\n1,2\n2,3\n")
    assert up.read(tmp_path / "log.csv", reader="table")["theta"][2] == 3


FORMS = """
    from upright.exports.targets import LawTarget, RigTarget
    from upright.report.page import Chapter

    def of_law(made, test, single):
        return {"law.txt": f"{made.law.period!r} {made.law.D.tolist()!r}"}

    def of_rig(asked):
        rows = "".join(f"{n}={v!r}\\n" for n, v in asked.rig.plant.parameters().items())
        return {"rig.its": rows.encode()}, Chapter(title="ITS", verdict=f"{asked.called} is written for ITS.")

    LAW = LawTarget(name="its", title="ITS", write=of_law, test="its {folder}", onward="Run it.")
    RIG = RigTarget(name="its-rig", write=of_rig)
"""
PENDULUM = up.Pendulum(m_p=0.2, l_cg=0.15, J_p=0.001)


def test_a_law_and_a_rig_are_exported_in_its_forms(installed, tmp_path):
    installed("its_forms", FORMS, exports="its = its_forms:LAW\nits-rig = its_forms:RIG")
    law = up.Law(*(np.zeros(shape) for shape in ((0, 0), (0, 2), (1, 0))), np.array([[3.0, 0.5]]), period=0.01)
    done = up.export(law, to="its", out=tmp_path)
    assert (tmp_path / "law.txt").read_text() == "0.01 [[3.0, 0.5]]"
    assert done.value == (str(tmp_path / "law.txt"),)
    done = up.export(PENDULUM, to="its-rig", out=tmp_path)
    lines = (tmp_path / "rig.its").read_text().split()
    assert {"m_p=0.2", "l_cg=0.15", "J_p=0.001"} <= set(lines)
    assert done.numbers["to"] == "its-rig"
    with pytest.raises(up.BadInput, match="limit is that of the fit"):
        up.export(PENDULUM, to="its-rig", out=tmp_path, limit=1.0)
    with pytest.raises(up.BadInput, match=r"got 'itz'; did you mean 'its'"):
        up.export(PENDULUM, to="itz", out=tmp_path)


def test_forms_of_this_package_are_written_beside_one_that_does_not_load(installed, tmp_path):
    installed("unfit", "import nowhere_at_all", exports="its = unfit:LAW")
    assert up.export(PENDULUM, to="mjcf", out=tmp_path).value == (str(tmp_path / "rig.xml"),)
    with pytest.raises(up.BadInput, match=r"package unfit does not load .ModuleNotFoundError"):
        up.export(PENDULUM, to="its", out=tmp_path)


DRIVER = """
    from upright.basis import SIMULATED
    from upright.rigs import Board
    from upright.rigs.driver import Driver

    class Winch:
        \"\"\"A board whose first encoder counts 1 per volt and tick; its own clock is virtual.\"\"\"

        def __init__(self, to):
            about, rest = to.capabilities()
            self.about, self.per = about, rest.pop("per_volt", 1.0)
            self.counts, self.command, self.ticks = 0.0, 0.0, 0

        def open(self):
            from dataclasses import replace
            return replace(self.about, virtual=True, hardware=PERFORMED == "")

        def write(self, command):
            self.command = command

        def enable(self, on):
            self.command = 0.0

        def advance(self):
            self.ticks += 1
            self.counts += self.per * self.command
            return self.ticks * self.about.period

        def read(self):
            return round(self.counts), 0

        def zero(self):
            self.counts = 0.0

        def close(self):
            pass

    PERFORMED = SIMULATED
    DRIVER = Driver(name="winch", open=lambda to: Board(Winch(to)), performed=PERFORMED)
"""


def test_a_rig_of_its_kind_is_run(installed, tmp_path):
    installed("its_driver", DRIVER, rigs="winch = its_driver:DRIVER")
    rig = tmp_path / "RIG.toml"
    rig.write_text('kind = "winch"\nmake = "furuta"\n[board]\nper_volt = 2.0\n', encoding="utf-8")
    run = up.run(rig, excite="step 0.5", duration=0.2, check=False, watch=False, out=tmp_path)
    counts = run.value.log.record()["psi"] * make_rig("furuta").per_unit[0]
    assert np.median(np.diff(counts)) == pytest.approx(1.0)  # 2 counts per V and tick, at 0.5 V
    assert run.chapter.first_line.startswith("SIMULATED")


def test_hardware_of_its_kind_does_not_move_without_limits(installed, tmp_path):
    installed("its_hardware", DRIVER.replace("= SIMULATED", '= ""'), rigs="winch = its_hardware:DRIVER")
    (tmp_path / "study.toml").write_text('[rig]\nplant = "torsional-1"\n', encoding="utf-8")
    rig = tmp_path / "RIG.toml"
    rig.write_text('kind = "winch"\nstudy = "study.toml"\n', encoding="utf-8")
    assert read_rig_file(rig).hardware
    assert read_rig_file(rig).limits({"theta_1": "rad"}, "V", usual_limits(make_rig("furuta"))) is None


def test_what_board_says_and_the_driver_does_not_know_is_refused(installed, tmp_path):
    installed(
        "strict",
        """
        from upright.rigs.driver import Driver

        def opened(to):
            return dict(**to.board, lamp=3)

        DRIVER = Driver(name="lamp", open=opened, performed="SIMULATED: no rig was driven.")
        """,
        rigs="lamp = strict:DRIVER",
    )
    rig = tmp_path / "RIG.toml"
    rig.write_text('kind = "lamp"\nmake = "furuta"\n[board]\nlamp = 2\n', encoding="utf-8")
    with pytest.raises(up.BadInput, match=r'\[board\] does not fit kind = "lamp"'):
        up.run(rig, excite="free", duration=0.1, out=tmp_path)


def test_a_driver_that_does_not_load_is_refused_at_its_line_and_the_others_open(installed, tmp_path):
    installed("unplugged", "raise OSError('no such device')", rigs="winch = unplugged:DRIVER")
    rig = tmp_path / "RIG.toml"
    rig.write_text('make = "furuta"\nkind = "winch"\n', encoding="utf-8")
    with pytest.raises(up.BadInput, match=r"RIG\.toml, line 2.*package unplugged does not load .OSError"):
        up.run(rig, excite="free", duration=0.1, out=tmp_path)
    rig.write_text('make = "furuta"\nkind = "twin"\n', encoding="utf-8")
    assert up.run(rig, excite="free", duration=0.1, out=tmp_path).value.end.stopped == ""


PLANT = """
    import numpy as np
    from upright.physics import Coordinate, Input, Plant
    from upright.quantities import quantity

    class Boat(Plant):
        \"\"\"A boat that rolls: a righting moment, and friction.\"\"\"

        J: float = quantity("kg m^2", "inertia", above=0)
        k: float = quantity("N m/rad", "righting moment", above=0)
        b: float = quantity("N m s/rad", "viscous friction", default=0.0, at_least=0)

        coordinates = (Coordinate("roll", "rad", "angle of the mast"),)
        inputs = (Input("T", "N m", "moment", on="roll"),)
        equilibria = {"rest": {"roll": 0.0}}

        @staticmethod
        def energies(p, q, v):
            return p.J * v[0] ** 2 / 2, p.k * q[0] ** 2 / 2, p.b * v[0] ** 2 / 2

        @staticmethod
        def drawing(q):
            mast = np.stack([np.zeros((q["roll"].size, 2)), np.zeros((q["roll"].size, 2))], 1)
            mast[:, 0, 1], mast[:, 1, 1] = 4 * np.sin(q["roll"]), 4 * np.cos(q["roll"])
            return [mast]
"""


@pytest.fixture
def boat(installed):
    """Its plant, with numbers whose roll is known: w^2 = k/J = 4, damping ratio b/(2 sqrt(k J)) = 0.05."""
    installed("yard", PLANT, plants="boat = yard:Boat")
    return find("boat")(J=2.0, k=8.0, b=0.4)


def test_its_plant_is_simulated_by_name_as_by_hand(boat):
    run = up.simulate(boat, start={"roll": 0.3}, seconds=5)
    w, zeta = 2.0, 0.05
    fast = w * np.sqrt(1 - zeta**2)
    by_hand = 0.3 * np.exp(-zeta * w * run.t) * (np.cos(fast * run.t) + zeta * w / fast * np.sin(fast * run.t))
    np.testing.assert_allclose(run["roll"], by_hand, atol=1e-9)


def test_its_plant_is_identified_by_name_by_class_and_by_its_columns(boat, tmp_path):
    run = up.simulate(boat, start={"roll": 0.3}, seconds=10)
    log = up.Record(t=run.t, signals={"roll": run["roll"]}, units={"roll": "rad"})
    for plant in ("boat", type(boat), None):
        fit = up.identify(log, plant, known={"J": 2.0})
        assert fit["k"].value == pytest.approx(8.0, rel=1e-4)
        assert fit["b"].value == pytest.approx(0.4, rel=1e-3)
    assert fit.study.plant == "boat"
    again = up.predict(fit.save(tmp_path / "fit.json"), log)  # read back by the plant's name
    assert again.value is not None


def test_a_study_names_its_plant(boat, tmp_path):
    run = up.simulate(boat, start={"roll": 0.3}, seconds=10)
    np.savetxt(tmp_path / "log.csv", np.column_stack([run.t, run["roll"]]), "%.9g", ",", header="t,roll", comments="")
    study = '[rig]\nplant = "boat"\n[parameters]\nJ = 2\nk = { guess = 5 }\nb = { guess = 0.1 }\n'
    study += '[sensors.roll]\nunit = "rad"\n[defaults]\nunknown = ["initial"]\n[[runs]]\nfile = "log.csv"\n'
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    assert up.identify(tmp_path / "study.toml")["k"].value == pytest.approx(8.0, rel=1e-4)


def test_columns_of_the_built_in_plants_are_recognised_as_before(installed):
    installed("mimic", PLANT.replace("roll", "theta"), plants="boat = mimic:Boat")
    run = up.simulate(up.Pendulum(m_p=0.2, l_cg=0.15, J_p=0.001, b_2=1e-3), start={"theta": 0.3}, seconds=5)
    log = up.Record(t=run.t, signals={"theta": run["theta"]}, units={"theta": "rad"})
    assert up.identify(log, known={"m_p": 0.2}).study.plant == "pendulum"


def test_its_plant_draws_itself(boat):
    run = up.simulate(boat, start={"roll": 0.3}, seconds=1)
    assert len(list(run.animate().new_frame_seq())) == 25  # by name, nobody could draw a column called roll
    unknown = up.Record(t=run.t, signals={"roll": run["roll"]})
    with pytest.raises(up.BadInput, match="columns called theta"):
        unknown.animate()
    assert len(list(unknown.animate(plant=boat).new_frame_seq())) == 25


def test_a_plant_that_does_not_load_is_named_and_the_others_are_found(installed):
    installed("sunk", "import nowhere_at_all", plants="boat = sunk:Boat")
    with pytest.raises(up.BadInput, match=r"package sunk does not load .ModuleNotFoundError"):
        find("boat")
    assert find("furuta") is up.Furuta
    with pytest.raises(up.BadInput, match="did you mean 'boat'"):
        find("bout")


EXPERIMENT = """
    import numpy as np
    from upright.experiments.stand.experiment import Experiment
    from upright.report.page import Chapter

    def tell(at):
        if FAILS:
            raise ValueError("never shown")
        log = at.stand.run([0.0] + [0.2] * 200 + [0.0] * 4000, at.folder, "pushed")
        return Chapter(title="ITS", verdict="It was pushed.", numbers={"end": float(log["theta_1"][-1])}), True

    FAILS = False
    EXPERIMENT = Experiment(
        name="push", order=90, title="A steady push", makes=("torsional",), on=lambda stand: True, tell=tell,
        seconds=1.0,
    )
"""


def test_its_experiment_is_made_on_a_twin_and_on_a_driven_rig_and_made_again_when_it_changes(installed, tmp_path):
    installed("its_course", EXPERIMENT, experiments="push = its_course:EXPERIMENT")
    out = tmp_path / "out"
    twin = up.lab(rig="torsional", experiment="push", out=out).numbers["experiments"]["push"]
    assert (twin["title"], twin["state"]) == ("A steady push", "done")
    rig = tmp_path / "RIG.toml"
    rig.write_text('kind = "twin"\nmake = "torsional"\n', encoding="utf-8")
    driven = up.lab(rig=rig, experiment="push", out=tmp_path / "driven").numbers["experiments"]["push"]
    one_count = 2 * np.pi / 16000
    assert driven["numbers"]["end"] == pytest.approx(
        twin["numbers"]["end"], abs=1.5 * one_count
    )  # dry friction stops both
    assert "push" in {e.name for e in chosen_experiments((), "torsional")}  # the whole laboratory has it too

    def state():
        return up.lab(rig="torsional", experiment="push", out=out).numbers["experiments"]["push"]["state"]

    assert state() == "kept"
    module = next(tmp_path.rglob("its_course.py"))
    module.write_text(module.read_text(encoding="utf-8") + "# changed", encoding="utf-8")
    assert state() == "done"


def test_an_experiment_that_does_not_load_is_named_and_the_others_are_made(installed, tmp_path):
    installed("no_course", "import nowhere_at_all", experiments="push = no_course:EXPERIMENT")
    with pytest.raises(up.BadInput, match=r"'push' of the package no_course does not load .ModuleNotFoundError"):
        up.lab(rig="torsional", experiment="push", out=tmp_path / "a")
    with pytest.warns(UserWarning, match="no_course does not load"):  # the others stay
        assert [e.name for e in chosen_experiments((), "torsional")] == ["1a", "1b", "3"]
