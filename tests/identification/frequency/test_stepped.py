"""Sines one after the other in one log: are they all there, and do their errors hold the exact response?"""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from upright.errors import NotIdentifiable
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.frequency.spectra import chirp, response_of
from upright.identification.frequency.stepped import covered, sines_in
from upright.records import Record

DT = 4e-3
GAIN, MODE, DAMPING = 3.0, 8.0, 0.08
SAMPLED = scipy.signal.cont2discrete(([GAIN * MODE**2], [1.0, 2 * DAMPING * MODE, MODE**2]), DT)  # zero-order hold
FREQUENCIES = np.geomspace(1.0, 40.0, 10)


def exact(omega: np.ndarray) -> np.ndarray:
    """The sampled transfer function on the unit circle."""
    z = np.exp(1j * omega * DT)
    return np.polyval(np.ravel(SAMPLED[0]), z) / np.polyval(SAMPLED[1], z)


def command(
    omega: np.ndarray, *, periods: float = 0.0, seconds: float = 0.0, pause: float = 0.0, size: np.ndarray | None = None
) -> np.ndarray:
    """A second of rest, and sines one after the other, each from zero on, for whole periods or for as long as said."""
    parts = [np.zeros(round(1 / DT))]
    for w, a in zip(omega, np.ones(omega.size) if size is None else size, strict=True):
        n = round((periods * 2 * math.pi / w or seconds) / DT)
        parts += [a * np.sin(w * DT * np.arange(n)), np.zeros(round(pause / DT))]
    return np.concatenate(parts)


def log(u: np.ndarray, *, noise: float = 0.0, seed: int = 0) -> Record:
    """What the second-order rig answers, from rest."""
    y = scipy.signal.lfilter(np.ravel(SAMPLED[0]), SAMPLED[1], u)
    y = y + noise * np.random.default_rng(seed).normal(size=u.size)
    return Record(
        t=DT * np.arange(u.size), signals={"u": u, "y": y}, units={"u": "V", "y": "rad"}, inputs=("u",), outputs=("y",)
    )


def measured(*logs: Record, **how: object) -> FrequencyResponse:
    return response_of(logs, command="u", outputs=["y"], **how)


def beyond(found: FrequencyResponse) -> np.ndarray:
    """Squares of the errors over the variances that are stated."""
    return np.abs(found.response[:, 0] - exact(found.omega)) ** 2 / found.variance[:, 0]


@pytest.mark.parametrize("pause", [0.0, 2.0, 20.0])
def test_every_sine_is_a_point_whatever_rest_lies_between(pause: float) -> None:
    found = measured(log(command(FREQUENCIES, seconds=15.0, pause=pause)))
    assert found.omega == pytest.approx(FREQUENCIES, rel=1e-6)
    # of 15 s the two slowest hold two periods, during which a transient of 1.6 s decays
    assert found.response[:, 0] == pytest.approx(exact(FREQUENCIES), rel=5e-3)
    assert found.response[3:, 0] == pytest.approx(exact(FREQUENCIES[3:]), rel=1e-3)
    assert np.all(beyond(found) < 3)


@pytest.mark.parametrize(("periods", "pause"), [(2, 8.0), (2, 20.0), (2.5, 12.0), (3, 8.0)])
def test_two_periods_between_rests_are_a_point_without_being_asked(periods: float, pause: float) -> None:
    """In a rest of 8 s the free swing falls to exp(-0.64 * 8) = 0.6 %, and after its end it is continued."""
    found = measured(log(command(FREQUENCIES, periods=periods, pause=pause)))
    assert found.omega == pytest.approx(FREQUENCIES, rel=1e-6)
    assert found.response[:, 0] == pytest.approx(exact(FREQUENCIES), rel=0.02 if periods == 3 else 1e-6)
    assert np.all(beyond(found) < 3)


@pytest.mark.parametrize("pause", [1.5, 6.0])
def test_errors_of_two_periods_hold_the_exact_response_at_95_percent(pause: float) -> None:
    """Even where the swing has fallen to no less than 0.4 at the end of a rest; |error|^2 is exponential."""
    u = command(FREQUENCIES, periods=2, pause=pause)
    logs = [log(u, noise=noise, seed=seed) for seed in range(3) for noise in (2e-3, 0.05)]
    ratio = np.concatenate([beyond(measured(r)) for r in logs])
    # of 60 cases at 95 %, no fewer than chance leaves in one of a thousand such tests
    assert np.sum(ratio < 3) >= scipy.stats.binom.ppf(1e-3, ratio.size, 0.95)
    assert 0.35 < np.median(ratio) < 1.2  # ln 2 when neither too wide nor too narrow


def test_rests_too_short_for_the_swing_say_so_and_it_is_continued_as_it_decayed() -> None:
    found = measured(log(command(FREQUENCIES, periods=2, pause=1.5)))
    assert found.omega == pytest.approx(FREQUENCIES, rel=1e-6)
    assert found.response[:, 0] == pytest.approx(exact(found.omega), rel=1e-6)
    assert np.all(beyond(found) < 3)
    (note,) = found.notes
    assert "Rest longer between the sines" in note


def test_two_swings_and_a_creep_are_continued_as_well() -> None:
    """Poles at -0.6 +- 8i, -0.6 +- 20i, -1.5 and 0, of which the slowest fall to 0.4 in a rest."""
    poles = np.array([-0.6 + 8j, -0.6 - 8j, -0.6 + 20j, -0.6 - 20j, -1.5, 0.0])
    whole = scipy.signal.zpk2tf([-0.3 + 14j, -0.3 - 14j, -4.0], poles, 3e3)
    numerator, denominator, _ = scipy.signal.cont2discrete(whole, DT)
    u = command(FREQUENCIES, periods=2, pause=1.5)
    y = scipy.signal.lfilter(np.ravel(numerator), denominator, u)
    y = y + 1e-4 * np.ptp(y) * np.random.default_rng(2).normal(size=y.size)
    found = measured(Record(t=DT * np.arange(u.size), signals={"u": u, "y": y}, units={"u": "V", "y": "rad"}))
    z = np.exp(1j * found.omega * DT)
    off = np.abs(found.response[:, 0] - np.polyval(np.ravel(numerator), z) / np.polyval(denominator, z))
    assert np.sum(off**2 < 3 * found.variance[:, 0]) >= 8
    assert np.max(off[:6] / np.abs(found.response[:6, 0])) < 0.02


def test_a_drive_that_only_turns_comes_to_rest_elsewhere_and_is_measured_all_the_same() -> None:
    """A motor with friction, 1/(s (s + 2)): where it stops after a sine, nothing pulls it back."""
    numerator, denominator, _ = scipy.signal.cont2discrete(([1.0], [1.0, 2.0, 0.0]), DT)
    u = command(FREQUENCIES, periods=2, pause=6.0)
    u = u * np.where(np.arange(u.size) > 0, 1.0, 0.0)
    y = scipy.signal.lfilter(np.ravel(numerator), denominator, u)
    found = measured(Record(t=DT * np.arange(u.size), signals={"u": u, "y": y}, units={"u": "V", "y": "rad"}))
    z = np.exp(1j * found.omega * DT)
    assert found.omega == pytest.approx(FREQUENCIES, rel=1e-6)
    assert found.response[:, 0] == pytest.approx(
        np.polyval(np.ravel(numerator), z) / np.polyval(denominator, z), rel=1e-3
    )


def test_two_periods_are_told_apart_from_a_sweep_and_from_steps() -> None:
    noise = 0.01 * np.random.default_rng(3).normal(size=200_000)
    sines = command(FREQUENCIES, periods=2, pause=2.0)
    # a pause counts as one period at most: two of three, and more where it is shorter
    assert covered(DT * np.arange(sines.size), sines) > 0.65
    assert covered(DT * np.arange(sines.size), sines + noise[: sines.size]) > 0.65
    small = command(FREQUENCIES, periods=2, pause=2.0, size=np.geomspace(1.0, 0.1, 10))
    assert covered(DT * np.arange(small.size), small) > 0.65
    rest = np.zeros(500)
    swept = np.concatenate([rest, *(np.concatenate([chirp(2.0, 60.0, 10.0, DT), rest]) for _ in range(4))])
    steps = np.concatenate([rest, *([np.repeat([1.0, -1.0, 1.0, -1.0], 200), rest] * 4)])
    for u in (swept, steps):
        assert covered(DT * np.arange(u.size), u) == 0.0


def test_one_log_of_sines_says_what_logs_of_one_sine_each_say() -> None:
    some = FREQUENCIES[3:8]
    together = measured(log(command(some, periods=30)))
    apart = measured(*(log(command(some[[k]], periods=30)) for k in (2, 0, 4, 1, 3)))
    assert (together.outputs, together.units) == (apart.outputs, apart.units)
    assert together.omega == pytest.approx(apart.omega, rel=1e-6)
    # what a sine before it left has decayed to 2e-3 when the measurement begins
    assert together.response == pytest.approx(apart.response, rel=3e-3)


def test_frequencies_close_about_a_resonance_stay_apart() -> None:
    """A per cent apart, which is within the 2 % of a period that rounding to samples may move a crossing."""
    close = np.linspace(7.0, 9.0, 21)
    found = measured(log(command(close, periods=20)))
    assert found.omega == pytest.approx(close, rel=1e-5)
    assert found.response[:, 0] == pytest.approx(exact(close), rel=1e-3)


def test_errors_hold_the_exact_response_at_95_percent() -> None:
    """|error|^2 over its variance is exponential: three in a twentieth of the cases."""
    u = command(FREQUENCIES[4:8], periods=25)
    ratio = np.concatenate([beyond(measured(log(u, noise=0.05, seed=seed))) for seed in range(16)])
    assert ratio.size == 64
    # of 64 cases at 95 %, 56 at least with a probability of 0.99; what is left of a transient widens some
    assert np.mean(ratio < 3) >= 56 / 64
    assert 0.15 < np.median(ratio) < 1.4  # ln 2 when neither too wide nor too narrow


def test_what_is_left_of_a_transient_counts_as_error() -> None:
    """Four periods of a rig that rings for 12 of its own: far from settled, and by so much."""
    found = measured(log(command(FREQUENCIES, periods=4)))
    assert len(found) == 10
    off = np.abs(found.response[:, 0] / exact(found.omega) - 1)
    assert off.max() > 0.3
    assert np.all(beyond(found) < 3)
    (note,) = found.notes
    assert note.startswith("Not settled at ")
    assert "Hold each sine some" in note


def test_a_command_that_was_measured_holds_noise_and_moves_no_frequency() -> None:
    u = command(FREQUENCIES, periods=12, pause=1.0, size=np.geomspace(0.2, 1.0, 10))
    r = log(u)
    found = measured(r.replace(signals={**r.signals, "u": u + 0.01 * np.random.default_rng(5).normal(size=u.size)}))
    assert found.omega == pytest.approx(FREQUENCIES, rel=1e-3)
    assert np.abs(found.drive) == pytest.approx(np.geomspace(0.2, 1.0, 10), rel=0.03)  # of 30 samples, 5 % each


def test_noise_of_a_command_in_its_rests_is_no_sine() -> None:
    u = command(FREQUENCIES, periods=2, pause=6.0)
    r = log(u)
    for seed in range(2):
        noise = 0.005 * np.random.default_rng(seed).normal(size=u.size)
        found = measured(r.replace(signals={**r.signals, "u": u + noise}))
        assert found.omega == pytest.approx(FREQUENCIES, rel=3e-3)
        assert not any(note.startswith("Left out") for note in found.notes)
        assert np.mean(beyond(found) < 3) >= 0.7  # of ten cases at 95 %, fewer in 1 of 1000


def test_where_a_sine_grows_and_dies_away_it_is_not_measured() -> None:
    """In forty periods of a sine that grows in ten and dies away in ten, about twenty are full."""
    omega, n = 20.0, round(40 * 2 * math.pi / 20.0 / DT)
    ramp = np.clip(np.minimum(np.arange(n), np.arange(n)[::-1]) / (n / 4), 0, 1)
    found = measured(log(np.concatenate([np.zeros(500), ramp * np.sin(omega * DT * np.arange(n)), np.zeros(500)])))
    assert np.abs(found.drive) == pytest.approx([1.0], rel=2e-3)
    assert found.response[:, 0] == pytest.approx(exact(found.omega), rel=2e-3)


def test_a_sine_of_too_few_samples_is_left_out_and_named() -> None:
    fast = 2 * math.pi / (3.2 * DT)
    found = measured(log(command(np.array([2.0, 5.0, 20.0, fast]), periods=20)))
    assert found.omega == pytest.approx([2.0, 5.0, 20.0], rel=1e-6)
    assert any(note.startswith(f"Left out {fast:.3g} rad/s: fewer than 4 samples") for note in found.notes)
    with pytest.raises(NotIdentifiable, match="log faster"):
        measured(log(command(np.array([fast]), periods=200)), kind="sines")


@pytest.mark.parametrize(("low", "high", "seconds"), [(2.0, 60.0, 10.0), (2.0, 60.0, 40.0), (1.0, 10.0, 300.0)])
def test_a_sweep_holds_no_sines_however_slow(low: float, high: float, seconds: float) -> None:
    u = chirp(low, high, seconds, DT)
    assert covered(DT * np.arange(u.size), u) == 0.0
    steps = np.repeat(np.random.default_rng(1).choice([-1.0, 1.0], 300), 25)
    assert covered(DT * np.arange(steps.size), steps) < 0.5


def test_a_small_fast_sine_after_a_large_slow_one_is_no_noise() -> None:
    omega = np.array([1.0, 10.0, 100.0])
    u = command(omega, periods=8, size=1 / omega)
    assert [s.omega for s in sines_in(DT * np.arange(u.size), u)] == pytest.approx(omega, rel=1e-4)
