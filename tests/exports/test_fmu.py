"""Does the unit for co-simulation move, step by step of another tool, as the rig moves here?"""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.exports.rigs import fit_file
from tests.physics import bumpers
from tests.physics.bumpers import BUMPERS
from tests.physics.specimens import SPECIMENS
from upright.errors import BadInput
from upright.exports.fmu import archive, unit_of
from upright.exports.fmu.archive import model_description
from upright.exports.fmu.translation import as_c
from upright.physics import BUILT_IN, CartPendulum, Furuta, chain
from upright.rig import Hardware
from upright.simulation import simulate
from upright.study.stored_rig import read_stored_rig
from upright.verbs.export import export

fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
pytestmark = pytest.mark.skipif(
    not any(shutil.which(c) for c in ("cc", "gcc", "clang")), reason="there is no C compiler on this machine"
)

DRY = Furuta(
    m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4, b_1c=4e-3, b_2c=1e-3, b_1s=6e-3, v_1s=0.1, b_2q=1e-5
)
DRIVE = {"actuator.gain": 0.5, "actuator.delay": 4.3e-3, "actuator.lag": 0.012, "actuator.slope": 2e-3}


def identified(folder, plant, **more):
    name = next((n for n, kind in BUILT_IN.items() if kind is type(plant)), "rectilinear-4")
    return read_stored_rig(fit_file(folder, plant, name=name, **more))


def running(path, x0, names):
    """The unit in fmpy, begun at x0."""
    about = fmpy.read_model_description(str(path), validate=True)
    references = {v.name: v.valueReference for v in about.modelVariables}
    folder = fmpy.extract(str(path))
    unit = fmpy.fmi3.FMU3Slave(
        guid=about.guid, unzipDirectory=folder, modelIdentifier=about.coSimulation.modelIdentifier, instanceName="one"
    )
    unit.instantiate(loggingOn=True)
    unit.enterInitializationMode(startTime=0.0)
    unit.setFloat64([references[f"{n}_start"] for n in names], x0)
    unit.exitInitializationMode()
    return SimpleNamespace(unit=unit, references=references, folder=folder)


def walked(path, plant, x0, commands, step):
    """States after every step, shape (steps, states)."""
    names = plant.state_names()
    run = running(path, x0, names)
    out = []
    for k, u in enumerate(commands):
        run.unit.setFloat64([run.references["u"]], [u])
        run.unit.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)
        out.append(run.unit.getFloat64([run.references[n] for n in names]))
    run.unit.terminate()
    run.unit.freeInstance()
    shutil.rmtree(run.folder, ignore_errors=True)
    return np.array(out)


def here(plant, drive, x0, commands, step):
    u = np.vstack([np.zeros((1000, 1)), np.repeat(np.asarray(commands), round(step / 1e-3))[:, None]])
    motion = simulate(plant, drive, x0, u, 1e-3, samples=len(commands) + 1, every=round(step / 1e-3), start=1000)
    return motion[1:, :, 0]


def test_stick_slip_delay_and_lag_are_those_of_the_kernel(tmp_path):
    """The same steps and events: rounding alone differs, which 2 s of a pendulum that only swings do not magnify."""
    values = {n: v for n, v in DRIVE.items() if n != "actuator.gain"}
    rig = identified(tmp_path, DRY, values=values)
    (tmp_path / "rig.fmu").write_bytes(archive(unit_of(rig))[0])
    x0, step = [0.3, 0.0, 0.02, 0.0], 0.01
    commands = np.where(np.arange(200) % 70 < 20, 0.02, 0.0)
    ours = here(DRY, {**DRIVE, "actuator.limit": 5.0}, x0, commands, step)
    theirs = walked(tmp_path / "rig.fmu", DRY, x0, commands, step)
    assert (np.abs(ours[:, 1]) < 1e-12).any()  # it sticks
    assert np.ptp(ours[:, 0]) > 0.01  # and slips
    assert np.abs(ours - theirs).max() < 1e-9


SMOOTH = {n: s.plant for n, s in SPECIMENS.items() if n != "double pendulum"}


@pytest.mark.parametrize(
    "name", [n if n in ("cart-pendulum", "torsional-2") else pytest.param(n, marks=pytest.mark.slow) for n in SMOOTH]
)
def test_every_plant_moves_as_here(name, tmp_path):
    plant = SMOOTH[name]
    (tmp_path / "rig.fmu").write_bytes(archive(unit_of(identified(tmp_path, plant)))[0])
    x0 = np.random.default_rng(1).uniform(-0.3, 0.3, 2 * len(plant.coordinates)).tolist()
    commands = np.sin(np.arange(50) * 0.3)
    ours = here(plant, {"actuator.gain": 0.5, "actuator.limit": 5.0}, x0, commands, 0.02)
    assert np.abs(ours - walked(tmp_path / "rig.fmu", plant, x0, commands, 0.02)).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("gap", [0.03, 0.0])
def test_elementary_functions_and_kinks_are_those_of_the_kernel(gap, tmp_path):
    """With the bumpers where the cart rests it has no linear model, and steps as the stiffer side asks."""
    plant = BUMPERS.replace(gap=gap)
    rig = read_stored_rig(fit_file(tmp_path, plant, name=f"{bumpers.__file__}:Bumpers", unit="N"))
    (tmp_path / "rig.fmu").write_bytes(archive(unit_of(rig))[0])
    x0, commands = [0.02, 0.0, 0.4, 0.0], 3.0 * np.sin(np.arange(30) * 0.3)
    ours = here(plant, {"actuator.gain": 0.5, "actuator.limit": 5.0}, x0, commands, 0.02)
    assert np.abs(ours - walked(tmp_path / "rig.fmu", plant, x0, commands, 0.02)).max() < 1e-9


def test_fmpy_s_validator_finds_nothing_and_its_simulation_agrees(tmp_path):
    plant = CartPendulum(m_c=0.5, m_p=0.2, l_cg=0.3, J_p=6e-3, b_1=0.4, b_2=1e-3)
    done = export(fit_file(tmp_path, plant, name="cart-pendulum", unit="N"), to="fmu", out=tmp_path)
    from fmpy.validation import validate_fmu

    assert validate_fmu(done.value[0]) == []
    found = fmpy.simulate_fmu(
        done.value[0], stop_time=1.0, output_interval=0.01, start_values={"theta_start": 0.5, "m_p": 0.25}
    )
    ours = simulate(plant.replace(m_p=0.25), {}, [0, 0, 0.5, 0], None, 1e-3, samples=101, every=10)[:, :, 0]
    for i, name in enumerate(plant.state_names()):
        np.testing.assert_allclose(found[name], ours[:, i], rtol=0, atol=1e-10)
    with zipfile.ZipFile(done.value[0]) as archive:
        assert {"sources/rig.c", "sources/buildDescription.xml", "modelDescription.xml"} <= set(archive.namelist())


@pytest.mark.parametrize(
    "line",
    [
        "assert n > 0", "n = n << 2", "n = round(0.5, 1)", "n = len(n)", "n = [1, 2]", "n + 1",
        "for i in range(0, 9, 2): n = i",
    ],
)  # fmt: skip
def test_what_has_no_counterpart_in_c_is_refused_by_its_text(line):
    """Another program than the kernel's text would be worse than none."""
    with pytest.raises(BadInput, match="cannot be translated to C; the target gymnasium") as refused:
        as_c(f"def run_1(n):\n    {line}\n", "run_1", {}, {})
    assert line.partition("n = ")[2].split(" ")[0] in str(refused.value)


def test_a_step_of_a_fraction_of_a_millisecond_is_refused(tmp_path):
    plant = SMOOTH["pendulum"]
    (tmp_path / "rig.fmu").write_bytes(archive(unit_of(identified(tmp_path, plant)))[0])
    run = running(tmp_path / "rig.fmu", [0.1, 0.0], plant.state_names())
    with pytest.raises(fmpy.fmi1.FMICallException):
        run.unit.doStep(currentCommunicationPoint=0.0, communicationStepSize=1.5e-3)
    with pytest.raises(fmpy.fmi1.FMICallException):  # a parameter, once it runs
        run.unit.setFloat64([run.references["m_p"]], [1.0])
    run.unit.freeInstance()
    shutil.rmtree(run.folder, ignore_errors=True)


def test_a_fast_motion_is_stepped_as_finely_as_it_needs(tmp_path):
    """400 rad/s, of which a step of 1 ms is 0.4 rad: the closed form x cos(w t) after 50 ms, to 8e-6 a step."""
    plant = chain(1)(m_1=0.5, k_1=0.5 * 400.0**2)
    (tmp_path / "rig.fmu").write_bytes(archive(unit_of(identified(tmp_path, plant)))[0])
    there = walked(tmp_path / "rig.fmu", plant, [0.01, 0.0], [0.0] * 50, 1e-3)
    assert there[-1, 0] == pytest.approx(0.01 * np.cos(400.0 * 0.05), abs=0.01 * 100 * 8e-6)


def test_the_same_rig_gives_the_same_file(tmp_path):
    rig = identified(tmp_path, SMOOTH["pendulum"])
    assert archive(unit_of(rig))[0] == archive(unit_of(rig))[0]


def test_what_a_unit_does_not_remember_is_said_or_refused(tmp_path):
    soft = chain(1)(m_1=0.5, k_1=10.0, f_1c=0.1, delta_1=1e-3)
    assert any("slides at once" in line for line in unit_of(identified(tmp_path, soft)).remarks)
    entry = {"relaxation": {"value": 0.01, "unit": "s", "source": "known"}}
    slow = identified(tmp_path, soft, **entry)
    with pytest.raises(BadInput, match="relaxation"):
        unit_of(slow)
    assert unit_of(replace(slow, hardware=Hardware())).remarks


def test_a_tool_is_told_every_variable_with_its_unit_meaning_and_number(tmp_path):
    plant = CartPendulum(m_c=0.5, m_p=0.2, l_cg=0.3, J_p=6e-3, b_1=0.4)
    offset = {"value": 0.25, "unit": "V", "source": "known"}
    unit = unit_of(identified(tmp_path, plant, unit="N", offset=offset))
    root = ET.fromstring(model_description(unit, "{token}"))
    about = {v.attrib["name"]: v.attrib for v in root.find("ModelVariables")}
    names = [v.attrib["name"] for v in root.find("ModelVariables")]
    states = ["x", "x_dot", "theta", "theta_dot"]
    assert names[:6] == ["time", "u", *states]
    assert names[6:10] == [f"{n}_start" for n in states]
    assert [int(about[n]["valueReference"]) for n in names] == list(range(len(names)))
    assert (about["u"]["unit"], about["u"]["causality"], about["u"]["start"]) == ("V", "input", "0.0")
    assert [about[n]["unit"] for n in states] == ["m", "m/s", "rad", "rad/s"]
    assert {about[n]["causality"] for n in states} == {"output"}
    given = {n: float(about[n]["start"]) for n in names[10:]}
    assert {n: given[n] for n in ("m_c", "m_p", "l_cg", "J_p", "b_1")} == {
        "m_c": 0.5, "m_p": 0.2, "l_cg": 0.3, "J_p": 6e-3, "b_1": 0.4,
    }  # fmt: skip
    assert "b_2" not in given  # zero, so that the kernel was chosen without it
    assert (given["actuator_gain"], about["actuator_gain"]["unit"]) == (0.5, "N/V")
    assert (given["actuator_offset"], about["actuator_offset"]["unit"]) == (0.25, "V")
    numbers = [about[n]["valueReference"] for n in states]
    structure = root.find("ModelStructure")
    for kind in ("Output", "InitialUnknown"):
        assert [e.attrib["valueReference"] for e in structure.findall(kind)] == numbers
    assert root.find("CoSimulation").attrib["fixedInternalStepSize"] == "0.001"
    assert root.find("DefaultExperiment").attrib["stepSize"] == "0.01"
    assert root.attrib["instantiationToken"] == "{token}"
    declared = {u.attrib["name"] for u in root.find("UnitDefinitions")}
    assert {"s", "V", "m", "rad/s", "N/V", "kg"} <= declared
    # rows of the kernel: states and starts by number, parameters where it keeps them
    assert [v.row for v in (*unit.states, *unit.starts)] == [0, 1, 2, 3] * 2
    assert all(unit.simulator.names[v.row].replace(".", "_") == v.name for v in unit.parameters)


@pytest.mark.parametrize(
    ("delay", "lag", "kept"), [(0.0, 0.0, 3), (4.2e-3, 0.0, 8), (0.0, 0.01, 403), (99.0, 0.0, 99_003)]
)
def test_a_unit_remembers_the_delay_and_forty_time_constants(delay, lag, kept, tmp_path):
    entries = {n: {"value": v, "unit": "s", "source": "known"} for n, v in (("delay", delay), ("lag", lag))}
    assert unit_of(identified(tmp_path, SMOOTH["pendulum"], **entries)).remembered == kept


def test_a_drive_as_late_as_a_minute_and_more_is_refused(tmp_path):
    entries = {"delay": {"value": 100.0, "unit": "s", "source": "known"}}
    with pytest.raises(BadInput, match="remember 100003 commands, more than 100000; are they in seconds"):
        unit_of(identified(tmp_path, SMOOTH["pendulum"], **entries))
