"""Does whoever stands beside a rig stop it in time, zero first, and start it without a jump?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.control.dead_encoder import UNSEEN, StillDrive
from upright.errors import BadInput, RigStopped
from upright.gains import feedback, filtered, place
from upright.laws import Rule, state_feedback
from upright.rig.makes import make_rig
from upright.rigs import Board, Capabilities, Fault, Limits, Mode, TwinPort
from upright.rigs.supervisor import PLAIN, PULSES, Duty, Supervisor
from upright.simulation import simulate

RIG = make_rig("furuta")
MODEL = RIG.linear("inverted")
SAMPLED = MODEL.to_sampled(RIG.period, RIG.delay / RIG.period)
POLES = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]
LAW = feedback(filtered(SAMPLED, 0.5), place(MODEL.A, MODEL.B, POLES).K)
LIMITS = Limits(travel=(2.0, math.inf), speed=(40.0, 60.0), start=(2.0, math.inf), command=RIG.limit)
DUTY = Duty(limits=LIMITS, model=RIG, at="inverted", zero="hanging", lean=math.radians(25), near=math.radians(10))


class Scene:
    """A twin, its supervisor, and a hand."""

    def __init__(self, duty=DUTY, truth=RIG):
        self.port = TwinPort(truth)
        self.rig = Board(self.port)
        self.told: list[tuple[str, float, bool]] = []
        self.beside = Supervisor(self.rig, duty, event=self._hear)

    def _hear(self, _t, kind, text):
        self.told.append((kind, self.rig.sample.applied, self.port._enabled))

    def started(self, tilt=0.05, law=LAW, mode=Mode.HOST):
        self.beside.prepare()
        self.port.hold("inverted", [0.0, 0.0, tilt, 0.0])
        self.beside.aim(law)
        self.beside.start(mode)
        self.port.let_go()
        return self

    def run(self, seconds, then=None, after=0.3):
        """Ticks of the loop; `then` is called after so many seconds."""
        tick, ticks = self.rig.exchange(0.0), []
        n = round(seconds / RIG.period)
        for k in range(n):
            if then is not None and k == round(after / RIG.period):
                then(self.port)
            tick = self.rig.exchange(self.beside.step(tick))
            ticks.append(tick)
        return ticks


def test_a_sound_rig_passes_its_check_and_is_held():
    scene = Scene()
    scene.beside.prepare()
    found = scene.beside.check()
    assert all(v != 0 for v in found.moved.values())
    scene.port.hold("inverted", [0.0, 0.0, 0.05, 0.0])
    scene.beside.aim(LAW)
    scene.beside.start()
    scene.port.let_go()
    ticks = scene.run(1.2)
    assert abs(ticks[-1].counts[1] / RIG.per_unit[1] - math.pi) < 0.01
    scene.beside.finish()
    assert scene.rig.sample.mode == Mode.IDLE
    assert [kind for kind, _, _ in scene.told] == ["self-test", "start", "stop"]


@pytest.mark.parametrize("seed", range(1, 6))
def test_rigs_of_a_make_pass_by_the_model_of_another(seed):
    scene = Scene(truth=make_rig("furuta", seed))
    scene.beside.prepare()
    scene.beside.check()


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (lambda e: e.dead(1), "theta showed not"),
        (lambda e: e.dead(0), "psi showed not"),
        (lambda e: e.scaled(1, -1.0), "Theta went the wrong way"),
        (lambda e: e.scaled(0, -1.0), "Psi went the wrong way"),
        (lambda e: e.scaled(0, 2.0), r"Psi showed (2|1\.9\d*) times"),
        (lambda e: e.scaled(1, 0.25), r"Theta showed 0\.2\d* times"),
        (lambda e: e.scaled(1, 4.0), r"Theta showed (4|3\.9\d*|4\.0\d*) times"),
    ],
)
def test_a_broken_encoder_fails_the_check(broken, said):
    scene = Scene()
    scene.beside.prepare()
    broken(scene.port.encoders)
    with pytest.raises(RigStopped, match=said):
        scene.beside.check()
    assert Fault.STOP in scene.rig.sample.faults


def moved_by(rig, pulse, seconds=0.15):
    """Counts that a pulse moves each coordinate by, until it has lasted and for as long after it."""
    ticks = round(seconds / rig.period)
    u = np.append(0.0, np.repeat([pulse, 0.0], ticks))
    x = simulate(rig.plant, rig.drive, rig.plant.state("hanging"), u, rig.period, samples=2 * ticks + 2)[:, 0::2, 0]
    return np.abs(x).max(axis=0) * rig.per_unit


@pytest.mark.parametrize(("fineness", "share"), [(1.0, 0.02), (0.1, 0.05), (0.005, 0.4)])
def test_the_pulse_is_the_least_that_shows_plainly_or_the_largest_where_none_does(fineness, share):
    """The motion under each share of the largest command is simulated in one piece."""
    rig = RIG.replace(counts=tuple(fineness * n for n in RIG.counts))
    plain = [s for s in PULSES if moved_by(rig, s * RIG.limit).min() >= PLAIN]
    assert min(plain, default=max(PULSES)) == share
    scene = Scene(replace(DUTY, model=rig, limits=replace(LIMITS, travel=(math.inf,) * 2, speed=(math.inf,) * 2)), rig)
    puts = []
    write = scene.port.write
    scene.port.write = lambda u: (puts.append(u), write(u))
    scene.beside.prepare()
    scene.beside.check()
    assert max(puts) == pytest.approx(share * RIG.limit, abs=RIG.converter)


def test_without_limits_nothing_is_armed():
    scene = Scene(replace(DUTY, limits=None))
    with pytest.raises(RigStopped, match=r"\[limits\]"):
        scene.beside.prepare()


def test_a_rig_that_holds_other_limits_is_not_run():
    class Careless(Board):
        def configure(self, limits):
            return super().configure(replace(limits, travel=(9.0, math.inf)))

    beside = Supervisor(Careless(TwinPort(RIG)), DUTY)
    with pytest.raises(RigStopped, match="instead of 2; do not run it"):
        beside.prepare()


@pytest.mark.parametrize(("fault", "starts"), [(Fault.STOP, True), (Fault.OVERTRAVEL, False)])
def test_a_fault_that_nobody_looked_at_is_not_cleared_in_passing(fault, starts):
    class Remembers(Board):
        def open(self):
            about = super().open()
            self._faults |= fault
            return about

    beside = Supervisor(Remembers(TwinPort(RIG)), DUTY)
    if starts:
        beside.prepare()
    else:
        with pytest.raises(RigStopped, match="stopped before"):
            beside.prepare()


def test_a_start_off_its_window_is_refused():
    with pytest.raises(RigStopped, match=r"11\.5 degrees"):
        Scene().started(tilt=0.2)


@pytest.mark.parametrize("factor", [0.25, 0.5, 2.0, 4.0])
def test_half_a_turn_by_hand_shows_a_wrong_scale_at_the_start(factor):
    scene = Scene()
    scene.port.encoders.scaled(1, factor)
    with pytest.raises(RigStopped, match="a run starts within"):
        scene.started(tilt=0.0)


def test_a_start_does_not_yank_the_arm_and_takes_the_nearest_turn():
    scene = Scene()
    scene.beside.prepare()
    scene.port.hold("inverted", [0.7, 0.0, -math.tau, 0.0])
    scene.beside.aim(LAW)
    scene.beside.start()
    scene.port.let_go()
    assert scene.beside.target == pytest.approx((0.7, -math.pi), abs=1e-3)
    ticks = scene.run(0.5)
    assert max(abs(t.applied) for t in ticks) < 0.05  # upright and at rest: rounding of the encoders alone


def test_gains_that_let_the_model_fall_are_refused_before_arming():
    wrong = replace(LAW, C=-LAW.C, D=-LAW.D)
    scene = Scene()
    with pytest.raises(RigStopped, match="its model falls, by a factor e"):
        scene.started(law=wrong)
    assert not scene.port._enabled


def test_a_law_that_does_nothing_is_refused_with_the_time_in_which_its_model_falls():
    """Open, the model grows by its unstable pole: e-fold in 1/p."""
    idle = state_feedback([0.0] * 4, RIG.period)
    growth = MODEL.poles().real.max()
    with pytest.raises(RigStopped, match=rf"its model falls, by a factor e every {1 / growth:.3g} s"):
        Scene().started(law=idle)


@pytest.mark.parametrize(("share", "starts"), [(0.98, True), (1.02, False)])
def test_a_law_that_would_begin_with_all_there_is_is_not_started(share, starts):
    """At rest it answers a tilt by its gain times that; it must leave something of the largest command."""
    wide = Scene(replace(DUTY, near=math.radians(40), limits=replace(LIMITS, command=2.0)))
    tilt = share * 2.0 / abs(place(MODEL.A, MODEL.B, POLES).K[0, 2])
    if starts:
        wide.started(tilt=tilt)
        assert [kind for kind, _, _ in wide.told] == ["start"]
        return
    with pytest.raises(RigStopped, match=r"would begin with its largest command, -?2 V; bring the rig closer"):
        wide.started(tilt=tilt)
    assert wide.told == [("fault", 0.0, False)]


SHAFTS = {"torsional": ("rad", "28.6 degrees", "5.73 degrees"), "rectilinear": ("m", "500 mm", "100 mm")}


@pytest.mark.parametrize("make", SHAFTS)
def test_a_free_shaft_is_held_where_it_is_with_all_that_hangs_on_it(make):
    """Nothing pulls it back to ground: where its driven end is, the other is at rest too."""
    rig, (_, off, near) = make_rig(make), SHAFTS[make]
    model, free = rig.linear("rest"), (math.inf, math.inf)
    law = state_feedback(place(model.A, model.B, [-8.0, -9.0, -10.0, -11.0]).K[0], rig.period, memory=0.5)
    limits = Limits(travel=free, speed=free, start=free, command=rig.limit)
    scene = Scene(Duty(limits=limits, model=rig, at="rest", zero="rest", near=0.1, watch=False), rig)
    scene.beside.prepare()
    scene.port.hold("rest", [0.3, 0.0, 0.3, 0.0])
    scene.beside.aim(law)
    assert scene.beside.target == pytest.approx((0.3, 0.3), abs=2e-3)
    scene.port.hold("rest", [0.3, 0.0, 0.8, 0.0])
    with pytest.raises(RigStopped, match=rf"2 is {off} from where it is to be stabilised, .* within {near};"):
        scene.beside.aim(law)


def test_absurd_gains_and_foreign_laws_are_refused():
    with pytest.raises(RigStopped, match="absurd"):
        Scene().started(law=replace(LAW, D=LAW.D * 1e6))
    with pytest.raises(BadInput, match="period"):
        Scene().started(law=replace(LAW, period=2e-3))


@pytest.mark.parametrize(
    ("what", "fault"),
    [
        (lambda p: p.encoders.dead(1), Fault.ENCODER | Fault.MODEL),
        (lambda p: p.encoders.scaled(1, -1.0), Fault.MODEL | Fault.OVERTRAVEL),
        (lambda p: p.encoders.lost(1, 2000), Fault.OVERTRAVEL | Fault.OVERSPEED | Fault.MODEL),
        (lambda p: p.push([0.0, 8.0]), Fault.OVERTRAVEL | Fault.MODEL),
    ],
    ids=["dead", "flipped", "lost counts", "pushed over"],
)
def test_what_goes_wrong_in_the_loop_ends_it_with_zero_before_the_word(what, fault):
    scene = Scene().started(tilt=0.08)
    with pytest.raises(RigStopped):
        scene.run(2.5, then=what)
    assert scene.beside.faults & fault
    kind, applied, enabled = scene.told[-1]
    assert (kind, applied, enabled) == ("fault", 0.0, False)
    assert scene.rig.sample.mode == Mode.FAULT


@pytest.mark.parametrize("speed", [-2.0, 0.5, 2.0])
def test_a_tap_is_not_taken_for_a_lying_encoder(speed):
    scene = Scene().started(tilt=0.02)
    scene.run(1.0, then=lambda p: p.push([0.0, speed]))
    assert not scene.beside.faults


def test_a_dead_encoder_of_the_arm_is_missed_by_its_motion():
    scene = Scene().started(tilt=0.08)
    with pytest.raises(RigStopped, match=r"psi shows not a single count|Psi shows not a single count|psi shown"):
        scene.run(4.0, then=lambda p: p.encoders.dead(0))
    # found before the arm is half a turn away, which the loop itself never notices
    assert abs(scene.port.x[0] - scene.beside.target[0]) < math.pi / 2


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_rule_that_gives_no_number_is_stopped(value):
    def mad(t, y, r, z, p):
        return (p[0] if t < 0.01 else p[1],), ()

    rule = Rule(function=mad, initial=[], parameters=[0.0, value])
    scene = Scene().started(tilt=0.0, law=rule)
    with pytest.raises(RigStopped, match=r"gave|stopped itself"):
        scene.run(0.1)
    assert scene.rig.sample.applied == 0.0


def test_a_wish_to_stop_is_heard_at_the_next_tick():
    scene = Scene().started()
    before = scene.rig.sample.tick
    wishes = iter(["", "", "Stopped by Esc."])
    scene.beside.stopped = lambda: next(wishes)
    zeroed, estop = [], scene.rig.estop
    scene.rig.estop = lambda: (zeroed.append(scene.rig.sample.tick), estop())
    with pytest.raises(RigStopped, match="Esc"):
        scene.run(1.0)
    assert [tick - before for tick in zeroed] == [3]


def test_a_sample_that_comes_again_and_again_ends_it():
    scene = Scene().started()
    scene.run(0.1)
    tick = scene.rig.exchange(0.0)
    with pytest.raises(RigStopped, match="same sample"):
        [scene.beside.step(tick) for _ in range(100)]
    assert scene.beside.faults & Fault.STALE


def test_its_own_loop_is_watched_too():
    scene = Scene().started(mode=Mode.MCU)
    ticks = scene.run(1.0)
    assert ticks[-1].mode == Mode.MCU
    assert abs(ticks[-1].counts[1] / RIG.per_unit[1] - math.pi) < 0.02
    assert np.ptp([t.applied for t in ticks]) > 0
    again = Scene().started(tilt=0.1, mode=Mode.MCU)
    with pytest.raises(RigStopped):
        again.run(2.5, then=lambda p: p.encoders.dead(1))


def test_a_reference_is_followed_alike_by_the_host_s_loop_and_by_the_rig_s_own():
    """The arm goes to 0.3 rad with the pendulum hanging; both loops answer the same samples with the same commands."""
    model = RIG.linear("hanging")
    K = place(model.A, model.B, [-6.0 + 6.0j, -6.0 - 6.0j, -5.0, -7.0]).K
    moved = np.where(np.arange(4000) < 500, 0.0, 0.3)
    law = replace(state_feedback(K[0], RIG.period, memory=0.8, k_pf=K[0, 0], limit=RIG.limit), references=moved)
    runs = []
    for mode in (Mode.HOST, Mode.MCU):
        scene = Scene(replace(DUTY, at="hanging", lean=math.inf, near=math.inf, watch=False))
        scene.beside.prepare()
        scene.beside.aim(law)
        scene.beside.start(mode)
        runs.append(scene.run(3.0))
    host, own = ([(t.counts, t.applied) for t in ticks] for ticks in runs)
    assert host == own
    # friction holds the arm off by at most the torque that it takes over the gain
    assert runs[1][-1].counts[0] / RIG.per_unit[0] == pytest.approx(0.3, abs=RIG.plant.b_1c / (RIG.gain * K[0, 0]))


class EverySecond:
    """A rig whose loop goes on while only every second sample reaches the host, as on a busy wire."""

    def __init__(self, rig):
        self._rig = rig

    def __getattr__(self, name):
        return getattr(self._rig, name)

    def exchange(self, command):
        if self._rig.sample.mode == Mode.MCU:
            self._rig.alone(RIG.period)
        return self._rig.exchange(command)


def test_samples_that_do_not_come_are_not_taken_for_a_lying_encoder():
    scene = Scene()
    scene.rig = scene.beside.rig = EverySecond(scene.rig)
    scene.started(tilt=0.02, mode=Mode.MCU)
    ticks = scene.run(1.0, then=lambda p: p.push([0.0, 1.0]))
    assert set(np.diff([t.tick for t in ticks])) == {2}
    assert ticks[-1].mode == Mode.MCU
    assert np.ptp([t.counts[1] for t in ticks]) > 100
    with pytest.raises(RigStopped, match=r"[Tt]heta show"):
        scene.run(2.0, then=lambda p: (p.encoders.dead(1), p.push([0.0, 1.0])))


def test_a_command_that_has_just_jumped_has_not_yet_moved_the_arm_that_friction_held():
    """0.2 s of rest in dry friction, then a step of the reference: 5 V for 3 ms move it by 3 counts, not by 40."""
    still = StillDrive(RIG, "inverted")
    speed, way = 0.0, 0.0
    for command in [0.0] * 226 + [5.0] * 4:
        way, speed = way + speed * RIG.period, speed + MODEL.B[1, 0] * command * RIG.period
        assert not still.sees(0.1, [0.0, 0.0], command)
    assert way * RIG.per_unit[0] < 10
    for _ in range(100):
        if still.sees(0.1, [0.0, MODEL.B[3, 0] / MODEL.B[1, 0] * way], 5.0):  # the pendulum goes along
            break
        way, speed = way + speed * RIG.period, speed + MODEL.B[1, 0] * 5.0 * RIG.period
    # free of friction it had gone `UNSEEN` counts by then, and not much more: friction takes 0.5 % of 5 V
    assert way * RIG.per_unit[0] == pytest.approx(UNSEEN, rel=0.25)


def test_what_nobody_says_of_a_duty_is_the_safe_side_of_it():
    """docs/howto/rigs.md: encoders and drive are watched unless --no-watch, and nothing but the file's limits stops."""
    duty = Duty(limits=None, model=RIG, at="inverted")
    assert duty.watch
    assert duty.watched
    assert (duty.lean, duty.near) == (math.inf, math.inf)
    assert not replace(duty, watch=False).watched
    assert not replace(duty, model=None).watched
    assert not replace(duty, at="hanging").watched
    assert not replace(duty, model=make_rig("rectilinear").replace(counts=1000).replace(name="x"), at="rest").watched
    plain = Limits(travel=(1.0,), speed=(1.0,), start=(1.0,), command=1.0)
    assert (plain.frozen, plain.twist) == (0.0, math.inf)
    about = Capabilities(name="bench", coordinates=("x",), counts=(1.0,), command_unit="V", full_scale=10.0, steps=10,
                         period=1e-3)  # fmt: skip
    # something can move, by the clock on the wall, and only a host can hold it
    assert (about.hardware, about.virtual, about.paced, about.replayed) == (True, False, False, False)
    assert about.modes == frozenset({Mode.HOST})


def test_a_loop_that_was_aimed_and_not_started_commands_nothing():
    scene = Scene()
    scene.beside.prepare()
    scene.port.hold("inverted", [0.0, 0.0, 0.05, 0.0])
    scene.beside.aim(LAW)
    with pytest.raises(BadInput, match="the loop was not started; call start first"):
        scene.beside.step(scene.rig.exchange(0.0))
    assert not scene.port._enabled
