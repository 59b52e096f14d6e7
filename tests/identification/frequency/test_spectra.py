"""Responses of systems that are stated, from logs made by hand: sines, a periodic command, repeated sweeps."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.signal

from upright.errors import BadInput, NotIdentifiable
from upright.identification.frequency.detection import by_period, detect, overtones, sign_line
from upright.identification.frequency.response import FrequencyResponse, describing
from upright.identification.frequency.spectra import chirp, multisine, odd_lines, repetition, response_of
from upright.identification.frequency.stepped import sines_in
from upright.records import Provenance, Record

DT = 1e-3
UNITS = {"u": "V", "y": "rad", "z": "m"}


def record(u: np.ndarray, y: np.ndarray, z: np.ndarray | None = None, *, start: float = 0.0) -> Record:
    signals = {"u": u, "y": y} | ({} if z is None else {"z": z})
    units = {n: UNITS[n] for n in signals}
    t = start + DT * np.arange(len(u))
    return Record(t=t, signals=signals, units=units, provenance=Provenance(file="log.csv", reader="table"))


def told(*records: Record, outputs: tuple[str, ...] = ("y",), **how: object) -> FrequencyResponse:
    return response_of(records, command="u", outputs=outputs, **how)


@pytest.mark.parametrize(("periods", "stretches"), [(2, 0), (3, 1), (7, 1)])
def test_three_periods_are_a_sine(periods: int, stretches: int) -> None:
    """From the first upward crossing, at the end of the first period, to the last."""
    t = DT * np.arange(4000)
    omega = 2 * math.pi / 0.25
    u = np.where((t >= 0.1) & (t < 0.1 + 0.25 * periods), np.sin(omega * (t - 0.1)), 0.0)
    found = sines_in(t, u)
    assert len(found) == stretches
    for sine in found:
        assert (sine.first, sine.last) == (pytest.approx(350, abs=1), pytest.approx(100 + 250 * periods, abs=1))
        assert sine.omega == pytest.approx(omega, rel=2e-3)


def test_sines_one_after_the_other_are_told_apart_and_a_ripple_is_no_period() -> None:
    t = DT * np.arange(6000)
    slow, fast = 2 * math.pi * 4, 2 * math.pi * 10
    u = 1.5 + np.where(t < 3, np.sin(slow * t), np.sin(fast * t))
    first, second = sines_in(t, u)
    assert (first.omega, second.omega) == (pytest.approx(slow, rel=1e-3), pytest.approx(fast, rel=1e-3))
    assert (first.first, second.last) == (pytest.approx(250, abs=2), pytest.approx(5900, abs=2))
    assert first.last <= 3001 <= second.first + 100
    rippled = np.sin(slow * t) + 0.05 * np.sin(40 * slow * t) * (np.cos(slow * t) < 0)
    (sine,) = sines_in(t, rippled)
    assert (sine.first, sine.last, sine.omega) == (
        pytest.approx(250, abs=2),
        pytest.approx(5750, abs=2),
        pytest.approx(slow, rel=1e-3),
    )
    assert sines_in(t, np.sin(slow * t) * (t > 5.7)) == []


FREQUENCIES = 2 * math.pi * np.array([2.0, 5.0, 8.0])
ANSWERS = np.array([[0.5 - 0.3j, 2.0j], [0.2 + 0.1j, -1.0], [0.05j, 0.3 - 0.4j]])
AMPLITUDES = np.array([1.0, 2.0, 0.5])


def stepped(noise: float = 0.0, seed: int = 0, order: tuple[int, ...] = (1, 0, 2), overtone: float = 0.0) -> Record:
    """Two seconds of each sine; outputs answer at once."""
    u, y, z = [], [], []
    t = DT * np.arange(2000)
    for i in order:
        turn = AMPLITUDES[i] * np.exp(1j * (FREQUENCIES[i] * t - math.pi / 2))
        u.append(turn.real)
        y.append((ANSWERS[i, 0] * turn).real + overtone * AMPLITUDES[i] * np.cos(3 * FREQUENCIES[i] * t))
        z.append((ANSWERS[i, 1] * turn).real)
    chance = np.random.default_rng(seed)
    y, z = np.concatenate(y), np.concatenate(z)
    return record(np.concatenate(u), y + noise * chance.normal(size=y.size), z)


def test_sines_give_the_response_at_their_frequencies_in_order() -> None:
    found = told(stepped(), outputs=("y", "z"), hold=0.01)
    assert found.omega == pytest.approx(FREQUENCIES, rel=1e-6)
    assert np.allclose(found.response, ANSWERS, atol=3e-3)  # a sample of the next sine
    assert np.abs(found.drive) == pytest.approx(AMPLITUDES, rel=1e-3)
    assert (found.outputs, found.units, found.input, found.hold) == (("y", "z"), ("rad", "m", "V"), "u", 0.01)
    assert found.notes == ()
    kept = told(stepped(), kind="sines", band=(float(FREQUENCIES[1]) - 0.01, 45.0))
    assert kept.omega == pytest.approx(FREQUENCIES[1:2], rel=1e-6)
    assert kept.hold == pytest.approx(DT)
    with pytest.raises(NotIdentifiable, match=r"asks 12\.6 to 50\.3 rad/s, nothing between 100 and 200"):
        told(stepped(), band=(100.0, 200.0))


def test_the_variance_of_a_response_is_that_of_its_line_over_the_command() -> None:
    """4 s^2/N over the square of the amplitude, about 1.6 s of a thousand samples each."""
    found = told(stepped(noise=0.1))
    # 16 parts tell a variance to a third, and the larger of two estimates counts
    ratio = found.variance[:, 0] * AMPLITUDES**2 / (4 * 0.01 / 1600)
    assert np.all((ratio > 0.6) & (ratio < 3.0))
    rounded = told(stepped(), resolution=[0.2])
    per_period = 2 * math.pi / FREQUENCIES / DT
    assert rounded.variance[:, 0] * AMPLITUDES**2 == pytest.approx(4 * 0.04 / 12 / per_period, rel=0.01)
    heard = told(stepped(overtone=0.02))
    assert heard.distortion[:, 0] == pytest.approx(0.02 / np.abs(ANSWERS[:, 0]), rel=0.02)


def test_of_a_frequency_measured_twice_the_better_log_is_kept() -> None:
    clean, rough = stepped(noise=0.01, seed=1), stepped(noise=0.3, seed=2)
    for logs in ((clean, rough), (rough, clean)):
        found = told(*logs)
        assert found.omega == pytest.approx(FREQUENCIES, rel=1e-5)
        assert np.allclose(found.response[:, 0], ANSWERS[:, 0], atol=0.01)
        assert np.all(found.variance[:, 0] * AMPLITUDES**2 < 2e-5)


def test_a_log_in_which_nothing_is_asked_is_refused() -> None:
    still = record(np.ones(1000), np.zeros(1000))
    with pytest.raises(NotIdentifiable, match="never changes"):
        told(still)
    with pytest.raises(BadInput, match="not 'steps'"):
        told(still, kind="steps")
    noise = np.random.default_rng(0).normal(size=3000)
    with pytest.raises(NotIdentifiable, match="three periods of each in the command, or two between rests"):
        told(record(np.where(np.arange(3000) == 5, 1.0, 0.0), noise), kind="sines")
    for command in (noise, np.tile(noise[:1000], 2)):
        with pytest.raises(NotIdentifiable, match="repeats three times"):
            told(record(command, command), kind="multisine")
    thrice = np.tile(noise[:1000], 3)
    every = told(record(thrice, thrice), kind="multisine")
    assert not every.distortion.any()  # no odd line is left to see any on


LENGTH = 500
LINES = np.array([3, 5, 11, 19])


def periodic(periods: int = 8, noise: float = 0.0, drift: float = 0.0, extra: float = 0.0) -> tuple[Record, np.ndarray]:
    """Four odd lines, each answered by 1/(1 + i k/5); noise, a ramp, and a line at 7 that nobody asked."""
    k = np.arange(periods * LENGTH)
    phase = 2 * math.pi * k[:, None] * LINES / LENGTH
    size = np.array([1.0, 2.0, 0.5, 1.0])
    start = np.array([0.1, 2.0, 4.0, 5.0])
    answer = 1 / (1 + 1j * LINES / 5)
    u = np.sum(size * np.cos(phase + start), axis=1)
    y = np.sum(np.real(size * answer * np.exp(1j * (phase + start))), axis=1)
    y += noise * np.random.default_rng(4).normal(size=k.size) + drift * k * DT
    y += extra * np.cos(2 * math.pi * 7 * k / LENGTH)
    return record(u, y), answer


@pytest.mark.parametrize(("size", "lines"), [(0.019, [3, 7, 11]), (0.021, [3, 7, 11, 30])])
def test_a_line_of_a_hundredth_of_the_largest_is_asked_for(size: float, lines: list[int]) -> None:
    phase = 2 * math.pi * np.arange(4 * LENGTH) / LENGTH
    u = np.cos(3 * phase) + 2 * np.sin(7 * phase) + np.sin(11 * phase) + size * np.sin(30 * phase)
    assert told(record(u, u), kind="multisine").omega == pytest.approx(2 * math.pi * np.array(lines) / (LENGTH * DT))


@pytest.mark.parametrize("kind", [None, "multisine"])
@pytest.mark.parametrize("drift", [0.0, 3.0])
def test_a_periodic_command_gives_the_response_at_its_lines(kind: str | None, drift: float) -> None:
    log, answer = periodic(drift=drift)
    found = told(log, kind=kind)
    assert found.omega == pytest.approx(2 * math.pi * LINES / (LENGTH * DT))
    assert found.response[:, 0] == pytest.approx(answer, abs=1e-9)
    assert np.abs(found.drive) == pytest.approx([1.0, 2.0, 0.5, 1.0])
    assert found.together
    assert found.notes == ("5 periods of 0.5 s averaged.",)  # three are looked at before they are known to be alike
    assert found.coherence == pytest.approx(1.0)
    assert found.distortion == pytest.approx(0.0, abs=1e-9)


def test_the_variance_of_a_periodic_response_is_that_of_repeats() -> None:
    """Of a mean of n lines, each uncertain by 4 s^2/N; rounding is the same in every period."""
    log, answer = periodic(periods=60, noise=0.02)
    found = told(log)
    count = int(found.notes[-1].split()[0])
    expected = 4 * 0.02**2 / LENGTH / count / np.array([1.0, 2.0, 0.5, 1.0]) ** 2
    # some fifty repeats tell a variance to 2/sqrt(50) of it, 14 %
    assert found.variance[:, 0] == pytest.approx(expected, rel=0.5)
    assert np.mean(found.variance[:, 0] / expected) == pytest.approx(1.0, abs=0.25)
    assert np.all(np.abs(found.response[:, 0] - answer) < 4 * np.sqrt(found.variance[:, 0]))
    power = (np.abs(answer) * np.array([1.0, 2.0, 0.5, 1.0])) ** 2
    assert 1 - found.coherence[:, 0] == pytest.approx(4 * 0.02**2 / LENGTH / power, rel=0.5)
    rounded = told(periodic()[0], resolution=[0.3])
    assert rounded.variance[:, 0] == pytest.approx(4 * 0.09 / 12 / LENGTH / np.array([1.0, 4.0, 0.25, 1.0]))


def test_what_stands_on_odd_lines_nobody_asked_is_distortion() -> None:
    """Of four lines beside those asked one has 0.02: the root of its power's mean is half of it."""
    log, answer = periodic(extra=0.02)
    found = told(log)
    size = np.abs(answer) * np.array([1.0, 2.0, 0.5, 1.0])
    # 1, 7, 9, 13 lie nearest to 3 and to 5, and 7, 9, 13, 15 to 11; to 19 lie 15, 17, 21, 23
    assert found.distortion[:, 0] == pytest.approx(np.array([0.01, 0.01, 0.01, 0.0]) / size, rel=1e-6, abs=1e-9)


def swept(seed: int, noise: float, gain: float = 2.0, seconds: float = 2.0) -> Record:
    """A sweep over 2 to 20 Hz that a gain answers at once, in noise."""
    u = chirp(2 * math.pi * 2, 2 * math.pi * 20, seconds, DT)
    y = gain * u + 0.4 + noise * np.random.default_rng(seed).normal(size=u.size)
    return record(u, y)


def test_repeats_of_a_sweep_are_averaged() -> None:
    """Cross spectrum over spectrum; what is not coherent is spread over all repeats but one."""
    logs = [swept(seed, 0.2) for seed in range(6)]
    found = told(*logs)
    assert found.notes == ("6 windows of 2 s.",)
    assert found.omega[0] == pytest.approx(2 * math.pi)  # the second line: a window tells no drift from its first
    assert found.omega[-1] < 2 * math.pi * 25
    assert np.diff(found.omega).min() == pytest.approx(2 * math.pi / 2.0)
    # the command is tapered over its last seventh, noise as well: N s^2 0.91 of power in each line
    k = (np.arange(2000) + 0.5) / 2000
    taper = np.where(k < 0.85, 1.0, np.cos(math.pi / 2 * (k - 0.85) / 0.15) ** 2)
    U = np.fft.rfft(taper * logs[0]["u"])
    line = np.round(found.omega / math.pi).astype(int)
    own = 0.04 * np.sum(taper**2) / np.abs(U[line]) ** 2  # of one repeat
    assert np.median(found.variance[:, 0] / (own / 6)) == pytest.approx(1.0, abs=0.35)
    assert np.median((1 - found.coherence[:, 0]) / (own / 4.0 * 5 / 6)) == pytest.approx(1.0, abs=0.35)
    assert np.median(np.abs(found.response[:, 0] - 2.0) ** 2 / (own / 6)) / math.log(2) == pytest.approx(1.0, abs=0.35)
    assert np.abs(found.drive) == pytest.approx(np.sqrt(2 * np.mean(logs[0]["u"] ** 2)))
    amplitude = np.abs(found.response) * np.abs(found.drive)[:, None]
    assert found.dry == pytest.approx(describing(found.omega, amplitude))


def test_rounding_bounds_the_variance_of_a_sweep() -> None:
    logs = [swept(0, 0.0) for _ in range(4)]
    found = told(*logs, resolution=[0.1])
    assert found.variance[:, 0] == pytest.approx(0.01 / 3 / 2000 / np.abs(found.drive) ** 2, rel=1e-3)


def test_a_long_sweep_is_cut_into_windows_and_a_short_one_refused() -> None:
    """Of 20 s each window is two ninths; eighty frequencies at most are told, evenly on a log scale."""
    u = np.random.default_rng(2).normal(size=20_000)
    drifting = record(u, 2.0 * u + 0.05 * np.arange(20_000) * DT)
    found = told(drifting)
    assert found.response[:, 0] == pytest.approx(2.0, rel=0.05)
    assert found.notes == ("8 windows of 4.44 s.",)
    assert 40 < len(found.omega) <= 80
    assert found.omega[-1] == pytest.approx(math.pi / DT, rel=1e-3)
    ratio = np.diff(np.log(found.omega))
    assert ratio[-20:].max() < 1.2 * ratio[-20:].min()
    with pytest.raises(NotIdentifiable, match="three windows or repeats and three frequencies, got 2"):
        told(record(u[:100], u[:100]), kind="sweep")


def test_odd_lines_are_spread_on_a_log_scale_and_every_fourth_stays_silent() -> None:
    assert odd_lines(1.0, 81.0, 5, 1.0).tolist() == [1, 3, 27, 81]
    assert odd_lines(2.2, 1000.0, 2, 2.0).tolist() == [1, 501]
    assert all(n % 2 for n in odd_lines(1.0, 500.0, 40, 0.25).tolist())


def test_a_multisine_has_the_amplitudes_asked_and_a_low_crest() -> None:
    lines, size = np.array([1, 3, 7, 9, 15]), np.array([1.0, 0.5, 2.0, 1.0, 0.25])
    u = multisine(lines, size, 400)
    spectrum = np.abs(np.fft.rfft(u)) * 2 / 400
    assert spectrum[lines] == pytest.approx(size)
    assert np.delete(spectrum, lines) == pytest.approx(0.0, abs=1e-12)
    assert np.abs(u).max() < 0.8 * size.sum()
    assert not np.allclose(u, multisine(lines, size, 400, seed=1))
    assert np.array_equal(u, multisine(lines, size, 400, seed=0))


def test_a_chirp_grows_evenly_on_a_log_scale() -> None:
    u = chirp(3.0, 60.0, 4.0, DT)
    t = DT * np.arange(4000)
    expected = scipy.signal.chirp(t, 3.0 / (2 * math.pi), 4.0, 60.0 / (2 * math.pi), method="logarithmic", phi=-90)
    assert u == pytest.approx(expected, abs=1e-9)


def test_a_command_repeats_from_twice_on() -> None:
    once = np.random.default_rng(3).normal(size=100)
    assert repetition(np.tile(once, 2)) == 100
    assert repetition(np.tile(once, 5)[:460]) == 100
    assert repetition(np.tile(once, 2)[:190]) is None
    assert repetition(np.ones(300)) is None
    assert repetition(once) is None


@pytest.mark.parametrize("at", [0, 1, 10, 18, 19])
def test_a_kick_in_each_period_repeats_wherever_in_the_period_it_stands(at: int) -> None:
    """Both periods are the same, so their correlation is 1: no sample beside them may be counted with them."""
    assert repetition(np.tile(np.arange(20) == at, 2).astype(float)) == 20


def test_what_grows_from_period_to_period_repeats_as_little_as_its_correlation_says() -> None:
    """A noise of 5 % of the size on either period leaves 1 / (1 + 0.05^2) = 0.9975 < 0.999; one of 1 % does not."""
    g = np.random.default_rng(4)
    once = g.normal(size=500)
    apart = g.normal(size=(2, 500))
    assert repetition((once + 0.01 * apart).ravel()) == 500
    assert repetition((once + 0.05 * apart).ravel()) is None


@pytest.mark.parametrize(
    ("periods", "per_period", "good"), [(0.85, 40, False), (0.95, 40, True), (9, 3.9, False), (9, 4.1, True)]
)
def test_a_sine_needs_about_a_period_and_four_samples_in_each(periods: float, per_period: float, good: bool) -> None:
    n = round(periods * per_period)
    t = DT * np.arange(n)
    omega = 2 * math.pi * periods / (n * DT)
    if not good:
        with pytest.raises(BadInput, match="four samples"):
            detect(t, np.cos(omega * t), omega)
        return
    tone = detect(t, np.column_stack([np.cos(omega * t), 2 * np.sin(omega * t)]), omega)
    if periods > 1:
        assert tone.lines[0] == pytest.approx([1.0, -2.0j], abs=1e-6)


def test_harmonics_below_half_the_samples_are_told_31_at_most() -> None:
    for per_period, count in ((21, 9), (11, 4), (41, 18), (400, 31)):
        t = DT * np.arange(5 * per_period)
        tone = detect(t, np.cos(2 * math.pi * t / (per_period * DT)), 2 * math.pi / (per_period * DT))
        assert tone.lines.shape[0] == count
    tones = [detect(DT * np.arange(231), np.arange(231.0), 2 * math.pi / (n * DT)) for n in (21, 11)]
    assert overtones(tones).shape == (2, 1, 3)
    assert overtones(tones[:1], most=2).shape == (1, 1, 2)
    assert np.array_equal(overtones(tones)[0, 0], tones[0].lines[1:4, 0])


def test_slow_changes_show_between_the_parts_of_a_sine() -> None:
    """An amplitude of 1.1 in one half and 0.9 in the other: parts of +-0.1, so 0.1^2 2/(2 - 1)/2 of two."""
    t = DT * np.arange(2000)
    omega = 2 * math.pi * 10
    y = np.where(t < 1.0, 1.1, 0.9) * np.cos(omega * t)
    halves = detect(t, y, omega, blocks=2)
    assert halves.variance[0] == pytest.approx(0.01, rel=0.02)
    assert halves.coherence[0] == pytest.approx(0.5 / (0.5 + 0.005), rel=1e-2)
    sixteen = detect(t, y, omega)
    assert sixteen.variance[0] == pytest.approx(0.01 * 16 / 15 / 16, rel=0.05)
    assert detect(t, y, omega, blocks=1).variance[0] == pytest.approx(4 * 0.005 / 2000, rel=0.05)


def test_lines_of_periods_are_told_under_a_drift_by_their_phase() -> None:
    n = 40
    k = np.arange(3 * n + 17)
    y = np.column_stack([np.cos(2 * math.pi * k / n + 0.7) + 0.3 * k, 5.0 + np.sin(2 * math.pi * k / n)])
    assert by_period(y, n, DT) == pytest.approx(np.tile([np.exp(0.7j), -1j], (3, 1)), abs=1e-9)


def test_the_sign_of_a_speed_is_told_by_where_the_motion_turns() -> None:
    """A position least at 0.4 and greatest at 2.9 rad of each period: the speed is above zero in between."""
    low, high = 0.4, 2.9
    omega = 2 * math.pi * 2
    t = DT * np.arange(4000)
    phase = np.mod(omega * t, 2 * math.pi)
    up = np.cos(math.pi * (phase - high) / (high - low))
    since = np.mod(phase - high, 2 * math.pi)
    down = np.cos(math.pi * since / (2 * math.pi - high + low))
    y = np.where((phase >= low) & (phase < high), up, down)
    at = 2 * math.pi * np.arange(4096) / 4096
    rough = np.where((at > low + 0.1) & (at < high - 0.1), 1.0, -1.0)
    exact = 1j * 2 / math.pi * (np.exp(-1j * high) - np.exp(-1j * low))
    assert sign_line(t, y, omega, rough) == pytest.approx(exact, abs=2e-3)
    turned = sign_line(t, -y, omega, -rough)
    assert turned == pytest.approx(-exact, abs=2e-3)
    assert sign_line(t, y, omega, np.ones(4096)) is None
    assert sign_line(t, y, omega, np.sin(3 * at)) is None
    far = np.where((at > low + 1.0) & (at < high - 0.1), 1.0, -1.0)
    assert sign_line(t, y, omega, far) is None
    assert sign_line(t[::120], y[::120], omega, rough) is None


EXCITED = {
    "sines": lambda: (stepped(noise=0.01, overtone=0.02),),
    "multisine": lambda: (periodic(noise=0.02, extra=0.02)[0],),
    "sweep": lambda: tuple(swept(seed, 0.2) for seed in range(4)),
}


@pytest.mark.parametrize("kind", EXCITED)
def test_a_response_depends_on_units_as_a_ratio_does_and_neither_on_the_clock_nor_on_a_mirror(kind: str) -> None:
    """Readings eight times as large under a command of half the size: 16 times the response, 256 times its variance.

    One unit of Coulomb friction comes to an eighth of the viscous one at eight times the speed. Powers of two round
    nothing, so that only the clock's own rounding is left. In a mirror a sine is cut half a period later.
    """
    logs = EXCITED[kind]()
    here = told(*logs)
    mirrored = [(-1.0, -1.0, 0.0)] if kind != "sines" else []
    for y, u, start in ((8.0, 0.5, 0.0), (1.0, 1.0, 1024.0), *mirrored):
        there = told(*(
            Record(
                t=start + log.t, signals={"u": u * log["u"], "y": y * log["y"]}, units={n: UNITS[n] for n in "uy"},
                provenance=log.provenance,
            )
            for log in logs
        ))  # fmt: skip
        times = y / u
        assert there.omega == pytest.approx(here.omega, rel=1e-9)
        assert there.response == pytest.approx(times * here.response, rel=1e-6)
        assert there.variance == pytest.approx(times**2 * here.variance, rel=1e-4)
        assert np.abs(there.drive) == pytest.approx(np.abs(u * here.drive), rel=1e-6)
        assert there.dry == pytest.approx(here.dry / abs(y), rel=1e-6)
        for name in ("coherence", "distortion", "still"):
            assert getattr(there, name) == pytest.approx(getattr(here, name), rel=1e-4, abs=1e-9)
        assert there.overtones == pytest.approx(y * here.overtones, rel=1e-5, abs=1e-9)
        assert (there.notes, there.together, there.hold) == (here.notes, here.together, pytest.approx(here.hold))
