"""Does a recording show what a Fourier transform makes of the same samples, and nothing of what it did not see?"""

from __future__ import annotations

import json
import math
import threading
from dataclasses import replace

import numpy as np
import pytest

from tests.browser.runs import SOON, hardware, twin
from upright.browser.identify.recording import Recording, Sparing, recording_plan
from upright.browser.messages import ONE_STEP, SWEEP
from upright.errors import BadInput
from upright.experiments.frequency_1b.one_by_one import stepped_sines
from upright.experiments.stand.live import live_stand
from upright.experiments.stand.twin import TwinStand
from upright.identification.frequency.response import FrequencyResponse
from upright.logs import read_log
from upright.realtime.desk import ROW, ROWS, Desk
from upright.realtime.process import run_in_process
from upright.rig.makes import make_rig
from upright.running.run import prepared


class Played:
    """Stands for the desk of a run: rows of a twin in virtual time, at most half a ring of them at a look."""

    def __init__(self, y, u, per_unit, lost=()):
        self.rows = np.zeros(len(u), dtype=ROW)
        self.rows["number"] = self.rows["again"] = np.arange(len(u))
        self.rows["counts"][:-1, : y.shape[1]] = np.round(y[1:] * np.abs(per_unit))
        self.rows["applied"] = u
        self.lost, self.over = lost, threading.Event()

    def since(self, number):
        head = min(number + ROWS // 2, len(self.rows))
        if head == len(self.rows):
            self.over.set()
        numbers = np.arange(number, head)
        return head, self.rows[number:head][~np.isin(numbers, self.lost)]


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return twin(tmp_path_factory.mktemp("bench"))


def played(rig, kind, folder, monkeypatch, lost=()):
    monkeypatch.setattr("upright.browser.identify.recording.OFTEN", 1e-4)
    recording = Recording(recording_plan(rig, kind))
    model, samples = make_rig("furuta", 3), recording.request.samples
    record = TwinStand(rig=model).run(list(samples), folder, "played")
    y, u = np.column_stack([record["psi"], record["theta"]]), record["u_applied"]
    desk = Played(y, u, model.per_unit, lost)
    recording.begin(desk)
    assert desk.over.wait(2 * SOON)
    recording.end(folder / "run.mcap")
    return recording.described(), y, u


def test_of_a_sweep_each_point_is_the_line_of_a_fourier_transform_and_what_was_lost_leaves_the_others(
    rig, tmp_path, monkeypatch
):
    plan = stepped_sines(live_stand(rig.rig_path))
    before = plan.windows[6][0] - 1  # whose readings are the first ones of that window
    drawn, y, u = played(rig, SWEEP, tmp_path, monkeypatch, lost=[before, 70_000])
    assert (drawn["over"], drawn["run"], drawn["kind"]) == (True, "run", "sweep")
    assert len(drawn["points"]) == len(drawn["planned"]) - 2
    (swing,) = (abs(p) for p in rig.model.linear("hanging").poles() if p.imag > 0)
    ((gap, seconds),) = drawn["gaps"]
    assert gap == pytest.approx(swing, rel=1e-4)
    assert min(abs(w / swing - 1) for w in drawn["planned"]) > 0.1
    assert seconds > 60
    missed = set(drawn["planned"]) - {p["omega"] for p in drawn["points"]}
    windows = dict(zip(plan.omega.tolist(), plan.windows, strict=True))
    for point in drawn["points"]:
        part = slice(*windows[point["omega"]])
        k = round((part.stop - part.start) * rig.model.period * point["omega"] / (2 * math.pi))  # whole periods in it
        samples = np.arange(part.stop - part.start)
        means, middles = (z.reshape(k, samples.size // k, -1).mean(axis=1) for z in (y[part], samples))
        slope, level = np.polyfit(middles[:, 0], means, 1)  # of what every sine has none
        flat = y[part] - slope * samples[:, None] - level
        answer = np.fft.rfft(flat, axis=0)[k] / np.fft.rfft(u[part])[k]
        off = np.abs(20 * np.log10(np.abs(answer)) - point["dB"])
        assert np.all(off < 0.05 + np.array(point["dB_error"])), point["omega"]
        turned = np.abs((np.degrees(np.angle(answer)) - point["deg"] + 180) % 360 - 180)
        assert np.all(turned < 0.5 + np.array(point["deg_error"])), point["omega"]
    stored = FrequencyResponse.from_csv(tmp_path / "run.frequency.csv")
    assert stored.omega == pytest.approx([p["omega"] for p in drawn["points"]])
    assert stored.magnitude_dB == pytest.approx(np.array([p["dB"] for p in drawn["points"]]), abs=1e-3)
    assert (len(missed), plan.omega[6] in missed, drawn["lost"], drawn["why"]) == (2, True, 2, "")


def test_a_coordinate_that_does_not_move_has_no_gain_and_a_file_that_cannot_be_stored_ends_nothing(
    rig, tmp_path, monkeypatch
):
    monkeypatch.setattr("upright.browser.identify.recording.OFTEN", 1e-4)
    recording = Recording(recording_plan(rig, SWEEP))
    u = np.array(recording.request.samples)
    desk = Played(np.column_stack([u, np.zeros(u.size)]), u, rig.model.per_unit)
    recording.begin(desk)
    assert desk.over.wait(2 * SOON)
    (tmp_path / "full").write_text("no folder", encoding="utf-8")
    recording.end(tmp_path / "full" / "run.mcap")
    drawn = recording.described()
    json.dumps(drawn, allow_nan=False)
    assert len(drawn["points"]) == len(drawn["planned"])
    assert all(p["dB"][1] is None and abs(p["dB"][0]) < 0.5 for p in drawn["points"])  # the other one follows u itself
    assert drawn["over"]
    assert "was not stored" in drawn["why"]


def test_a_run_shows_each_command_with_the_readings_after_it_and_its_log_with_those_before(rig, tmp_path):
    request = recording_plan(rig, ONE_STEP).request
    run, desk = prepared(replace(request, seconds=1.2), tmp_path), Desk()
    run_in_process(run.order, paced=False, desk=desk)
    _, rows = desk.since(0)
    log = read_log(run.order.log).columns
    assert np.ptp(log["u_applied"]) > 0.1
    assert np.array_equal(rows["applied"], log["u_applied"])
    for k, name in enumerate(("psi", "theta")):
        assert np.ptp(log[f"{name}_counts"]) > 10
        assert np.array_equal(np.abs(rows["counts"][:-1, k]), np.abs(log[f"{name}_counts"][1:]))


def test_of_a_step_everything_is_drawn_beside_what_the_model_would_show_and_its_swing_is_read(
    rig, tmp_path, monkeypatch
):
    drawn, y, _ = played(rig, ONE_STEP, tmp_path, monkeypatch)
    assert drawn["time"] == pytest.approx(drawn["seconds"], abs=0.01)
    for (t, shown), true in zip(drawn["measured"], y.T, strict=True):
        at = np.round(np.array(t) / rig.model.period).astype(int)
        assert np.abs(true[at] - shown).max() <= 1.01 / min(map(abs, rig.model.per_unit))
    low, high = sorted(omega for omega, _ in drawn["modes"].values())
    assert low == drawn["modes"]["held"][0]
    assert 0.95 * low < drawn["reading"]["omega"] < 1.02 * high
    assert list(tmp_path.glob("*.frequency.csv")) == []


def test_what_is_costly_is_done_by_one_at_a_time_and_by_whoever_must_have_it():
    sparing, sure, go = Sparing(), threading.Event(), threading.Event()

    def working():
        with sparing.turn(wait=True) as mine:
            assert mine
            sure.set()
            assert go.wait(SOON)

    first = threading.Thread(target=working)
    first.start()
    assert sure.wait(SOON)
    with sparing.turn(wait=False) as mine:
        assert not mine
    go.set()
    with sparing.turn(wait=True) as mine:
        assert mine
    first.join(SOON)


def test_a_rig_that_can_really_move_is_recorded_by_somebody_beside_it(rig):
    for kind in (SWEEP, ONE_STEP):
        with pytest.raises(BadInput, match="upright lab"):
            recording_plan(hardware(rig), kind)
