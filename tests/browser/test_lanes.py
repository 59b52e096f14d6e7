"""Is each twin of a class what it would be by itself, whatever the others do?"""

from __future__ import annotations

import io
import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

from upright.browser.classroom.lanes import Lanes
from upright.browser.classroom.memory import BY_HAND, ENDED, HEAD, LEANT, ROWS, RUNNING, TRAVELLED, SharedLanes
from upright.browser.classroom.overview import STATES, frame
from upright.browser.classroom.process import TICKS, Attendant, LanesOrder
from upright.browser.classroom.room import LaneDesk, LaneRun
from upright.gains import feedback, filtered, place
from upright.gains.requests import read_poles
from upright.paper.reproduce import TABLE_1
from upright.realtime.reference import Reference
from upright.rig.makes import make_rig
from upright.rigs import TwinPort
from upright.rigs.law import RunningLaw
from upright.rigs.protocol import Fault
from upright.running.rig import excitation_law

SEEDS = (1, 2, 17)
AWAY = [0.0, 0.0, math.radians(3.0), 0.0]
MODEL = make_rig("furuta")
PER = MODEL.per_unit


@cache
def law(which=0):
    """The law of one of the paper's pole sets, about upright as encoders show it that were zeroed hanging."""
    linear = MODEL.linear("inverted")
    way = filtered(linear.to_sampled(MODEL.period, MODEL.delay / MODEL.period, MODEL.lag), 0.5)
    made = feedback(way, place(linear.A, linear.B, read_poles(TABLE_1[which])).K)
    return made.__class__(
        made.A, made.B, made.C, made.D, begin=made.begin, target=np.array([0.0, math.pi]), limit=MODEL.limit,
        command_resolution=MODEL.converter, references=np.zeros((1, 1)) if made.signal().shape[1] else None,
        period=made.period,
    )  # fmt: skip


def following():
    """The same law with a reference beside its readings."""
    return replace(
        law(), D=np.array([[*law().D[0, :2], 5.0]]), B=np.pad(law().B[:, :2], ((0, 0), (0, 1))),
        references=np.zeros((1, 1)),
    )  # fmt: skip


def numbers(of):
    """C and D, row by row."""
    return [*of.C.ravel().tolist(), *of.D.ravel().tolist()]


def by_itself(rig, slices, tap_at, change_at):
    """The board of `upright bench`'s twin under the law in Python, tick by tick: another kernel, another loop."""
    port = TwinPort(rig)
    port.enable(True)
    port.hold("inverted", AWAY)
    port.let_go()
    running, counts, commands = RunningLaw(law(), MODEL.period), [], []
    for k in range(slices * TICKS):
        if k == tap_at * TICKS:
            port.push([0.0, 0.8])
        if k == change_at * TICKS:
            running = running.going_on(law(1))
        counts.append(port.read())
        commands.append(running.step([n / per for n, per in zip(counts[-1], PER, strict=True)]))
        port.write(commands[-1])
        port.advance()
    return np.array(counts), np.array(commands)


def test_the_lanes_count_what_each_twin_counts_by_itself_to_the_last_bit():
    """With dry friction, delay, lag, converter; after a tap, and with other gains from the middle on."""
    lanes = Lanes([make_rig("furuta", seed) for seed in SEEDS], "inverted", "hanging", law(), TICKS)
    slices, tap_at, change_at = 24, 5, 13
    for lane in range(len(SEEDS)):
        lanes.begin(lane, AWAY)
    counts, commands = [], []
    for k in range(slices):
        for lane in range(len(SEEDS)):
            if k == tap_at:
                lanes.tap(lane, [0.0, 0.8])
            if k == change_at:
                lanes.gains(lane, numbers(law(1)))
        stretch = lanes.go()
        counts.append(stretch.counts)
        commands.append(stretch.command)
    counts, commands = np.vstack(counts), np.vstack(commands)
    for lane, seed in enumerate(SEEDS[:2]):  # the Python of a tick is slow
        alone = by_itself(make_rig("furuta", seed), slices, tap_at, change_at)
        assert np.array_equal(counts[:, lane], alone[0])
        assert np.array_equal(commands[:, lane].view(np.int64), alone[1].view(np.int64))
    assert not np.array_equal(counts[:, 0], counts[:, 1])  # nobody has another one's twin


def test_a_lane_moves_as_the_linear_equations_do_near_upright():
    """Without dry friction and 0.6 degrees off, the sine's cubic term, 2e-7 rad, is a two thousandth of a count.

    The commands are the lane's own: held for a period, a period late and through a lag of first order they drive
    ``x' = A x + B w``, which scipy's matrix exponential solves. So only a count's rounding differs, half a count: what
    is left out has the 0.25 s to grow, in which the pendulum alone grows e-fold twice.
    """
    rig = MODEL.changed(b_1c=0.0, b_2c=0.0)
    lanes = Lanes([rig], "inverted", "hanging", law(), TICKS)
    start = [0.0, 0.0, 0.01, 0.0]
    lanes.begin(0, start)
    stretches = [lanes.go() for _ in range(18)]
    counts = np.vstack([s.counts[:, 0] for s in stretches])
    command = np.concatenate([s.command[:, 0] for s in stretches])
    assert MODEL.delay == MODEL.period
    linear, flow = rig.linear("inverted"), np.zeros((6, 6))
    flow[:4, :4], flow[:4, 4], flow[4, 4:] = linear.A, linear.B[:, 0], [-1 / MODEL.lag, 1 / MODEL.lag]
    period, x, rows = expm(MODEL.period * flow), np.array([*start, 0.0]), []
    for u in (0.0, *command[:-1]):
        rows.append(x)
        x = (period @ [*x, u])[:5]
    shown = np.array(rows)[:, [0, 2]] * PER
    away = counts - np.array([0.0, round(math.pi * PER[1])])
    assert np.abs(away - shown).max() < 1.0
    assert np.ptp(shown[:, 1]) > 20  # it did move


@pytest.fixture
def room():
    """Three lanes and their memory, without a process or a clock."""
    shared = SharedLanes(len(SEEDS), 2)
    order = LanesOrder(
        rigs=[make_rig("furuta", seed) for seed in SEEDS], at="inverted", zero="hanging", law=law(),
        travel=(2.0, math.inf), lean=math.radians(30), fifo=False,
    )  # fmt: skip
    return shared, Attendant(order, shared)


def begun(shared, lane, seconds=60.0):
    """The desk of a run that is asked for."""
    desk = LaneDesk(shared, lane, AWAY[2], (0.0, math.pi), lambda asked: ("", asked))
    desk.begin(round(seconds / MODEL.period))
    return desk


def test_what_one_student_does_changes_no_bit_of_the_others(room):
    def others(disturbed):
        shared = SharedLanes(len(SEEDS), 2)
        order = LanesOrder(
            rigs=[make_rig("furuta", seed) for seed in SEEDS], at="inverted", zero="hanging", law=law(),
            travel=(2.0, math.inf), lean=math.radians(30), fifo=False,
        )  # fmt: skip
        attendant = Attendant(order, shared)
        desks = [begun(shared, lane) for lane in range(3)]
        for k in range(12):
            if disturbed and k == 3:
                desks[1].tap(1, 12.0)
                desks[1].change(law(1))
            if disturbed and k == 6:
                desks[1].stop()
            if disturbed and k == 8:
                begun(shared, 1)
            attendant.slice()
        return [desks[lane].since(0)[1][["tick", "counts", "applied"]] for lane in (0, 2)]

    for calm, beside in zip(others(False), others(True), strict=True):
        assert len(calm) == 12 * TICKS
        assert calm.tobytes() == beside.tobytes()


def test_a_stop_ends_one_run_at_the_next_slice_and_no_later_one(room):
    shared, attendant = room
    desk = begun(shared, 1)
    attendant.slice()
    desk.stop()
    attendant.slice()
    assert shared.answers()["why"].tolist() == [RUNNING, BY_HAND, RUNNING]
    assert desk.span == (0, TICKS)
    attendant.slice()
    assert desk.span == (0, TICKS)
    again = begun(shared, 1)
    desk.stop()  # of the run before
    attendant.slice()
    assert shared.answers()["why"][1] == RUNNING
    assert again.span == (3 * TICKS, 4 * TICKS)


def test_a_stop_that_comes_before_the_run_keeps_it_from_moving(room):
    shared, attendant = room
    desk = LaneDesk(shared, 0, AWAY[2], (0.0, math.pi), lambda asked: ("", asked))
    desk.stop()
    desk.begin(1000)
    attendant.slice()
    assert desk.span == (0, 0)
    assert shared.answers()["why"][0] == BY_HAND


def test_a_run_lasts_for_its_seconds_to_the_tick(room):
    shared, attendant = room
    desk = LaneDesk(shared, 0, AWAY[2], (0.0, math.pi), lambda asked: ("", asked))
    desk.begin(3 * TICKS + 5)
    for _ in range(5):
        attendant.slice()
    assert shared.answers()["why"][0] == ENDED
    assert len(desk.since(0)[1]) == 3 * TICKS + 5


def test_a_fall_ends_the_run_at_the_tick_at_which_it_leans_too_far(room):
    """As a run's own supervisor does: the sample that shows it is not answered any more."""
    shared, attendant = room
    desk = begun(shared, 2)
    attendant.slice()
    desk.tap(1, 15.0)
    for _ in range(8):
        attendant.slice()
    answer = shared.answers()[2]
    assert answer["why"] == LEANT
    first, end = desk.span
    ring = shared.counts()[:, 2, 1] / PER[1] - math.pi
    assert abs(ring[end % ROWS]) > math.radians(30)
    assert np.abs(ring[first:end]).max() <= math.radians(30)
    assert answer["value"] == pytest.approx(ring[end % ROWS] + math.pi)


def test_a_ring_that_was_not_read_in_time_gives_what_it_still_has(room):
    shared, attendant = room
    desk = begun(shared, 0)
    for _ in range(ROWS // TICKS + 3):
        attendant.slice()
    number, rows = desk.since(0)
    assert number == shared.marks()[HEAD] == ROWS + 3 * TICKS
    assert rows["number"].tolist() == list(range(number - ROWS // 2, number))


def test_every_row_of_a_run_is_kept_once_although_the_lanes_move_on_while_it_is_read(room, monkeypatch):
    _, attendant = room
    desk = begun(room[0], 0)
    attendant.slice()
    still = LaneDesk.span

    def moving(this):
        attendant.slice()
        return still.fget(this)

    run, kept = LaneRun(desk=desk, watch=lambda _: "", rows=io.BytesIO()), []
    monkeypatch.setattr(LaneDesk, "span", property(moving))
    for _ in range(5):
        ticks, rows = run.take()
        kept += rows["number"].tolist()
        assert (run.written, run.dropped) == (ticks, 0)
    assert kept == list(range(ticks))


def test_a_server_that_does_not_look_any_more_ends_every_run(room):
    shared, attendant = room
    desks = [begun(shared, lane) for lane in range(3)]
    attendant.slice()
    attendant.slice(unheard=True)
    assert all(desk.span[1] == TICKS for desk in desks)
    assert not attendant.lanes.busy.any()


def test_refused_gains_change_nothing_and_are_answered_at_once(room):
    shared, attendant = room
    desk = LaneDesk(shared, 0, AWAY[2], (0.0, math.pi), lambda asked: ("The model falls.", asked))
    desk.begin(10_000)
    attendant.slice()
    assert desk.change(law(1))
    assert desk.answered[::2] == (1, "The model falls.")
    assert shared.orders()["change"][0] == 0


def test_a_wave_that_a_student_follows_is_the_waves_own_at_every_tick():
    """A quarter of a radian either side, 0.4 s long, from the slice on at which it is taken; the ring shows it."""
    shared = SharedLanes(1, 2)
    tracking = following()
    order = LanesOrder(
        rigs=[MODEL], at="inverted", zero="hanging", law=tracking, travel=(2.0, math.inf), lean=math.radians(30),
        fifo=False,
    )  # fmt: skip
    attendant, desk = Attendant(order, shared), begun(shared, 0)
    attendant.slice()
    desk.follow(Reference(size=0.25, shape="sine", period=0.4))
    for _ in range(3):
        attendant.slice()
    assert desk.followed == (1, Reference(size=0.25, shape="sine", period=0.4), TICKS, (0.0, math.pi))
    shown = shared.numbers("reference")[: 4 * TICKS, 0]
    t = MODEL.period * np.arange(3 * TICKS)
    assert shown == pytest.approx(np.concatenate([np.zeros(TICKS), 0.25 * np.sin(math.tau * t / 0.4)]), abs=1e-15)
    running = RunningLaw(tracking, MODEL.period)
    rows = desk.since(0)[1]
    for row, reference in zip(rows, shown, strict=True):
        assert row["applied"] == running.step([n / p for n, p in zip(row["counts"], PER, strict=False)], reference)


def chirp(seconds):
    """A signal that moves arm and pendulum, and is no whole number of steps of the converter."""
    t = MODEL.period * np.arange(round(seconds / MODEL.period))
    return 1.3 * np.sin(math.tau * (1.0 + 3.0 * t) * t)


def signalled(rig, samples):
    """The board of `upright bench`'s twin at rest, moved by a signal as `upright run --excite` moves it."""
    port = TwinPort(rig)
    port.enable(True)
    blind = replace(
        excitation_law(samples, 2, MODEL.period), limit=MODEL.limit, command_resolution=MODEL.converter,
        target=np.zeros(2), references=np.zeros((1, 1)),
    )  # fmt: skip
    running, counts, commands = RunningLaw(blind, MODEL.period), [], []
    for sample in samples:
        counts.append(port.read())
        commands.append(running.step([n / per for n, per in zip(counts[-1], PER, strict=True)], sample))
        port.write(commands[-1])
        port.advance()
    return np.array(counts), np.array(commands)


def test_a_signal_moves_a_lane_at_rest_as_its_twin_by_itself_to_the_last_bit_and_leaves_nothing_behind():
    """It hangs, which is no fall; the run lasts as long as the signal; the next one is as if none had been before."""
    samples = chirp(0.3)

    def attended():
        shared = SharedLanes(2, 2)
        order = LanesOrder(
            rigs=[make_rig("furuta", seed) for seed in (2, 17)], at="inverted", zero="hanging", law=following(),
            travel=(2.0, math.inf), lean=math.radians(30), fifo=False, signals=[chirp(0.1), samples],
        )  # fmt: skip
        return shared, Attendant(order, shared)

    shared, attendant = attended()
    desk = LaneDesk(shared, 1, 0.0, (0.0, 0.0), lambda asked: ("", asked), 2)
    desk.begin(len(samples))
    for _ in range(len(samples) // TICKS + 2):
        attendant.slice()
    assert shared.answers()["why"][1] == ENDED
    _, rows = desk.since(0)
    counts, commands = signalled(make_rig("furuta", 17), samples)
    assert np.ptp(counts, axis=0).min() > 50
    assert np.array_equal(rows["counts"][:, :2], counts)
    assert np.array_equal(rows["applied"].view(np.int64), commands.view(np.int64))
    again, (fresh, other) = begun(shared, 1), attended()
    first = begun(fresh, 1)
    for _ in range(12):
        attendant.slice()
        other.slice()
    mine, plain = (each.since(0)[1][["counts", "applied"]] for each in (again, first))
    assert mine.tobytes() == plain.tobytes()


def test_a_signal_ends_where_the_travel_does():
    shared = SharedLanes(1, 2)
    order = LanesOrder(
        rigs=[MODEL], at="inverted", zero="hanging", law=following(), travel=(0.05, math.inf), lean=math.radians(30),
        fifo=False, signals=[np.full(2000, 3.0)],
    )  # fmt: skip
    attendant, desk = Attendant(order, shared), LaneDesk(shared, 0, 0.0, (0.0, 0.0), lambda asked: ("", asked), 1)
    desk.begin(2000)
    for _ in range(2000 // TICKS):
        attendant.slice()
    first, end = desk.span
    assert shared.answers()["why"][0] == TRAVELLED
    assert abs(shared.counts()[end % ROWS, 0, 0] / PER[0]) > 0.05
    assert np.abs(shared.counts()[first:end, 0, 0] / PER[0]).max() <= 0.05


def test_a_frame_of_the_class_has_six_bytes_for_each_student():
    """Read by its description: 60 students at 5 a second cost 1.8 kB/s, less than a tenth of one rig's samples."""
    states = ["idle", "running", "stopped", "stopped"]
    faults = [Fault(0), Fault(0), Fault.STOP, Fault.OVERTRAVEL]
    stations = [
        SimpleNamespace(state=s, origin="held", lease=SimpleNamespace(holder="x" * (s != "idle")),
                        last=SimpleNamespace(faults=f, time=12.7))
        for s, f in zip(states, faults, strict=True)
    ]  # fmt: skip
    sent = frame(SimpleNamespace(stations=stations, late=70_000, away=np.array([0.0, -0.0174, 0.3, 40.0])))
    assert len(sent) == 6 + 6 * 4
    assert int.from_bytes(sent[:2], "little"), int.from_bytes(sent[2:6], "little") == (4, 70_000)
    read = [(STATES[b[0]], b[1], int.from_bytes(b[2:4], "little", signed=True), int.from_bytes(b[4:], "little"))
            for b in (sent[6 + 6 * i : 12 + 6 * i] for i in range(4))]  # fmt: skip
    assert read == [("idle", 0, 0, 12), ("running", 1, -17, 12), ("stopped", 1, 300, 12), ("fell", 1, 32767, 12)]
    assert 5 * (6 + 6 * 60 + 4) < 2000  # and four bytes of the socket
