"""Is a rig described once, in the study, and does fit.json hand on what was said and where it came from?"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from upright import readers
from upright.errors import BadInput
from upright.identification import identify
from upright.physics import CartPendulum
from upright.readers import inspect
from upright.simulation import simulate
from upright.study.draft.draft import draft
from upright.study.load import load_study
from upright.study.results import write_fit
from upright.study.stored_fit import read_fit

STUDY = """
[rig]
plant = "pendulum"
name = "bench 3"
servo_period = "2 ms"
travel = { value = "20 deg", assumed = true }
speed_limit = { value = "5 rad/s", measured = true }

[parameters]
m_p = "0.2 kg"
l_cg = { guess = "0.3 m" }
b_2 = { guess = "1e-3 N m s/rad", min = 0 }

[sensors.theta]
column = "theta"
unit = "rad"
counts_per_rev = { value = 4096, measured = true }
sign = -1
offset = "180 deg"

[[runs]]
file = "log.csv"
"""


@pytest.fixture
def study(tmp_path):
    """A pendulum of 0.3 m that swings by 0.1 rad about half a turn, counted backwards."""
    t = np.arange(1000) * 0.01
    theta = math.pi - 0.1 * np.exp(-0.05 * t) * np.cos(math.sqrt(9.81 / 0.3) * t)
    np.savetxt(tmp_path / "log.csv", np.column_stack([t, theta]), "%.9f", ",", header="t,theta", comments="")
    path = tmp_path / "study.toml"

    def write(text=STUDY):
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_every_entry_tells_its_value_and_its_source(study):
    said = load_study(study()).hardware
    assert (said.name, said.vendor) == ("bench 3", None)
    told = {n: (e.value, e.unit, e.source) for n, e in said.entries.items()}
    assert told["servo_period"] == (pytest.approx(0.002), "s", "known")
    assert told["counts.theta"] == (pytest.approx(4096), "1/rev", "measured")
    assert told["sign.theta"] == (-1.0, "1", "known")
    assert told["offset.theta"] == (pytest.approx(math.pi), "rad", "known")


CART = """
[rig]
plant = "cart-pendulum"
vendor = "ECP 210"
travel = { value = "15 cm", assumed = true }
speed_limit = { value = "1.5 m/s", measured = true }
[parameters]
m_c = "0.5 kg"
m_p = "0.1 kg"
l_cg = "0.2 m"
J_p = "1e-3 kg m^2"
[actuator]
gain = { guess = "4 N/V", min = 0 }
limit = { value = "10 V", measured = true }
force_limit = "30 N"
lag = { value = "3 ms", uncertainty = "1 ms" }
converter = "2.4 mV"
[drive]
column = "u"
unit = "V"
[sensors.x]
unit = "m"
counts_per_m = 20000
[sensors.theta]
unit = "rad"
resolution = "0.1 deg"
[[runs]]
file = "log.csv"
"""


@pytest.fixture(scope="module")
def log():
    """Columns of a cart that a sine drives by 4 N/V within the limits of the study."""
    t = np.arange(400) * 0.01
    u = np.sin(5 * t)
    drive = {"actuator.gain": 4.0, "actuator.lag": 3e-3}
    plant = CartPendulum(m_c=0.5, m_p=0.1, l_cg=0.2, J_p=1e-3)
    x = simulate(plant, drive, plant.state("hanging"), u, 0.01, samples=400)[:, ::2, 0]
    return np.column_stack([t, u, x])


@pytest.fixture
def cart(tmp_path, log):
    np.savetxt(tmp_path / "log.csv", log, "%.9f", ",", header="t,u,x,theta", comments="")

    def write(text=CART):
        (tmp_path / "cart.toml").write_text(text, encoding="utf-8")
        return tmp_path / "cart.toml"

    return write


def test_a_rig_has_its_study_s_numbers_each_with_its_source_and_the_drive_in_its_unit(cart):
    stated = CART.replace('"0.1 kg"', '{ value = "0.1 kg", assumed = true }').replace(
        "[actuator]", 'b_1 = { guess = "0.3 N s/m" }\n[actuator]'
    )
    rig = load_study(cart(stated)).rig
    assert (rig.plant.m_c, rig.plant.m_p, rig.plant.l_cg, rig.plant.b_1) == (0.5, 0.1, 0.2, 0.3)
    said = {"m_c": "known", "m_p": "assumed", "l_cg": "known", "J_p": "known", "b_1": "guessed"}
    assert {n: rig.sources[n] for n in said} == said
    assert rig.sources["actuator.gain"] == "guessed"
    assert (rig.gain, rig.unit) == (4.0, "V")


def test_a_fit_hands_on_the_drive_the_encoders_and_the_servo(cart, tmp_path):
    study = load_study(cart())
    fit = identify(study.model, study.runs)
    write_fit(fit, study, tmp_path / "fit.json")
    back = read_fit(tmp_path / "fit.json").hardware
    assert back.vendor == "ECP 210"
    assert set(back.entries) == set(study.hardware.entries)
    said = {n: (e.value, e.unit, e.source) for n, e in back.entries.items()}
    assert said["limit"] == (10.0, "V", "measured")
    assert said["force_limit"] == (30.0, "N", "known")
    assert said["lag"] == (pytest.approx(3e-3), "s", "measured")
    assert said["converter"] == (pytest.approx(2.4e-3), "V", "known")
    assert said["travel"] == (pytest.approx(0.15), "m", "assumed")
    assert said["speed_limit"] == (pytest.approx(1.5), "m/s", "measured")
    assert said["counts.x"] == (pytest.approx(20_000), "1/m", "known")
    assert said["counts.theta"] == (pytest.approx(3600), "1/rev", "known")
    assert said["gain"] == (fit.estimates["actuator.gain"].value, "N/V", "identified")


def test_a_fit_of_older_form_tells_its_drive_from_its_parameters(cart, tmp_path):
    study = load_study(cart())
    write_fit(identify(study.model, study.runs), study, tmp_path / "fit.json")
    content = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    del content["rig"]
    (tmp_path / "fit.json").write_text(json.dumps(content), encoding="utf-8")
    said = read_fit(tmp_path / "fit.json").hardware
    assert {n: e.source for n, e in said.entries.items()} == {
        "gain": "identified", "limit": "known", "force_limit": "known",
        "lag": "identified",  # known about: it may have moved, and such a file says no more
    }  # fmt: skip
    assert said.entries["limit"].value == 10.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('vendor = "ECP 210"', 'vendor = "ECP 201"'), "line 4: there is no data sheet of 'ECP 201'; did you mean"),
        (('converter = "2.4 mV"', 'converter = "2.4 mm"'), "Expected a value in V"),
        (('converter = "2.4 mV"', "converter = 0"), "converter must be above zero"),
        (('converter = "2.4 mV"', "bits = 12"), "a converter has bits and range"),
        (('converter = "2.4 mV"', 'converter = "2.4 mV"\nbits = 12\nrange = "10 V"'), "or its step alone"),
        (('converter = "2.4 mV"', 'bits = 12.5\nrange = "10 V"'), "bits must be a whole number"),
        (("counts_per_m = 20000", "counts_per_m = { value = -4 }"), "counts_per_m must be above zero"),
        (("counts_per_m = 20000", "counts_per_m = { guess = 4 }"), "has no key 'guess'"),
        (("measured = true }\nforce", "measured = true, assumed = true }\nforce"), "assumed or measured, not both"),
        (("1.5 m/s", "1.5 rad/s"), "Expected a value in m/s"),
    ],
)
def test_what_no_rig_has_is_said_with_its_line(cart, change, words):
    with pytest.raises(BadInput) as error:
        load_study(cart(CART.replace(*change)))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"limit": {"value": 5.0, "unit": "V", "source": "known"}}, "parameters.actuator.limit is 10"),
        ({"servo_period": {"value": -1.0, "unit": "s", "source": "known"}}, "must be above 0"),
        ({"servo_period": {"value": 1.0, "unit": "s"}}, "rig.entries.servo_period.source must be text"),
    ],
)
def test_a_changed_description_is_refused(cart, tmp_path, change, words):
    study = load_study(cart())
    write_fit(identify(study.model, study.runs), study, tmp_path / "fit.json")
    content = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    content["rig"]["entries"] |= change
    (tmp_path / "fit.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(BadInput, match=words):
        read_fit(tmp_path / "fit.json")


def test_the_example_of_the_page_describes_a_rig(tmp_path, log):
    page = (Path(__file__).parents[2] / "docs" / "reference" / "study.md").read_text(encoding="utf-8")
    example = re.findall(r"```toml\n(.*?)```", page.partition("## The rig as a loop sees it")[2], re.DOTALL)[0]
    np.savetxt(tmp_path / "log.csv", log, "%.9f", ",", header="t,u,x,theta", comments="")
    rest = CART.partition("[parameters]")[2].partition("[actuator]")[0]
    text = f'{example}unit = "rad"\n[drive]\ncolumn = "u"\nunit = "V"\n[parameters]{rest}[[runs]]\nfile = "log.csv"\n'
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    said = load_study(tmp_path / "study.toml").hardware
    assert {n: e.source for n, e in said.entries.items()} == {
        "gain": "identified", "limit": "measured", "force_limit": "known", "lag": "assumed", "converter": "known",
        "servo_period": "known", "travel": "known", "speed_limit": "measured", "counts.theta": "measured",
    }  # fmt: skip


def test_a_drafted_study_leads_from_a_log_to_a_rig_without_anybody_else_s_numbers(tmp_path):
    """A cart of 0.4 N/V whose command is cut off at +-10 V, read by encoders of 20000 per m and 4096 per turn."""
    dt, n = 2e-3, 4000
    t = np.arange(n) * dt
    u = np.where(t > 0.3, np.clip(14 * np.sin(2 * np.pi * (1.5 + 0.03 * t) * t), -10, 10), 0.0)
    plant = CartPendulum(m_c=0.9, m_p=0.12, l_cg=0.2, J_p=1.5e-3, b_1=0.8, b_2=1e-4, b_1c=0.05)
    x = simulate(plant, {"actuator.gain": 0.4}, plant.state("hanging"), u, dt, samples=n)[:, ::2, 0]
    read = np.round(x * [20_000, 4096 / math.tau]) / [20_000, 4096 / math.tau]
    columns = np.column_stack([t, u, read])
    np.savetxt(tmp_path / "log.csv", columns, "%.7f", ",", header="t,u,x,theta", comments="")
    record = readers.read(tmp_path / "log.csv")
    path = tmp_path / "study.toml"
    text = draft(record, inspect(record), tmp_path / "log.csv", path)
    path.write_text(text, encoding="utf-8")
    assert "ECP" not in text
    said = load_study(path).hardware
    told = {n: (e.value, e.source) for n, e in said.entries.items()}
    assert told["limit"] == (10.0, "assumed")
    assert told["servo_period"] == (pytest.approx(dt), "assumed")
    assert told["counts.theta"] == (pytest.approx(4096), "measured")
    assert told["counts.x"] == (pytest.approx(20_000, rel=1e-3), "measured")
    assert '# travel = "0.' in text


def test_only_a_log_that_is_an_ecp_s_is_given_its_data_sheet(tmp_path, log):
    rows = "\n".join(f"{i} {row[0]:.4f} {0:d} {row[2] * 226629:.0f} {row[3] * 2546:.0f} {row[1]:.4f};"
                     for i, row in enumerate(log.tolist()))  # fmt: skip
    head = "Sample\tTime\tCommanded Pos\tEncoder 1 Pos\tEncoder 2 Pos\tControl Effort\n\n["
    (tmp_path / "ecp.txt").write_text(head + rows.rstrip(";") + "]\n", encoding="utf-8")
    record = readers.read(tmp_path / "ecp.txt")
    text = draft(record, inspect(record), tmp_path / "ecp.txt", tmp_path / "s.toml", plant="rectilinear-2")
    assert 'vendor = "ECP 210"' in text
    assert "servo_period" not in text  # its export leaves samples out


@pytest.mark.parametrize(
    ("bits", "span", "step"),
    # from -10 to 10 V in 4096 steps, and from -5 to 5 V in 65,536, as data sheets have them
    [
        (12, '"10 V"', 4.8828125e-3), (16, '"5 V"', 152.587890625e-6),
        (12, '{ value = "10 V", measured = true }', 20 / 4096),
    ],
)  # fmt: skip
def test_a_converter_of_bits_over_a_range_has_this_step(cart, bits, span, step):
    rig = load_study(cart(CART.replace('converter = "2.4 mV"', f"bits = {bits}\nrange = {span}"))).rig
    assert rig.converter == step
    assert rig.hardware.entries["converter"].source == ("measured" if "measured" in span else "known")
