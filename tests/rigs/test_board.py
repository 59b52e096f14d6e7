"""Does a board without firmware look at every limit, in its unit, on either side of it, whatever counts it reads?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.control.dead_encoder import StillDrive
from upright.errors import RigStopped
from upright.laws import state_feedback
from upright.records import Record
from upright.rigs import Board, Capabilities, Fault, Limits, Mode, SelfTest, Tick
from upright.rigs.replay import ReplayPort
from upright.rigs.supervisor import Duty, Supervisor, unlike
from upright.rigs.twin import BrokenEncoders

ABOUT = Capabilities(
    name="a board", coordinates=("x", "theta"), counts=(1000.0, -100.0), command_unit="V", full_scale=10.0, steps=100,
    period=0.01, modes=frozenset({Mode.HOST, Mode.MCU}),
)  # fmt: skip
WIDE = Limits(
    travel=(1e6, 1e6), speed=(1e6, 1e6), start=(1e6, 1e6), command=5.0, watchdog=1.0, saturation=100.0
)  # fmt: skip


class Script:
    """A port that shows counts as they were written down, the last of them for ever."""

    def __init__(self, counts=((0, 0),), about=ABOUT):
        self.counts, self.about = list(counts), about
        self.row, self.time, self.written, self.enabled, self.closed = 0, 0.0, [], [], 0
        self.calls = []

    def open(self):
        return self.about

    def write(self, command):
        self.written.append(command)
        self.calls.append(("write", command))

    def enable(self, on):
        self.enabled.append(on)
        self.calls.append(("enable", on))

    def advance(self):
        self.row += 1
        self.time += self.about.period
        return self.time

    def read(self):
        return self.counts[min(self.row, len(self.counts) - 1)]

    def zero(self):
        pass

    def close(self):
        self.closed += 1


def armed(counts=((0, 0),), about=ABOUT, **changes):
    port = Script(counts, about)
    board = Board(port)
    board.open()
    board.clear_fault()
    board.configure(replace(WIDE, **changes))
    board.arm()
    return board, port


def test_a_power_stage_goes_on_behind_a_zero_and_is_switched_off_again_in_every_tick_off():
    """A converter and a line that lost what they were given get it again."""
    board, port = armed()
    assert port.calls[-2:] == [("write", 0.0), ("enable", True)]
    board.start(Mode.HOST)
    board.exchange(2.0)
    for off in (board.stop, board.estop):
        off()
        port.calls.clear()
        for _ in range(3):
            board.exchange(2.0)
        assert port.calls == [("write", 0.0), ("enable", False)] * 3


def ran(counts, ticks, mode=Mode.HOST, command=0.0, **changes):
    """Faults tick by tick."""
    board, _ = armed(counts, **changes)
    board.start(mode)
    return [board.exchange(command).faults for _ in range(ticks)]


@pytest.mark.parametrize(
    ("limits", "counts", "fault"),
    [
        ({"travel": (0.05, 1e6)}, [(0, 0), (50, 0), (51, 0)], Fault.OVERTRAVEL),
        ({"travel": (1e6, 0.05)}, [(0, 0), (0, 5), (0, 6)], Fault.OVERTRAVEL),
        ({"travel": (0.05, 1e6)}, [(0, 0), (-50, 0), (-51, 0)], Fault.OVERTRAVEL),
        ({"speed": (2.0, 1e6)}, [(0, 0), (20, 0), (-1, 0)], Fault.OVERSPEED),
        ({"speed": (1e6, 2.0)}, [(0, 0), (0, -2), (0, 1)], Fault.OVERSPEED),
        ({"twist": 0.05}, [(0, 0), (20, 3), (21, 3)], Fault.TWIST),  # theta counts backwards
        ({"frozen": 0.05}, [(0, 0), (50, 0), (51, 0)], Fault.ENCODER),
        ({"frozen": 0.05}, [(0, 0), (0, 5), (0, 6)], Fault.ENCODER),
    ],
)
def test_a_limit_itself_is_within_and_a_count_more_is_not(limits, counts, fault):
    assert ran(counts, 2, **limits) == [0, fault]


def test_a_coordinate_that_shows_a_count_begins_to_be_looked_at_anew():
    way = [(0, 0), (30, 0), (40, 0), (50, 1), (70, 1), (100, 1), (101, 1)]
    # the sample with the count of theta is the last of the old way
    assert ran(way, 6, frozen=0.05) == [0, 0, 0, 0, 0, Fault.ENCODER]


def test_a_command_may_stay_at_its_limit_for_its_time():
    board, port = armed(saturation=0.05)
    board.start(Mode.HOST)
    assert [board.exchange(u).faults for u in (5.0,) * 5 + (4.9,) + (-7.0,) * 5] == [0] * 11
    assert port.written[-5:] == [-5.0] * 5
    assert board.exchange(-5.0).faults == Fault.SATURATION
    assert (port.written[-1], port.enabled[-1], board.sample.applied) == (0.0, False, 0.0)
    assert board.exchange(3.0).mode == Mode.FAULT
    assert port.written[-1] == 0.0


@pytest.mark.parametrize(("asked", "put"), [(0.049, 0.0), (0.051, 0.1), (-0.049, 0.0), (-0.051, -0.1), (9.0, 5.0)])
def test_a_command_is_put_out_as_the_nearest_step_within_its_limit(asked, put):
    board, port = armed()
    board.start(Mode.HOST)
    assert board.exchange(asked).applied == pytest.approx(put)
    assert port.written[-1] == pytest.approx(put)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_no_number_is_put_out_as_zero(value):
    board, port = armed()
    board.start(Mode.HOST)
    board.exchange(1.0)
    assert board.exchange(value).faults == Fault.GAINS
    assert port.written[-1] == 0.0


def test_a_host_may_be_silent_for_the_watchdogs_time():
    board, _ = armed(watchdog=0.05)
    board.start(Mode.HOST)
    # silence begins with the tick of the last command
    assert board.alone(0.05).faults == 0
    assert board.exchange(1.0).applied == 1.0
    assert board.alone(0.05).faults == 0
    assert board.alone(0.01).faults == Fault.WATCHDOG
    idle, _ = armed(watchdog=0.05)
    assert idle.alone(1.0).faults == 0  # nobody need speak to a rig that is only armed
    assert idle.sample.tick == 100


def test_limits_are_held_in_whole_counts_and_steps_of_the_safe_side():
    port = Script()
    board = Board(port)
    board.open()
    board.clear_fault()
    held = board.configure(Limits(
        travel=(0.0129, 0.129), speed=(1.19, math.inf), start=(0.0119, 0.119), command=4.99, watchdog=0.3,
        saturation=0.7,
    ))  # fmt: skip
    assert held.travel == pytest.approx((0.012, 0.12))
    assert held.start == pytest.approx((0.011, 0.11))
    assert held.speed == (pytest.approx(1.1), math.inf)
    assert held.command == pytest.approx(4.9)
    assert (held.watchdog, held.saturation) == (0.3, 0.7)
    assert board.configure(replace(WIDE, command=10.0)).command == 10.0
    for changes, words in (
        ({"command": 10.1}, "beyond the converter's 10 V"), ({"command": 0.09}, "less than a step of 0.1 V"),
        ({"travel": (0.0009, 1.0)}, "travel is less than a count"),
    ):  # fmt: skip
        with pytest.raises(RigStopped, match=words):
            board.configure(replace(WIDE, **changes))
    with pytest.raises(RigStopped, match="limits are for 1 coordinates, and it has 2"):
        board.configure(replace(WIDE, travel=(1.0,), speed=(1.0,), start=(1.0,)))


def test_a_start_window_is_looked_at_in_the_coordinates_unit():
    armed([(50, 5)], start=(0.05, 0.05))
    for counts in ((51, 5), (50, -6)):
        with pytest.raises(RigStopped, match=r"is at .*, and a run starts within 0\.05 of zero"):
            armed([counts], start=(0.05, 0.05))


def test_a_self_test_shows_the_farthest_of_pulse_and_rest_with_its_sign():
    way = [(7, 2), (8, 2), (17, 4), (12, 1), (2, -9), (-4, 2), (7, 2)]
    board, port = armed(way, start=(1.0, 1.0))
    found = board.self_test(0.5, 0.03)
    # from (7, 2): 11 counts back against 10 forth; 11 back of a theta that counts backwards
    assert found.moved == pytest.approx({"x": -0.011, "theta": 0.11})
    assert found.complaint == ""
    assert port.written[1:] == [0.5] * 3 + [0.0] * 4
    still, _ = armed([(7, 2), (8, 2), (7, 2)])
    assert still.self_test(-0.5, 0.01).complaint == "Nothing moved: theta showed not a single count."


@pytest.mark.parametrize(("pulse", "seconds"), [(5.1, 0.1), (-5.1, 0.1), (0.0, 0.1), (1.0, 0.31), (1.0, 0.0)])
def test_a_pulse_beyond_the_limit_or_the_time_is_refused(pulse, seconds):
    board, port = armed()
    with pytest.raises(RigStopped, match=r"takes a pulse up to 5 V for up to 0\.3 s"):
        board.self_test(pulse, seconds)
    assert set(port.written) == {0.0}


def test_a_pulse_of_the_limit_and_the_longest_time_is_given_and_ends_at_a_limit():
    board, _ = armed()
    board.self_test(-5.0, 0.3)
    stopped, port = armed([(0, 0), (0, 0), (60, 0)], travel=(0.05, 1.0))
    with pytest.raises(RigStopped, match="a coordinate left its travel"):
        stopped.self_test(1.0, 0.1)
    assert port.written[-1] == 0.0


def test_its_own_loop_runs_the_law_on_its_readings():
    board, _ = armed([(0, 0), (0, 0), (100, 0), (100, 50)])
    law = state_feedback([2.0, 0.0, 1.0, 0.0], 0.01)
    board.start(Mode.MCU, replace(law, begin=None))
    applied = [board.exchange(0.0).applied for _ in range(4)]
    # the law answers the sample before: 0.1 m, then 0.1 m and -0.5 rad
    assert applied == pytest.approx([0.0, 0.0, -0.2, 0.3])


def test_a_board_that_is_opened_has_put_nothing_out_and_waits_to_be_cleared():
    port = Script([(7, -2)])
    board = Board(port)
    board.estop()  # of a board that is not there nothing can be put out
    assert board.sample == Tick(tick=0, time=0.0, counts=(), applied=0.0, mode=Mode.IDLE, faults=Fault.RESET)
    with pytest.raises(RigStopped, match="The rig is not open; open it first"):
        board.exchange(1.0)
    assert (port.written, port.enabled) == ([], [])
    assert board.open() == ABOUT
    assert board.sample == Tick(tick=0, time=0.0, counts=(7, -2), applied=0.0, mode=Mode.FAULT, faults=Fault.RESET)
    assert board.exchange(1.0).applied == 0.0
    assert (board.sample.tick, board.sample.time, board.sample.faults) == (1, 0.01, Fault.RESET)
    board.close()
    board.close()
    assert (port.closed, set(port.written), set(port.enabled)) == (2, {0.0}, {False})


def test_ticks_and_times_go_on_with_the_port():
    board, port = armed()
    first = board.sample
    second = board.exchange(0.0)
    assert second.tick - first.tick == 1
    assert second.time == pytest.approx(0.01)
    board.stop()
    assert board.sample.mode == Mode.IDLE
    board.close()
    assert (port.closed, port.enabled[-1]) == (1, False)


def test_an_answer_to_a_pulse_is_held_to_the_model_s():
    def says(moved, wanted=1.0):
        return unlike(SelfTest(moved={"x": moved}), SelfTest(moved={"x": wanted}))

    assert unlike(SelfTest(moved={"x": 5.0}), None) == ""
    for fine in (0.67, 1.0, 1.49):
        assert says(fine) == ""
        assert says(-fine, -1.0) == ""
    assert says(1.52) == "x showed 1.5 times its model's motion: correct its counts per turn."
    assert "showed 0.66 times" in says(0.66)
    assert says(0.09).startswith("x hardly moved (0.09, its model 1)")
    assert says(-0.09).startswith("x hardly moved")
    assert says(-0.11).startswith("x went the wrong way (-0.11, its model 1)")
    assert says(3.0, 0.0) == ""  # of what the model does not move nothing is known
    assert unlike(SelfTest(moved={}), SelfTest(moved={"x": 1.0})).startswith("x hardly moved (0, its model 1)")


def watched(counts, *, limits=WIDE, **duty):
    """A supervisor of a board without a model, started where the counts begin."""
    port = Script(counts)
    beside = Supervisor(Board(port), Duty(limits=limits, **duty))
    beside.prepare(zero=False)
    law = state_feedback([0.5, 0.0, 0.0, 0.0], 0.01)
    beside.aim(replace(law, begin=None))
    beside.start()
    return beside, port


def test_a_coordinate_beyond_its_travel_or_lean_is_stopped_with_what_it_is():
    # the rig's own travel is wider
    beside, _ = watched([(0, 0)], lean=0.2)
    tick = beside.rig.exchange(0.0)
    beside.step(replace(tick, tick=tick.tick + 1, counts=(0, 20)))
    with pytest.raises(
        RigStopped, match=r"Theta is 12 degrees from where it is to be stabilised, more than 11\.5 degrees"
    ):
        beside.step(replace(tick, tick=tick.tick + 2, counts=(0, 21)))
    beside, _ = watched([(0, 0)], limits=replace(WIDE, travel=(0.05, 1e6)))
    tick = beside.rig.exchange(0.0)
    beside.step(replace(tick, tick=tick.tick + 1, counts=(50, 0)))
    with pytest.raises(RigStopped, match=r"X is at 0\.051, beyond its travel of 0\.05"):
        beside.step(replace(tick, tick=tick.tick + 2, counts=(51, 0)))


def test_samples_that_did_not_come_are_put_on_a_straight_line():
    beside, _ = watched([(0, 0)])
    tick = beside.rig.exchange(0.0)
    assert beside.step(tick) == 0.0
    u = beside.step(replace(tick, tick=tick.tick + 4, time=tick.time + 0.04, counts=(400, 0)))
    assert u == pytest.approx(-0.2)  # of 0.4 m, by a law without a memory
    assert beside.readings(replace(tick, counts=(400, 50))) == pytest.approx([0.4, -0.5])


def test_the_same_sample_may_come_again_for_the_watchdogs_time():
    beside, _ = watched([(0, 0)], limits=replace(WIDE, watchdog=0.03))
    tick = beside.rig.exchange(0.0)
    first = beside.step(tick)
    assert not beside.stale
    for _ in range(3):
        assert beside.step(tick) == first
        assert beside.stale
    with pytest.raises(RigStopped, match="the same sample 5 times"):
        beside.step(tick)


def test_a_rig_that_holds_wider_limits_is_not_run():
    class Wider(Board):
        def __init__(self, port, **changes):
            super().__init__(port)
            self.changes = changes

        def configure(self, limits):
            return replace(super().configure(limits), **self.changes)

    asked = replace(WIDE, travel=(1.0, 2.0))
    for changes, words in (
        ({"travel": (1.00001, 2.0)}, "travel of x 1.00001 instead of 1"),
        ({"travel": (1.0, 2.1)}, "travel of theta 2.1 instead of 2"),
        ({"command": 5.1}, "command 5.1 instead of 5"),
        ({"watchdog": 1.02}, "watchdog 1.02 instead of 1"),
        ({"saturation": 100.02}, "saturation 100.02 instead of 100"),
    ):  # fmt: skip
        with pytest.raises(RigStopped, match=f"holds other limits than it was given: {words}"):
            Supervisor(Wider(Script(), **changes), Duty(limits=asked)).prepare(zero=False)
    # in whole ticks a time may be one longer
    Supervisor(Wider(Script(), watchdog=1.01, saturation=100.01), Duty(limits=asked)).prepare(zero=False)


def test_a_rig_is_at_rest_after_half_a_second_without_a_count_and_not_waited_for_longer_than_30():
    moving = [(k // 10, 0) for k in range(400)]
    port = Script(moving)
    beside = Supervisor(Board(port), Duty(limits=WIDE))
    beside.prepare()
    last = max(k for k in range(1, 400) if moving[k] != moving[k - 1])
    assert port.row == pytest.approx(last + 50, abs=1)
    endless = Script([(k, 0) for k in range(4000)])
    with pytest.raises(RigStopped, match="does not come to rest within 30 s"):
        Supervisor(Board(endless), Duty(limits=WIDE)).prepare()
    assert endless.row == pytest.approx(3000, abs=3)


def test_broken_encoders_show_what_they_are_told():
    broken = BrokenEncoders(3)
    assert broken.show([0.4, 10.6, -0.6]) == (0, 11, -1)
    broken.dead(0)
    broken.scaled(1, -2.0)
    broken.lost(2, 5)
    assert broken.show([100.4, 11.6, 2.4]) == (0, 9, -3)
    broken = BrokenEncoders(1)
    broken.wrapped(0, 4)
    assert [broken.show([float(k)])[0] for k in (0, 7, 8, 15, 16, -8, -9)] == [0, 7, -8, -1, 0, -8, 7]


def replayed():
    t = np.arange(4) * 0.01
    return Record(
        t=t + 2.0, signals={"u": t, "x": np.array([0.0, 0.0014, 0.0016, 0.003])}, units={"u": "A", "x": "m"},
        inputs=("u",), outputs=("x",),
    )  # fmt: skip


def test_a_record_is_played_back_by_its_own_clock_from_where_the_power_comes_on():
    port = ReplayPort(replayed(), [1000.0], full_scale=10.0, step=0.3)
    about = port.open()
    assert (about.command_unit, about.steps, about.period) == ("A", 33, pytest.approx(0.01))
    assert about.full_scale == pytest.approx(33 * 0.3)
    assert about.replayed
    assert (port.read(), port.advance(), port.advance()) == ((0,), pytest.approx(2.01), pytest.approx(2.02))
    port.enable(True)
    shown = []
    for _ in range(4):
        shown.append((round(port.advance(), 6), port.read()[0]))
    # the two periods of waiting come before it
    assert shown == [(2.02, 0), (2.03, 1), (2.04, 2), (2.05, 3)]
    with pytest.raises(RigStopped, match="ends after 4 samples"):
        port.advance()


def test_an_arm_that_must_have_moved_forty_counts_is_missed():
    """Under a constant command less twice its dry friction: half of a t^2 in time, against 40 counts.

    Those are more here than half of what the friction would move it by in 0.1 s, which a stickier joint is allowed.
    """
    from upright.rig.makes import make_rig

    rig = make_rig("furuta")
    still = StillDrive(rig, "inverted")
    linear = rig.linear("inverted")
    held = 2.0 * rig.plant.b_1c / rig.gain
    u, shown = 3 * held, 2.5 / rig.per_unit[1]  # its pendulum goes up and down, as on all that moves
    acceleration = abs(linear.B[1, 0]) * (u - held)
    assert 40 / rig.per_unit[0] > abs(linear.B[1, 0]) * held * 0.1**2 / 4
    expected = math.sqrt(2 * 40 / rig.per_unit[0] / acceleration) / rig.period
    for command in (u, -u):
        still = StillDrive(rig, "inverted")
        ticks = next(k for k in range(1, 5000) if still.sees(0.5, [0.0, (k % 2) * shown], command))
        assert ticks == pytest.approx(expected, abs=3)
    still = StillDrive(rig, "inverted")
    assert not any(still.sees(0.5, [0.0, (k % 2) * shown], 0.99 * held) for k in range(3000))
    # each count begins anew
    still = StillDrive(rig, "inverted")
    assert not any(still.sees(0.5 + (k // 20), [0.0, (k % 2) * shown], u) for k in range(1000))
    # a lean pulls like a command
    still = StillDrive(rig, "inverted")
    lean = u * linear.B[1, 0] / linear.A[1, 2]
    ticks = next(k for k in range(1, 5000) if still.sees(0.5, [0.0, lean + (k % 2 - 0.5) * shown], 0.0))
    assert ticks == pytest.approx(expected, abs=3)
