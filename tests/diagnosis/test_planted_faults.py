"""Is every fault that is put into a log found, alone, in its column, and with the line of a study that mends it?

The expected numbers are those of what was put in, or are read off the log itself.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.doctored import FAULTS, PLANTS, Doctored, batch
from upright.diagnosis import Finding, examine

RIGS = "furuta", "rectilinear-2"
FACTORS = {"sign": -1.0, "scale x2": 0.5, "scale x10": 0.1, "scale x0.5": 2.0, "degrees as radians": math.pi / 180}
"""By what a column must be multiplied to undo a fault."""
IN_TIME = {"jitter", "gaps"}
IN_EFFORT = {"saturated", "trip", *(fault for fault in FAULTS if fault.startswith("effort"))}


@cache
def planted(plant: str, fault: str) -> tuple[Doctored, tuple[Finding, ...]]:
    doctored = batch(plant, fault, 2, seed=5)[0]
    return doctored, examine(doctored.record, doctored.rig, doctored.wiring).wrong


@pytest.mark.parametrize("plant", RIGS)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_found_alone_and_where_it_was_put(plant, fault):
    doctored, found = planted(plant, fault)
    assert {f.kind for f in found} == FAULTS[fault]
    column = "time" if fault in IN_TIME else "u" if fault in IN_EFFORT else doctored.channel
    assert all(column in f.columns for f in found)


@pytest.mark.parametrize("plant", PLANTS)
def test_a_clean_log_brings_no_finding(plant):
    for doctored in batch(plant, "", 2, seed=5):
        assert examine(doctored.record, doctored.rig, doctored.wiring).wrong == ()


@pytest.mark.parametrize("plant", RIGS)
@pytest.mark.parametrize("fault", FACTORS)
def test_a_wrong_sign_or_scale_is_undone(plant, fault):
    doctored, (finding,) = planted(plant, fault)
    # the rig's numbers are known to 3 percent each, and two or three of them meet in one equation
    assert finding.evidence["factor [1]"] == pytest.approx(FACTORS[fault], rel=0.1)
    table = "drive" if doctored.channel == "u" else f"sensors.{doctored.channel}"
    cure = "sign = -1" if fault == "sign" else "scale = "
    assert finding.key.startswith(f"[{table}]\n{cure}")


SIGNED = {"dead": "value [", "jump": "jump [", "effort": "value [1]", "spike": "largest"}
"""Evidence that turns with the columns."""
LATER = 1024.0
IN_CLOCK = ("from [s]", "end [s]", "logged end [s]")


@pytest.mark.parametrize("plant", RIGS)
@pytest.mark.parametrize("fault", FAULTS)
def test_findings_do_not_depend_on_when_the_clock_began(plant, fault):
    doctored, before = planted(plant, fault)
    record = replace(doctored.record, t=doctored.record.t + LATER)
    after = examine(record, doctored.rig, doctored.wiring).wrong
    for here, later in zip(before, after, strict=True):
        assert (later.kind, later.columns, later.severity) == (here.kind, here.columns, here.severity)
        shift = {n: LATER * (n in IN_CLOCK) for n in here.evidence}
        assert later.evidence == pytest.approx({n: v + shift[n] for n, v in here.evidence.items()}, rel=1e-6, abs=1e-9)
        assert later.marks == pytest.approx([t + LATER for t in here.marks])
        assert np.ravel(later.spans) == pytest.approx(np.ravel(here.spans) + LATER)


@pytest.mark.parametrize("plant", RIGS)
@pytest.mark.parametrize("fault", FAULTS)
def test_findings_are_those_of_the_rig_in_a_mirror(plant, fault):
    """Equations of both rigs are odd, so a log with every sign turned is one of the same rig with the same fault."""
    doctored, before = planted(plant, fault)
    record = replace(doctored.record, signals={n: -x for n, x in doctored.record.signals.items()})
    sensors = {n: replace(s, offset=-float(s.offset)) for n, s in doctored.wiring.sensors.items()}
    after = examine(record, doctored.rig, replace(doctored.wiring, sensors=sensors)).wrong
    for here, mirrored in zip(before, after, strict=True):
        assert (mirrored.kind, mirrored.columns, mirrored.severity) == (here.kind, here.columns, here.severity)
        turned = {n: -v if n.startswith(SIGNED.get(here.kind, "-")) else v for n, v in here.evidence.items()}
        assert mirrored.evidence == pytest.approx(turned, rel=1e-6, abs=1e-9)
        assert mirrored.spans == here.spans


OTHER_UNITS = {"rad": (180 / math.pi, "deg"), "m": (1000.0, "mm"), "counts": (1.0, "counts")}


@pytest.mark.parametrize("plant", RIGS)
@pytest.mark.parametrize("fault", FAULTS)
def test_findings_do_not_depend_on_the_units_of_a_log(plant, fault):
    """Evidence in a column's own unit is in the other one then, and so is a ratio of a column to the command."""
    doctored, before = planted(plant, fault)
    record, wiring = doctored.record, doctored.wiring
    per = {n: OTHER_UNITS[unit] for n, unit in record.units.items() if unit}
    signals = {n: per[n][0] * x if n in per else x for n, x in record.signals.items()}
    sensors = {n: replace(s, unit=per[n][1], offset=per[n][0] * float(s.offset)) for n, s in wiring.sensors.items()}
    record = replace(record, signals=signals, units={n: unit for n, (_, unit) in per.items()})
    after = examine(record, doctored.rig, replace(wiring, sensors=sensors)).wrong
    for here, other in zip(before, after, strict=True):
        assert (other.kind, other.columns, other.severity) == (here.kind, here.columns, here.severity)
        assert len(other.evidence) == len(here.evidence)
        for (name, value), (theirs, found) in zip(here.evidence.items(), other.evidence.items(), strict=True):
            own = next((unit for unit in ("rad", "m") if name.endswith(f"[{unit}]")), "")
            times, unit = OTHER_UNITS.get(own, (1.0, ""))
            if fault == "effort is the position" and name == "factor [1]":
                times = 1 / per[next(iter(wiring.sensors))][0]
            assert theirs == (name.replace(f"[{own}]", f"[{unit}]") if own else name)
            assert found == pytest.approx(times * value, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("plant", RIGS)
@pytest.mark.parametrize("fault", FACTORS)
def test_a_wrong_sign_or_scale_is_found_beside_a_spike(plant, fault):
    """Single samples that were read wrongly spoil no equation of motion."""
    doctored, (alone,) = planted(plant, fault)
    column = next(n for n in doctored.wiring.sensors if n != doctored.channel)
    x = doctored.record[column].copy()
    x[x.size // 2] += 0.5 * np.ptp(x)
    record = replace(doctored.record, signals={**doctored.record.signals, column: x})
    found = {f.kind: f for f in examine(record, doctored.rig, doctored.wiring).wrong}
    assert found.keys() == {alone.kind, "spike"}
    assert found["spike"].columns == (column,)
    assert found[alone.kind].columns == alone.columns
    assert found[alone.kind].evidence["factor [1]"] == pytest.approx(alone.evidence["factor [1]"], rel=0.02)


@pytest.mark.parametrize("plant", RIGS)
def test_a_dead_sensor_is_locked(plant):
    doctored, (finding,) = planted(plant, "dead")
    assert finding.key == f'locked = ["{doctored.channel}"]'


@pytest.mark.parametrize("plant", RIGS)
def test_a_window_ends_where_a_sensor_freezes(plant):
    doctored, (finding,) = planted(plant, "stuck")
    x = doctored.record[doctored.channel]
    last = int(np.flatnonzero(np.diff(x))[-1]) + 1
    assert finding.key == f'window = ["start", {doctored.record.t[last]:.6g}]'


@pytest.mark.parametrize("plant", RIGS)
def test_a_window_begins_where_counts_were_lost(plant):
    doctored, (finding,) = planted(plant, "lost counts")
    x = doctored.record[doctored.channel]
    jump = int(np.argmax(np.abs(np.diff(x)))) + 1
    assert finding.key == f'window = [{doctored.record.t[jump]:.6g}, "end"]'
    # what the body moved meanwhile is not part of the jump
    pace = float(np.median(np.abs(np.diff(x))[jump - 6 : jump + 5]))
    assert finding.evidence[f"jump [{doctored.record.units[doctored.channel]}]"] == pytest.approx(
        x[jump] - x[jump - 1], abs=2 * pace
    )


@pytest.mark.parametrize("plant", RIGS)
def test_a_counter_is_known_by_its_turn(plant):
    doctored, (finding,) = planted(plant, "wrap")
    sensor = doctored.wiring.sensors[doctored.channel]
    turn = finding.evidence[f"turn [{sensor.unit}]"]
    if sensor.coordinate.unit == "rad":
        assert turn * (1.0 if sensor.unit == "rad" else sensor.scale) == pytest.approx(2 * math.pi)
    else:
        assert turn == 2**16


@pytest.mark.parametrize("plant", RIGS)
@pytest.mark.parametrize(
    ("fault", "key"),
    [
        ("effort is the reference", '[drive]\ncolumn = "..."'),
        ("effort is constant", "drive = 0"),
        ("trip", 'unknown = ["initial", "input_end"]'),
    ],
)
def test_an_effort_that_did_not_act_is_replaced_left_out_or_cut(plant, fault, key):
    _, (finding,) = planted(plant, fault)
    assert finding.key == key


@pytest.mark.parametrize("plant", RIGS)
def test_a_reference_in_the_place_of_the_effort_is_known_by_what_follows_it(plant):
    doctored, (finding,) = planted(plant, "effort is the reference")
    x, u = doctored.record[doctored.rig.plant.coordinates[0].name], doctored.record["u"]
    alike = 100 * float(np.corrcoef(x, u)[0, 1])
    assert finding.evidence["correlation with the motion [%]"] == pytest.approx(alike)
    assert f"follows it ({alike:.0f} % correlation), as it would a reference" in finding.sentence


@pytest.mark.parametrize("plant", RIGS)
def test_an_effort_that_repeats_a_position_does_so_by_its_factor(plant):
    doctored, (finding,) = planted(plant, "effort is the position")
    x, u = doctored.record[doctored.rig.plant.coordinates[0].name], doctored.record["u"]
    assert finding.evidence["factor [1]"] == pytest.approx(np.ptp(u) / np.ptp(x))


@pytest.mark.parametrize("plant", RIGS)
def test_the_limit_of_a_drive_is_the_largest_effort(plant):
    doctored, (finding,) = planted(plant, "saturated")
    assert finding.key == f"[actuator]\nlimit = {np.abs(doctored.record['u']).max():.6g}"


@pytest.mark.parametrize("plant", RIGS)
def test_jitter_asks_for_the_mean_period(plant):
    doctored, (finding,) = planted(plant, "jitter")
    t = doctored.record.t
    assert finding.evidence["period [ms]"] == pytest.approx(1e3 * (t[-1] - t[0]) / (t.size - 1), rel=1e-3)


@pytest.mark.parametrize("plant", RIGS)
def test_samples_that_are_missing_are_counted(plant):
    doctored, (finding,) = planted(plant, "gaps")
    t = doctored.record.t
    full = round((t[-1] - t[0]) / float(np.median(np.diff(t)))) + 1
    assert finding.evidence["missing samples [1]"] == full - t.size
