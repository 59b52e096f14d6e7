"""Is a RIG.toml read as it is meant, and is hardware without limits never armed?"""

from __future__ import annotations

import math
import re
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from upright.errors import BadInput, RigStopped
from upright.rig.makes import make_rig
from upright.rigs import Capabilities, Limits
from upright.rigs.rigfile import read_rig_file
from upright.rigs.supervisor import Duty, Supervisor
from upright.rigs.vendor.nidaqmx import NidaqmxPort
from upright.rigs.vendor.quanser import QuanserPort
from upright.running.rig import signal, stage_of, usual_limits

UNITS = {"psi": "rad", "theta": "rad"}
WHOLE = """
kind = "serial"
port = "/dev/ttyACM0"
study = "study.toml"
[limits]
command = "5 V"
watchdog = "20 ms"
twist = "20 deg"
lean = "25 deg"
[limits.psi]
travel = "90 deg"
speed = "20 rad/s"
start = 0.3
"""


@pytest.fixture
def written(tmp_path):
    (tmp_path / "study.toml").write_text("", encoding="utf-8")
    (tmp_path / "run.csv").write_text("", encoding="utf-8")

    def write(text):
        (tmp_path / "RIG.toml").write_text(text, encoding="utf-8")
        return read_rig_file(tmp_path / "RIG.toml")

    return write


def test_limits_are_read_with_their_units(written):
    file = written(WHOLE)
    held = file.limits(UNITS, "V")
    assert file.hardware
    assert held.travel == pytest.approx((math.pi / 2, math.inf))
    assert held.speed == (20.0, math.inf)
    assert held.start == (0.3, math.inf)
    assert (held.command, held.watchdog) == pytest.approx((5.0, 0.02))
    assert held.twist == pytest.approx(math.radians(20))
    assert file.lean("rad", 1.0) == pytest.approx(math.radians(25))


def test_hardware_without_limits_gets_none_and_a_twin_those_of_its_rig(written):
    serial = 'kind = "serial"\nport = "COM4"\nstudy = "study.toml"\n'
    usual = usual_limits(make_rig("furuta"))
    assert written(serial).limits(UNITS, "V", usual) is None
    assert written('kind = "twin"\nmake = "furuta"\n').limits(UNITS, "V", usual) == usual
    some = written('kind = "twin"\nmake = "furuta"\n[limits]\ncommand = 2\n').limits(UNITS, "V", usual)
    assert some.command == 2.0
    assert some.travel == usual.travel


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a rig needs kind"),
        ('kind = "robot"', "kind must be"),
        ('kind = "twin"', "what describes it"),
        ('kind = "twin"\nfit = "nowhere.json"', "does not exist"),
        ('kind = "twin"\nstudy = "study.toml"\nfit = "study.toml"', "leave one out"),
        ('kind = "serial"\nstudy = "study.toml"', "needs port"),
        ('kind = "serial"\nmake = "furuta"\nport = "COM4"', "what describes it"),
        ('kind = "replay"\nmake = "furuta"', "needs record"),
        ('kind = "twin"\nmake = "furuta"\nport = "COM4"', "has no port"),
        ('kind = "twin"\nmake = "furuta"\nseed = -1', "whole number"),
        ('kind = "twin"\nmake = "furuta"\nlimit = 3', "did you mean 'limits'"),
    ],
)
def test_what_contradicts_itself_is_refused_with_its_line(written, text, said):
    with pytest.raises(BadInput, match=said) as complaint:
        written(text)
    assert "RIG.toml, line" in str(complaint.value)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("[limits]\nwatchdog = 0.02", "largest command"),
        ("[limits]\ncommand = 5", "needs travel"),
        ("[limits]\ncommand = 5\n[limits.psi]\ntravel = 1", "needs speed"),
        ('[limits]\ncommand = "5 m"\n[limits.psi]\ntravel = 1\nspeed = 1\nstart = 1', "V"),
        ("[limits]\ncommand = -5\n[limits.psi]\ntravel = 1\nspeed = 1\nstart = 1", "above zero"),
        ("[limits]\ncommand = 5\n[limits.phi]\ntravel = 1", "no limit or coordinate 'phi'"),
    ],
)
def test_limits_of_hardware_leave_nothing_out(written, limits, said):
    file = written(f'kind = "serial"\nport = "COM4"\nstudy = "study.toml"\n{limits}\n')
    with pytest.raises(BadInput, match=said):
        file.limits(UNITS, "V", usual_limits(make_rig("furuta")))


def test_a_twin_takes_the_limits_of_its_file(tmp_path):
    text = 'kind = "twin"\nmake = "furuta"\n[limits]\ncommand = "2 V"\n[limits.psi]\ntravel = "1 rad"\n'
    (tmp_path / "RIG.toml").write_text(text, encoding="utf-8")
    stage = stage_of(tmp_path / "RIG.toml")
    stage.supervisor.prepare()
    assert stage.supervisor.held.command == pytest.approx(2.0, abs=1e-3)
    assert stage.supervisor.held.travel[0] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(("port", "said"), [(QuanserPort, "QUARC or the Quanser SDK"), (NidaqmxPort, "NI-DAQmx")])
def test_a_vendors_board_without_its_kit_is_refused_in_a_sentence(port, said, monkeypatch):
    for kit in ("quanser", "quanser.hardware", "nidaqmx"):
        monkeypatch.setitem(sys.modules, kit, None)  # as if it were not installed
    about = Capabilities(name="bench", coordinates=("psi",), counts=(1.0,), command_unit="V", full_scale=10.0,
                         steps=10, period=1e-3)  # fmt: skip
    with pytest.raises(BadInput, match=said):
        port(about, "board")


def test_signals_are_what_they_are_called():
    period, seconds = 1e-3, 4.0
    t = [k * period for k in range(4001)]
    assert signal("step 0.5", "V", period, seconds) == [0.5] * 4001
    sine = signal("sine 2 1.5", "V", period, seconds)
    assert sine[500] == pytest.approx(2 * math.sin(2 * math.pi * 1.5 * t[500]))
    square = signal("square 1 2", "V", period, seconds)
    assert [square[k] for k in (100, 900, 1100, 1900, 2100)] == [1, 1, -1, -1, 1]
    sweep = signal("sweep 1 1 8", "V", period, seconds)
    # octaves take equal times: 1 to 8 Hz in 4 s has (8 - 1) 4/ln 8 cycles
    crossings = sum(a < 0 <= b for a, b in pairwise(sweep))
    assert abs(crossings - 7 * 4 / math.log(8)) <= 1


def test_limits_have_to_be_there_before_anything_is_armed():
    from upright.rigs import Board, TwinPort

    with pytest.raises(RigStopped, match=r"\[limits.psi\]"):
        Supervisor(Board(TwinPort(make_rig("furuta"))), Duty(limits=None)).prepare()
    with pytest.raises(BadInput):
        Limits(travel=(0.0,), speed=(1.0,), start=(1.0,), command=1.0)


def test_every_key_of_a_rig_is_read(written, tmp_path):
    file = written(
        'kind = "twin"\nname = "bench 3"\nmake = "furuta"\nseed = 4\nvendor = "ECP 205"\nat = "hanging"\n'
        'zero = "inverted"\n[loadings]\nadded = ["1 g", "2 g"]\ntolerance = "0.2 %"\n[board]\ndevice = "Dev1"\n'
    )
    assert (file.name, file.make, file.seed, file.vendor) == ("bench 3", "furuta", 4, "ECP 205")
    assert (file.at, file.zero, file.added, file.tolerance) == ("hanging", "inverted", ("1 g", "2 g"), 0.002)
    assert file.board == {"device": "Dev1"}
    assert not file.hardware
    plain = written('kind = "twin"\nmake = "furuta"\n')
    assert (plain.at, plain.zero, plain.seed, plain.tolerance, plain.added) == ("inverted", "hanging", 0, 0.0, ())
    default = Limits(travel=(1.0, 2.0), speed=(3.0, 4.0), start=(5.0, 6.0), command=7.0)
    assert plain.limits(UNITS, "V", default) is default
    replay = written('kind = "replay"\nstudy = "study.toml"\nrecord = "run.csv"\n')
    assert replay.record == tmp_path / "run.csv"
    assert replay.known == tmp_path / "study.toml"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('kind = "twin"\nmake = "furuta"\nseed = -1\n', "seed is a whole number from 0 on, got -1"),
        ('kind = "twin"\nmake = "furuta"\nseed = true\n', "seed is a whole number from 0 on, got True"),
        ('kind = "twin"\nmake = "furuta"\nseed = 1.5\n', "seed is a whole number"),
        ('kind = "twin"\nmake = "furuta"\n[loadings]\ntolerance = 1\n', "from 0 to below 1"),
        ('kind = "twin"\nmake = "furuta"\n[loadings]\ntolerance = -0.1\n', "from 0 to below 1"),
    ],
)
def test_a_seed_or_a_tolerance_that_is_none_is_refused(written, text, said):
    with pytest.raises(BadInput, match=said):
        written(text)


def test_a_twin_s_file_fills_in_what_it_leaves_out_coordinate_by_coordinate(written):
    default = Limits(
        travel=(1.0, 2.0), speed=(3.0, 4.0), start=(5.0, 6.0), command=7.0, watchdog=0.3, saturation=0.9, twist=1.1
    )
    held = written('kind = "twin"\nmake = "furuta"\n[limits.theta]\nspeed = 9\n').limits(UNITS, "V", default)
    assert (held.travel, held.speed, held.start) == ((1.0, 2.0), (3.0, 9.0), (5.0, 6.0))
    assert (held.command, held.watchdog, held.saturation, held.twist) == (7.0, 0.3, 0.9, 1.1)
    hardware = written(WHOLE).limits(UNITS, "V", default)
    assert hardware.travel[1] == math.inf  # of hardware nothing is filled in
    assert hardware.saturation == 2.0


def test_a_watchdog_and_a_saturation_that_are_left_out_are_those_of_the_page_on_rigs(written):
    page = (Path(__file__).parents[2] / "docs/howto/rigs.md").read_text(encoding="utf-8")
    for line, name in (('watchdog = "20 ms"', "watchdog"), ('saturation = "2 s"', "saturation")):
        value = line.split('"')[1]
        assert re.search(rf"^{line} .*; {value} where it is left out$", page, re.MULTILINE)
        without = "\n".join(row for row in WHOLE.splitlines() if not row.startswith(name))
        with_it = without.replace("[limits]\n", f"[limits]\n{line}\n")
        assert written(without).limits(UNITS, "V") == written(with_it).limits(UNITS, "V")


def test_a_rig_with_a_fit_is_the_same_but_for_its_description(written, tmp_path):
    file = written('kind = "serial"\nport = "/dev/ttyACM0"\nstudy = "study.toml"\nseed = 3\n')
    (tmp_path / "out").mkdir()
    (tmp_path / "fit.json").write_text("", encoding="utf-8")
    file.with_fit(tmp_path / "fit.json", tmp_path / "out" / "RIG.toml")
    again = read_rig_file(tmp_path / "out" / "RIG.toml")
    assert again.known.resolve() == (tmp_path / "fit.json").resolve()
    assert (again.kind, again.port, again.seed) == ("serial", "/dev/ttyACM0", 3)


def test_counts_are_written_where_nothing_else_changes_and_read_again(written, tmp_path):
    text = f"# by hand\n{WHOLE}\n[board]\nfull_scale = 12.0  # of the bridge\n"
    path = written(text).with_counts({"psi": -2400.0})
    assert path.read_text(encoding="utf-8") == f"{text}\n[counts]\npsi = -2400\n"
    written(path.read_text(encoding="utf-8") + "\n[loadings]\nadded = []\n").with_counts({"theta": 9600.0})
    file = read_rig_file(path)
    assert file.counts == {"psi": -2400.0, "theta": 9600.0}
    assert "# of the bridge" in path.read_text(encoding="utf-8")
    assert path.read_text(encoding="utf-8").endswith("\n[loadings]\nadded = []\n")


def test_a_dead_zone_is_written_beside_the_counts_and_read_in_the_command_s_unit(written):
    path = written(WHOLE).with_counts({"psi": -2400.0})
    read_rig_file(path).with_dead_zone("400 mV")
    file = read_rig_file(path)
    assert file.counts == {"psi": -2400.0}
    assert file.dead_zone("V", 0.0) == pytest.approx(0.4)
    file.with_dead_zone("0.3 V")
    assert path.read_text(encoding="utf-8").count("dead_zone") == 1
    assert read_rig_file(path).dead_zone("V", 0.0) == pytest.approx(0.3)
    assert written(WHOLE).dead_zone("V", 0.7) == 0.7  # as it is described


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('kind = "twin"\nmake = "furuta"\n[drive]\ndead_zone = "1 V"\n', "line 3: .* has the drive that is described"),
        (WHOLE + "[counts]\npsi = 0\n", "line 15: counts per turn or metre are not zero"),
        ('kind = "twin"\nmake = "furuta"\n[counts]\npsi = 2400\n', "line 3: .* counts as it is described"),
    ],
)
def test_counts_that_no_encoder_has_are_refused(written, text, why):
    with pytest.raises(BadInput, match=why):
        written(text)


def test_a_coordinate_that_the_rig_lacks_has_no_counts(tmp_path):
    from tests.firmware.test_laboratory import STUDY

    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(WHOLE + "[counts]\nphi = 2400\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"\[counts\] has no coordinate 'phi'; .*psi"):
        stage_of(tmp_path / "RIG.toml")
