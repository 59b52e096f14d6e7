"""What every rig must do, whatever it is made of; `test_conformance` runs it over all rigs that can be had here.

A rig joins by a `Specimen` in `SPECIMENS` there: how it is made, still at zero, and what it can do. Time passes by
`exchange` alone, so that the same tests run in virtual time and, slowly, on a board.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

from upright.errors import RigStopped, UprightError
from upright.laws import Law, state_feedback
from upright.rigs import Capabilities, Fault, Limits, LiveRig, Mode


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """A kind of rig to test.

    `moves` is false where nothing answers a command, as on a replay; `silence` lets so many seconds pass while nobody
    speaks to the rig, None where that cannot be had.
    """

    name: str
    make: Callable[[], LiveRig]
    moves: bool = True
    silence: Callable[[LiveRig, float], None] | None = None


def limits_of(about: Capabilities, **changes) -> Limits:
    n = len(about.coordinates)
    wide = Limits(
        travel=(6.0,) * n, speed=(200.0,) * n, start=(0.5,) * n, command=about.full_scale / 4,
        watchdog=10 * about.period,
    )  # fmt: skip
    return replace(wide, **changes)


def opened(rig: LiveRig, **changes) -> Capabilities:
    about = rig.open()
    rig.clear_fault()
    rig.configure(limits_of(about, **changes))
    rig.zero()
    return about


def running(rig: LiveRig, mode: Mode = Mode.HOST, law: Law | None = None, **changes) -> Capabilities:
    about = opened(rig, **changes)
    rig.arm()
    rig.start(mode, law)
    return about


def quiet_law(about: Capabilities) -> Law:
    """Some damping on the driven coordinate, far from any limit."""
    p = len(about.coordinates)
    K = [0.0] * (2 * p)
    K[1] = 1e-3 * about.full_scale
    law = state_feedback(K, about.period)
    return replace(law, B=law.B, begin=None)


class Conformance:
    """The rules, one test each."""

    @pytest.fixture
    def rig(self, specimen):
        made = specimen.make()
        yield made
        made.close()

    def test_it_says_what_it_is(self, rig):
        about = rig.open()
        assert about.name
        assert len(about.coordinates) == len(about.counts)
        assert all(c != 0 and math.isfinite(c) for c in about.counts)
        assert about.full_scale > 0
        assert about.period > 0
        assert Mode.HOST in about.modes

    def test_nothing_answers_before_it_is_opened(self, rig):
        for call in (rig.zero, rig.arm, rig.stop, lambda: rig.exchange(0.0), rig.clear_fault):
            with pytest.raises(RigStopped):
                call()
        rig.estop()
        rig.close()

    def test_a_reset_is_told_and_has_to_be_cleared(self, rig):
        about = rig.open()
        tick = rig.exchange(0.0)
        assert tick.mode == Mode.FAULT
        assert Fault.RESET in tick.faults
        with pytest.raises(RigStopped) as refused:
            rig.configure(limits_of(about))
        assert str(refused.value)[0].isupper()  # as sentences begin, also one that begins with the rig's name
        rig.clear_fault()
        assert rig.exchange(0.0).mode == Mode.IDLE

    def test_limits_are_read_back_no_wider_than_they_were_asked(self, rig):
        about = rig.open()
        rig.clear_fault()
        asked = limits_of(about, travel=(1.2345,) * len(about.counts), command=about.full_scale / 3)
        held = rig.configure(asked)
        assert held.command <= asked.command
        assert held.command == pytest.approx(asked.command, abs=about.step)
        for per, travel, speed in zip(about.counts, held.travel, held.speed, strict=True):
            assert travel <= 1.2345 + 1e-9
            assert travel == pytest.approx(1.2345, abs=1.001 / abs(per))
            assert speed <= 200.0 + 1e-9

    def test_a_limit_beyond_the_converter_is_refused(self, rig):
        about = rig.open()
        rig.clear_fault()
        with pytest.raises(UprightError):
            rig.configure(limits_of(about, command=2 * about.full_scale))

    def test_a_limit_of_less_than_a_count_is_refused(self, rig):
        about = rig.open()
        rig.clear_fault()
        with pytest.raises(UprightError, match="count"):
            rig.configure(limits_of(about, travel=tuple(0.4 / abs(per) for per in about.counts)))

    def test_without_limits_it_is_not_armed(self, rig):
        rig.open()
        rig.clear_fault()
        with pytest.raises(RigStopped, match="limits"):
            rig.arm()
        assert rig.exchange(0.0).mode == Mode.IDLE

    def test_the_modes_come_in_their_order(self, rig):
        opened(rig)
        with pytest.raises(RigStopped):
            rig.start(Mode.HOST)
        with pytest.raises(RigStopped):
            rig.self_test(0.1, 0.01)
        assert rig.exchange(0.0).mode == Mode.IDLE
        rig.arm()
        assert rig.exchange(0.0).mode == Mode.ARMED
        with pytest.raises(RigStopped):
            rig.arm()
        with pytest.raises(RigStopped):
            rig.zero()
        rig.start(Mode.HOST)
        assert rig.exchange(0.0).mode == Mode.HOST
        with pytest.raises(RigStopped):
            rig.zero()
        with pytest.raises(RigStopped):
            rig.clear_fault()
        rig.stop()
        assert rig.exchange(0.0).mode == Mode.IDLE

    def test_limits_are_not_changed_under_way(self, rig):
        about = running(rig)
        with pytest.raises(RigStopped):
            rig.configure(limits_of(about))

    def test_a_command_is_put_out_only_while_a_loop_runs(self, rig):
        about = opened(rig)
        asked = 10 * about.step
        assert rig.exchange(asked).applied == 0.0
        rig.arm()
        assert rig.exchange(asked).applied == 0.0
        rig.start(Mode.HOST)
        assert rig.exchange(asked).applied == pytest.approx(asked, abs=about.step / 2)
        rig.stop()
        assert rig.exchange(asked).applied == 0.0

    @pytest.mark.parametrize("share", [0.3333, -0.3333, 5.0, -5.0])
    def test_a_command_is_rounded_to_the_converter_and_held_to_the_limit(self, rig, share):
        about = running(rig)
        most = about.full_scale / 4
        applied = rig.exchange(share * most).applied
        assert abs(applied) <= most + 1e-9
        assert applied == pytest.approx(max(-most, min(most, share * most)), abs=about.step * 0.501)
        assert applied / about.step == pytest.approx(round(applied / about.step), abs=1e-6)

    @pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf])
    def test_what_is_no_number_stops_it_at_once(self, rig, command):
        running(rig)
        rig.exchange(0.0)
        try:
            tick = rig.exchange(command)
        except RigStopped:
            tick = rig.exchange(0.0)
        assert tick.applied == 0.0
        assert tick.mode == Mode.FAULT
        assert Fault.GAINS in tick.faults

    def test_ticks_and_time_go_on(self, rig):
        about = running(rig)
        ticks = [rig.exchange(0.0) for _ in range(20)]
        gaps = [b.tick - a.tick for a, b in pairwise(ticks)]
        assert min(gaps) >= 1
        for (a, b), n in zip(pairwise(ticks), gaps, strict=True):
            assert b.time - a.time == pytest.approx(n * about.period, rel=0.5)

    def test_a_fault_is_latched_until_it_is_cleared(self, rig):
        opened(rig)
        rig.arm()
        rig.estop()
        tick = rig.exchange(0.0)
        assert tick.mode == Mode.FAULT
        assert Fault.STOP in tick.faults
        for call in (rig.arm, lambda: rig.start(Mode.HOST), rig.zero):
            with pytest.raises(RigStopped):
                call()
        rig.stop()
        assert rig.exchange(0.0).mode == Mode.FAULT
        rig.clear_fault()
        assert rig.exchange(0.0).faults == Fault(0)
        rig.arm()
        assert rig.exchange(0.0).mode == Mode.ARMED

    def test_a_stop_by_hand_zeroes_the_command_from_any_mode(self, rig):
        about = running(rig)
        assert rig.exchange(20 * about.step).applied != 0.0
        rig.estop()
        tick = rig.exchange(20 * about.step)
        assert tick.applied == 0.0
        assert Fault.STOP in tick.faults

    def test_off_the_start_window_it_is_not_armed(self, rig, specimen):
        if not specimen.moves:
            pytest.skip("nothing moves it there")
        about = opened(rig)
        rig.arm()
        rig.start(Mode.HOST)
        for _ in range(round(1.0 / about.period)):
            tick = rig.exchange(about.full_scale / 4)
            if abs(tick.counts[0]) > 100:
                break
        rig.stop()
        away = abs(tick.counts[0] / about.counts[0])
        assert abs(tick.counts[0]) > 100
        rig.configure(limits_of(about, start=(away / 4, *(math.inf,) * (len(about.counts) - 1))))
        with pytest.raises(RigStopped):
            rig.arm()
        tick = rig.exchange(0.0)
        assert tick.mode != Mode.ARMED
        assert Fault.START in tick.faults
        rig.clear_fault()
        rig.zero()
        rig.arm()

    @pytest.mark.parametrize("which", ["travel", "speed"])
    def test_travel_and_speed_are_limited(self, rig, specimen, which):
        if not specimen.moves:
            pytest.skip("nothing moves it there")
        n = 2 if which == "travel" else 3
        about = rig.open()
        coordinates = len(about.counts)
        tight = (0.02 if which == "travel" else n / abs(about.counts[0]) / about.period,)
        rest = (math.inf,) * (coordinates - 1)
        rig.clear_fault()
        rig.configure(limits_of(about, **{which: tight + rest}))
        rig.zero()
        rig.arm()
        rig.start(Mode.HOST)
        for _ in range(round(2.0 / about.period)):
            tick = rig.exchange(about.full_scale / 4)
            if tick.faults:
                break
        assert {"travel": Fault.OVERTRAVEL, "speed": Fault.OVERSPEED}[which] in tick.faults
        assert tick.mode == Mode.FAULT
        assert tick.applied == 0.0

    def test_a_command_at_its_limit_for_too_long_ends_it(self, rig, specimen):
        if not specimen.moves:
            pytest.skip("a replay may end before")
        about = rig.open()
        rig.clear_fault()
        rig.configure(limits_of(about, command=20 * about.step, saturation=10 * about.period))
        rig.zero()
        rig.arm()
        rig.start(Mode.HOST)
        ticks = [rig.exchange(20 * about.step) for _ in range(13)]
        assert ticks[8].mode == Mode.HOST
        assert Fault.SATURATION in ticks[-1].faults
        # a break in between starts the clock anew
        rig.clear_fault()
        rig.arm()
        rig.start(Mode.HOST)
        for k in range(30):
            tick = rig.exchange(20 * about.step if k % 6 else 0.0)
        assert tick.mode == Mode.HOST

    @pytest.mark.parametrize("mode", [Mode.HOST, Mode.MCU])
    def test_silence_of_the_host_ends_it(self, rig, specimen, mode):
        if specimen.silence is None:
            pytest.skip("time passes by exchanges alone")
        about = rig.open()
        if mode not in about.modes:
            pytest.skip(f"it has no mode {mode.name}")
        rig.close()
        running(rig, mode, quiet_law(about) if mode == Mode.MCU else None)
        rig.exchange(0.0)
        specimen.silence(rig, 5 * about.period)
        assert rig.exchange(0.0).mode == mode
        specimen.silence(rig, 30 * about.period)
        tick = rig.exchange(0.0)
        assert Fault.WATCHDOG in tick.faults
        assert tick.applied == 0.0

    def test_a_self_test_shows_what_moved_and_leaves_it_armed(self, rig, specimen):
        if not specimen.moves:
            pytest.skip("nothing answers a pulse")
        about = opened(rig)
        rig.arm()
        found = rig.self_test(about.full_scale / 20, 0.1)
        assert set(found.moved) == set(about.coordinates)
        assert found.moved[about.coordinates[0]] > 0
        assert not found.complaint
        assert rig.exchange(0.0).mode == Mode.ARMED
        assert rig.exchange(0.0).applied == 0.0
        for pulse, seconds in ((about.full_scale, 0.1), (-about.full_scale, 0.1), (about.full_scale / 20, 0.31)):
            with pytest.raises(RigStopped):
                rig.self_test(pulse, seconds)

    def test_a_pulse_the_other_way_moves_it_the_other_way(self, rig, specimen):
        if not specimen.moves:
            pytest.skip("nothing answers a pulse")
        about = opened(rig)
        rig.arm()
        assert rig.self_test(-about.full_scale / 20, 0.1).moved[about.coordinates[0]] < 0

    def test_its_own_loop_needs_a_sound_law(self, rig):
        about = opened(rig)
        if Mode.MCU not in about.modes:
            rig.arm()
            with pytest.raises(RigStopped):
                rig.start(Mode.MCU, quiet_law(about))
            return
        rig.arm()
        with pytest.raises(RigStopped):
            rig.start(Mode.MCU)
        rig.stop()
        rig.arm()
        mad = replace(quiet_law(about), D=quiet_law(about).D * 1e9)
        with pytest.raises(RigStopped):
            rig.start(Mode.MCU, mad)
        tick = rig.exchange(0.0)
        assert Fault.GAINS in tick.faults
        assert tick.applied == 0.0

    @pytest.mark.parametrize("share", [0.99, 1.01])
    def test_a_count_that_stays_may_not_become_the_whole_command(self, rig, share):
        """An integrator that adds a hundredth of it in each of the 100 samples for which a count is held: no single
        sample shows more than 1 %, and 1 % to either side of the bound is what float32 tells apart."""
        about = opened(rig)
        if Mode.MCU not in about.modes:
            pytest.skip("it has no loop of its own")
        rig.arm()
        p, most = len(about.coordinates), limits_of(about).command
        each = [share * most * abs(about.counts[0]) / 100, *[0.0] * (p - 1)]
        adding = Law(np.eye(1), np.array([each]), np.ones((1, 1)), np.zeros((1, p)))
        if share < 1:
            rig.start(Mode.MCU, adding)
            return
        with pytest.raises(RigStopped, match=r"absurd|one that stays"):
            rig.start(Mode.MCU, adding)
        tick = rig.exchange(0.0)
        assert Fault.GAINS in tick.faults
        assert tick.applied == 0.0

    def test_its_own_loop_runs_the_law(self, rig):
        about = rig.open()
        if Mode.MCU not in about.modes:
            pytest.skip("it has no loop of its own")
        rig.close()
        running(rig, Mode.MCU, quiet_law(about))
        for _ in range(10):
            tick = rig.exchange(0.0)
        assert tick.mode == Mode.MCU
        rig.stop()
        assert rig.exchange(0.0).mode == Mode.IDLE

    def test_closing_zeroes_and_may_be_done_twice(self, rig):
        running(rig)
        rig.close()
        rig.close()
        with pytest.raises(RigStopped):
            rig.exchange(1.0)
        rig.open()
        assert rig.exchange(0.0).mode == Mode.FAULT
