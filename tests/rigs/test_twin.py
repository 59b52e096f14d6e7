"""Does the twin, one tick at a time, move as the compiled closed loop does?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.control.trial import law_on_rig, steps_in_period, trial
from upright.gains import feedback, filtered, place
from upright.rig.makes import make_rig
from upright.rigs import Board, Limits, Mode, TwinPort
from upright.rigs.law import RunningLaw
from upright.simulation import simulate

RIG = make_rig("furuta")
SAMPLED = RIG.linear("inverted").to_sampled(RIG.period, RIG.delay / RIG.period)
POLES = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]
LAW = feedback(filtered(SAMPLED, 0.5), place(RIG.linear("inverted").A, RIG.linear("inverted").B, POLES).K)
ANY = Limits(travel=(math.inf,) * 2, speed=(math.inf,) * 2, start=(math.inf,) * 2, command=RIG.limit, saturation=10.0)
TICKS = 600


def started(mode, law=None, away=(0.0, 0.0, 0.05, 0.0)):
    port = TwinPort(RIG)
    board = Board(port)
    board.open()
    board.clear_fault()
    board.configure(ANY)
    port.hold("inverted", away)
    board.arm()
    board.start(mode, law)
    port.let_go()
    return port, board


@pytest.fixture(scope="module")
def compiled():
    """The same law on the same rig in the compiled loop, and the law with the rig's encoders about it."""
    run = trial(RIG, LAW, at="inverted", start=[0.0, 0.0, 0.05, 0.0], seconds=TICKS * RIG.period)
    return run, law_on_rig(RIG, LAW, run.rest)


def test_a_twin_under_the_hosts_law_moves_as_the_compiled_loop(compiled):
    run, law = compiled
    port, board = started(Mode.HOST)
    running = RunningLaw(law, RIG.period)
    counts, put, states = [board.sample.counts], [], [port.x]
    for _ in range(TICKS):
        tick = board.exchange(running.step([n / per for n, per in zip(counts[-1], RIG.per_unit, strict=True)]))
        counts.append(tick.counts)
        put.append(tick.applied)
        states.append(port.x)
    # sums taken in another order differ in their last bit, which may tip a command to the next step of 0.3 mV
    np.testing.assert_allclose(put, run.u[:TICKS], atol=1.01 * RIG.converter)
    assert np.all(np.abs(np.array(states) - run.x) < 1e-4 * np.ptp(run.x, axis=0))
    shown = np.column_stack([run.record["psi"], run.record["theta"]]) * np.array(RIG.per_unit)
    assert np.abs(np.array(counts) - shown).max() <= 1.0 + 1e-6


SLOW_TO_FORGET = {
    "presliding": replace(RIG, plant=RIG.plant.replace(delta_1=0.02, delta_2=0.05, b_2c=2e-4)),
    "relaxation": RIG.replace(more={"actuator.damping": 0.02, "actuator.relaxation": 0.05}),
    "relaxation beyond a knee": RIG.replace(
        more={"actuator.damping": 0.02, "actuator.relaxation": 0.05, "actuator.knee": 0.5, "actuator.fade": 0.1}
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("what", SLOW_TO_FORGET)
def test_what_outlasts_a_period_is_remembered(what):
    """Moved a period at a time and in one piece, by commands put out blindly; without memory the motion is another."""
    rig = SLOW_TO_FORGET[what]
    rng = np.random.default_rng(2)
    command = np.append(0.0, np.repeat(rng.choice([-2.0, 0.0, 1.5], size=30), 40))
    port = TwinPort(rig)
    port.enable(True)
    states = [port.x]
    for u in command.tolist():
        port.write(u)
        port.advance()
        states.append(port.x)
    whole, plain = (
        simulate(
            r.plant,
            r.drive,
            r.plant.state("hanging"),
            command,
            r.period,
            samples=len(states),
            substeps=steps_in_period(r),
        )
        for r in (rig, replace(RIG, plant=rig.plant.replace(delta_1=0.0, delta_2=0.0)))
    )
    size = np.ptp(whole[:, :, 0], axis=0)
    # restarts add roundings of 1e-16, which 1.1 s of a pendulum that swings multiply by some thousands
    assert np.all(np.abs(np.array(states) - whole[:, :, 0]) < 1e-10 * size)
    assert np.any(np.abs(plain - whole)[:, :, 0] > 1e-4 * size)


def test_a_hand_makes_a_twin_forget():
    """Held and let go where it was, it moves as one that was never moved before."""
    rig = SLOW_TO_FORGET["presliding"]
    used, fresh = TwinPort(rig), TwinPort(rig)
    used.enable(True)
    for k in range(100):
        used.write(3.0 * math.sin(0.1 * k))
        used.advance()
    used.enable(False)
    for _ in range(40):  # the drive's lag
        used.advance()
    for port in (used, fresh):
        port.hold("hanging", [0.0, 0.0, 0.3, 0.0])
        for _ in range(60):
            port.advance()
        port.let_go()
        for _ in range(200):
            port.advance()
    np.testing.assert_array_equal(used.x, fresh.x)


def test_its_own_loop_gives_the_same_commands_as_the_hosts(compiled):
    _, law = compiled
    _, board = started(Mode.MCU, law)
    _, other = started(Mode.HOST)
    running, counts = RunningLaw(law, RIG.period), other.sample.counts
    for _ in range(TICKS):
        said = running.step([n / per for n, per in zip(counts, RIG.per_unit, strict=True)], 0.0)
        theirs, ours = other.exchange(said), board.exchange(0.0)
        assert (ours.counts, ours.applied) == (theirs.counts, theirs.applied)
        counts = theirs.counts


def test_a_command_is_put_out_in_whole_steps_and_limited():
    _, board = started(Mode.HOST)
    for asked in (0.3456, -0.3456, 40.0, -40.0):
        expected = np.clip(np.floor(asked / RIG.converter + 0.5) * RIG.converter, -RIG.limit, RIG.limit)
        assert board.exchange(asked).applied == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("fault", "shown"),
    [
        (lambda e: e.dead(0), lambda n: 0),
        (lambda e: e.scaled(0, -1.0), lambda n: -n),
        (lambda e: e.scaled(0, 2.0), lambda n: 2 * n),
        (lambda e: e.lost(0, 40), lambda n: n - 40),
        (lambda e: e.wrapped(0, 8), lambda n: (n + 128) % 256 - 128),
    ],
    ids=["dead", "swapped", "twice", "lost", "wrapped"],
)
def test_a_broken_encoder_shows_what_it_should(fault, shown):
    port = TwinPort(RIG)
    port.open()
    port.read()
    fault(port.encoders)
    for counts in (3, 127, 128, 900, -300):
        port.hold("hanging", [counts / RIG.per_unit[0], 0.0, 0.0, 0.0])
        assert abs(port.read()[0] - shown(counts)) <= 1
        assert port.read()[1] == 0


def test_a_twin_s_time_is_that_of_the_periods_that_passed_held_or_not():
    port = TwinPort(RIG)
    assert port.advance() == RIG.period
    port.hold("inverted", [0.0, 0.0, 0.05, 0.0])
    assert port.advance() == 2 * RIG.period
    assert port.x[2] == RIG.plant.state("inverted")[2] + 0.05
    port.let_go()
    assert port.advance() == 3 * RIG.period
    assert port.x[2] != RIG.plant.state("inverted")[2] + 0.05
