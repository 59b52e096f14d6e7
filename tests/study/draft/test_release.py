"""Does the window of a draft begin after the hand has let go, and not later than it must?"""

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from upright.physics import CartPendulum, Pendulum, find
from upright.readers import read
from upright.signals.release import _reach, free_from, free_stretches, free_swings
from upright.simulation import Held, simulate

DT = 0.01
PENDULUM = Pendulum(m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3, b_2c=1e-3)
PERIOD = 2 * np.pi * np.sqrt((2e-3 + 0.2 * 0.3**2) / (0.2 * 9.81 * 0.3))


def lifted(to: float, held_at: float, seconds: float) -> np.ndarray:
    """A hand takes a pendulum from rest to an angle and back to where it holds it for some seconds."""
    still = np.zeros(100)
    up = 0.5 * to * (1 - np.cos(np.linspace(0, np.pi, 100)))
    back = held_at + 0.5 * (to - held_at) * (1 + np.cos(np.linspace(0, np.pi, 80)))
    return np.concatenate([still, up, back, np.full(round(seconds / DT), held_at)])


def swing(angle: float, n: int = 2000) -> np.ndarray:
    return simulate(PENDULUM, {}, [angle, 0.0], None, DT, samples=n, substeps=2)[:, 0, 0]


@pytest.mark.parametrize("seconds", [0.2, 1.5])
@pytest.mark.parametrize(("to", "held_at"), [(1.2, 0.9), (0.5, 0.4), (2.6, 2.0), (1.0, 1.0)])
def test_the_window_begins_after_the_hand_has_let_go(drafted, to, held_at, seconds):
    hand = lifted(to, held_at, seconds)
    theta = np.concatenate([hand, swing(held_at)])
    theta += 5e-4 * np.random.default_rng(1).normal(size=theta.size)
    _, study = drafted(t=np.arange(theta.size) * DT, theta=theta)
    release = hand.size * DT
    assert release - 0.05 * PERIOD <= study.runs[0].t[0] < release + PERIOD


def test_a_swing_that_nobody_touches_begins_within_its_first_period(drafted):
    theta = swing(1.5)
    _, study = drafted(t=np.arange(theta.size) * DT, theta=theta)
    assert study.runs[0].t[0] < PERIOD


def test_a_pendulum_that_its_cart_throws_is_not_held(drafted):
    t = np.arange(2500) * DT
    x = 0.08 * np.sin(2.2 * np.clip(t - 2, 0, None)) * (t > 2)
    theta = simulate(
        CartPendulum(m_c=1.0, m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3), {}, [0.0] * 4, None, DT, samples=t.size,
        substeps=2, held={"x": Held(q=x)},
    )[:, 2, 0]  # fmt: skip
    _, study = drafted(t=t, x=x, theta=theta)
    assert study.runs[0].t[0] < 2.0


def test_a_pendulum_lifted_beside_its_moving_cart_is_released_first(drafted):
    hand = lifted(1.2, 0.9, 0.5)
    n = 2000
    t = np.arange(hand.size + n) * DT
    x = 0.05 * np.sin(2.2 * np.clip(t - 0.5, 0, None))
    theta = simulate(
        CartPendulum(m_c=1.0, m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3), {}, [x[hand.size], 0.0, 0.9, 0.0], None, DT,
        samples=n, substeps=2, held={"x": Held(q=x[hand.size :])},
    )[:, 2, 0]  # fmt: skip
    _, study = drafted(t=t, x=x, theta=np.concatenate([hand, theta]))
    release = hand.size * DT
    assert release - 0.05 * PERIOD <= study.runs[0].t[0] < release + PERIOD


def test_a_pendulum_that_its_cart_swings_up_is_free_from_where_the_hand_let_go_although_it_gains_energy():
    hand, w, n = lifted(0.5, 0.4, 0.5), 2 * np.pi / PERIOD, 2000
    release = hand.size * DT
    t = np.arange(hand.size + n) * DT
    x = 0.02 * np.sin(w * np.clip(t - release, 0, None))
    theta = simulate(
        CartPendulum(m_c=1.0, m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3), {}, [0.0, 0.0, 0.4, 0.0], None, DT, samples=n,
        substeps=2, held={"x": Held(q=x[hand.size :])},
    )[:, 2, 0]  # fmt: skip
    assert np.ptp(theta[-300:]) > 1.5 * np.ptp(theta[:200])
    free = free_from(t, np.concatenate([hand, theta]), w, swings=float(t[-1]), hinge=x)
    assert release - 0.05 * PERIOD <= free < release + PERIOD


def released(dt, noise, angle, seconds=50.0, seed=3):
    """Time and angle of a pendulum let go at the first sample, and the last second at which it still swings."""
    n = round(seconds / dt) + 1
    t = np.arange(n) * dt
    theta = simulate(PENDULUM, {}, [angle, 0.0], None, dt, samples=n, substeps=max(2, round(dt / 5e-3)))[:, 0, 0]
    swinging = t[np.flatnonzero(np.abs(theta) > 0.05 * angle)[-1]]
    return t, theta + noise * np.random.default_rng(seed).normal(size=n), float(swinging)


@pytest.mark.parametrize("dt", [2e-3, 1e-2, 5e-2])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 5e-3, 2e-2])
@pytest.mark.parametrize("angle", [0.5, 1.5])
def test_noise_is_no_hand(drafted, angle, noise, dt):
    t, theta, swinging = released(dt, noise, angle)
    _, study = drafted("pendulum", t=t, theta=theta)
    assert study.runs[0].t[0] < PERIOD
    assert study.runs[-1].t[-1] > swinging
    # w^2 = m g l/(J + m l^2) of small swings, and the length of the simple pendulum: what the search starts from
    equal = PENDULUM.l_cg + PENDULUM.J_p / (PENDULUM.m_p * PENDULUM.l_cg)
    assert study.model.parameters["l_cg"].value == pytest.approx(equal, rel=0.1)


@pytest.mark.parametrize("noise", [2e-3, 1e-2, 2e-2])
@pytest.mark.parametrize(("to", "held_at"), [(1.2, 0.9), (0.5, 0.4), (1.0, 1.0)])
def test_a_hand_is_found_under_noise(drafted, noise, to, held_at):
    hand = lifted(to, held_at, 1.5)
    theta = np.concatenate([hand, swing(held_at)])
    theta += noise * np.random.default_rng(2).normal(size=theta.size)
    _, study = drafted("pendulum", t=np.arange(theta.size) * DT, theta=theta)
    release = hand.size * DT
    assert release - 0.05 * PERIOD <= study.runs[0].t[0] < release + PERIOD


def test_a_swing_that_hardly_decays_is_kept_from_its_release(drafted):
    t = np.arange(5000) * DT
    theta = 0.4 * np.exp(-2e-3 * t) * np.cos(6.0 * t)  # 10 % in 50 s
    _, study = drafted("pendulum", t=t, theta=theta)
    assert study.runs[0].t[0] < 2 * np.pi / 6.0


def test_a_pendulum_that_is_held_upright_is_not_free_before_it_falls(drafted):
    # upright gravity pulls at no angle, so no hand is felt: 3 s at 3.1 rad, then a simulated fall
    held = np.full(300, 3.1)
    theta = np.concatenate([held, swing(3.1, 3000)])
    _, study = drafted("pendulum", t=np.arange(theta.size) * DT, theta=theta)
    assert held.size * DT - DT <= study.runs[0].t[0] < held.size * DT + 2 * PERIOD  # it lingers before it falls


AGAIN = (1.0, -0.7, 0.85)
"""How far a hand brings something back each time, as shares of the first."""
CHAINS = {
    "torsional-2": ({"J_1": 2e-3, "J_2": 2e-3, "k_12": 2.0, "c_1": 2e-3, "c_2": 2e-3, "f_1c": 5e-3}, (0.0, 0.5), 1.0),
    "rectilinear-2": (
        {"m_1": 1.0, "m_2": 1.0, "k_1": 300.0, "k_12": 400.0, "c_1": 1.0, "c_2": 1.0}, (0.012, 0.02), 0.01,
    ),
}  # fmt: skip
"""Numbers, where they are let go from, and how much 1 rad of noise is, by plant."""


def by_hand(plant, places, dt, seconds, again=AGAIN):
    """Coordinates (N, n), and each release and the next time that the hand comes [s].

    The hand holds for 1 s; later it moves for 0.5 s and holds for 0.5 s.
    """
    away = np.array(places)
    out, spans = [np.tile(away, (round(1 / dt), 1))], []
    for k, share in enumerate(again):
        if k:
            way = np.minimum(np.arange(round(1 / dt)) * 2 * dt, 1.0)[:, None]
            out.append((1 - way) * out[-1][-1] + way * share * away)
        x0 = np.stack([share * away, 0 * away], axis=1).ravel()
        begin = sum(len(x) for x in out) * dt
        out.append(simulate(plant, {}, list(x0), None, dt, samples=round(seconds / dt), substeps=2)[:, ::2, 0])
        spans.append((begin, begin + seconds))
    return np.concatenate(out), spans


def free_and_whole(found, spans, period, seconds):
    """Whether each stretch begins at a release, ends before the hand is there, and keeps nine tenths of what is free.

    A hand that begins to move from where a swing has died is no force yet: it is noticed within a fifth of its way,
    0.1 s.
    """
    assert len(found) == len(spans)
    for (start, stop), (begin, end) in zip(found, spans, strict=True):
        assert begin - 0.02 * period <= start <= begin + period / 2
        assert stop <= end + 0.1
        assert stop - start >= 0.9 * seconds


@pytest.mark.parametrize("noise", [0.0, 5e-3, 2e-2])
@pytest.mark.parametrize("name", CHAINS)
def test_each_swing_of_a_chain_is_kept_from_the_hand_to_the_hand(name, noise):
    numbers, away, per = CHAINS[name]
    seconds = 2.0
    x, spans = by_hand(find(name)(**numbers), away, 5e-3, seconds)
    x += per * noise * np.random.default_rng(5).normal(size=x.shape)
    # k/J_1 + k/J_2, and what the slower mode of the carts comes to
    period = 2 * np.pi / (np.sqrt(2.0 / 2e-3 * 2) if name == "torsional-2" else 11.2)
    free_and_whole(free_stretches(np.arange(len(x)) * 5e-3, list(x.T)), spans, period, seconds)


@pytest.mark.parametrize("noise", [0.0, 5e-3, 2e-2])
def test_each_swing_of_a_pendulum_is_a_run_and_the_last_one_is_predicted(drafted, noise):
    seconds = 10.0
    x, spans = by_hand(PENDULUM, (1.2,), DT, seconds)
    theta = x[:, 0] + noise * np.random.default_rng(6).normal(size=len(x))
    _, study = drafted("pendulum", t=np.arange(theta.size) * DT, theta=theta)
    assert [run.role for run in study.runs] == ["fit", "fit", "predict"]
    free_and_whole([(run.t[0], run.t[-1]) for run in study.runs], spans, PERIOD, seconds)


@pytest.mark.parametrize(("samples", "starts"), [(90, 0.25), (91, 0.0)])
def test_a_log_of_ten_smoothing_widths_shows_accelerations_and_a_shorter_one_is_taken_at_its_amplitudes(
    samples, starts
):
    """A swing of 1 s read every 10 ms is smoothed over a twelfth of it, the nine samples about 8.3."""
    t = 0.01 * np.arange(samples)
    assert free_from(t, 0.3 * np.exp(-0.1 * t) * np.cos(2 * np.pi * t), 2 * np.pi, 0.25) == starts


def test_the_period_of_a_chain_is_that_of_its_accelerations_and_not_of_its_widest_swing():
    """Two bodies of equal mass, a slow mode of 10 s beside a fast one of 1 s that is a tenth as wide.

    A log of 8 s has less than one period of the slow mode, whose accelerations are a tenth of the fast one's.
    """
    t = np.arange(1600) * 5e-3
    slow, fast = np.cos(2 * np.pi * t / 10), 0.1 * np.cos(2 * np.pi * t)
    assert free_stretches(t, [slow + fast, slow - fast]) == [(0.0, t[-1])]
    assert free_stretches(t, [slow, 0.9 * slow]) == []  # it alone: fewer than two and a half periods


@pytest.mark.parametrize(("share", "stretches"), [(0.12, 1), (0.4, 2)])
def test_a_free_stretch_swings_a_fifth_as_far_as_the_widest_at_least(share, stretches):
    numbers, away, _ = CHAINS["rectilinear-2"]
    x, spans = by_hand(find("rectilinear-2")(**numbers), away, 5e-3, 2.0, again=(1.0, share))
    found = free_stretches(np.arange(len(x)) * 5e-3, list(x.T))
    assert len(found) == stretches
    assert found[0][0] == pytest.approx(spans[0][0], abs=0.1)


@pytest.mark.parametrize("samples", [20_000, 20_001, 50_000])
def test_of_a_long_log_every_second_or_third_sample_is_looked_at(samples):
    """As of a log that was taken so: what lies between is not looked at."""
    every = -(-samples // 20_000)
    t = np.arange(samples) * 1e-3
    x = np.exp(-0.1 * t) * np.cos(6 * t)
    between = np.arange(samples) % every > 0
    spoilt = np.where(between, 9.0, x)
    thinned = t[::every], x[::every]
    found = free_stretches(t, [spoilt])
    assert len(found) == 1
    assert found == free_stretches(thinned[0], [thinned[1]])
    hinge = 0.1 * np.sin(2 * t)
    swings = free_swings(t, spoilt, np.where(between, 9.0, hinge))
    assert swings == free_swings(*thinned, hinge[::every])
    assert len(swings) == 1


def test_where_nothing_swings_no_stretch_is_free():
    t = np.arange(2000) * 5e-3
    pulled = np.clip(np.sin(t), -0.5, 0.7)  # a hand alone: no place and no speed explains what accelerates it
    jerked = np.cumsum(np.random.default_rng(7).choice([-1.0, 0.0, 1.0], size=t.size))
    assert free_stretches(t, [jerked]) == []
    assert free_swings(t, 0.001 * np.random.default_rng(8).normal(size=t.size)) == []
    assert all(stop - start > 0 for start, stop in free_stretches(t, [pulled]))


def test_a_pendulum_let_go_twice_from_upright_is_free_from_where_it_falls():
    fall = swing(3.1, 1200)
    down = np.linspace(fall[-1], 3.1, 60)
    theta = np.concatenate([np.full(200, 3.1), fall, down, np.full(200, 3.1), fall])
    found = free_swings(np.arange(theta.size) * DT, theta)
    second = (200 + 1200 + 60 + 200) * DT
    assert len(found) == 2
    assert 2.0 - DT <= found[0][0] < 2.0 + 2 * PERIOD  # it lingers before it falls
    assert second - DT <= found[1][0] < second + 2 * PERIOD
    # each to where the hand comes, or the log ends
    assert found[0][1] == pytest.approx((200 + 1200) * DT, abs=PERIOD / 4)
    assert found[1][1] == pytest.approx((theta.size - 1) * DT)


@pytest.mark.real_data
def test_carts_that_somebody_lets_go_by_hand_are_free_from_where_a_person_says_so():
    """Windows that were chosen by eye in a shipped study, beside those that are drafted for the same logs."""
    study = Path(__file__).parents[3] / "examples" / "studies" / "ecp210_releases.toml"
    chosen: dict[str, list[float]] = {}
    for run in tomllib.loads(study.read_text(encoding="utf-8"))["runs"]:
        chosen.setdefault(run["file"], []).append(run["window"][0])
    for file, begins in chosen.items():
        record = read(Path(os.environ["UPRIGHT_REAL_DATA"]) / file)
        carts = [record[name] for name in record.names if name.startswith("Encoder")]
        found = [start for start, _ in free_stretches(record.t, carts)]
        assert found == pytest.approx(begins, abs=0.1)  # a quarter of a period


def test_a_ramp_is_gone_through_by_its_slope_within_every_window():
    """One sample is a unit: within 21 samples 20 units, away from the ends, whose smoothing levels them."""
    reach = _reach(np.arange(200.0), 21)
    assert reach.shape == (180,)
    np.testing.assert_allclose(reach[20:-20], 20.0, atol=1e-6)
