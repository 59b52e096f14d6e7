"""Is the response of logs that of the motion in them, whatever their columns are called and in whichever unit?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.errors import BadInput, NotIdentifiable
from upright.experiments.frequency_1b.chapter import log_chapter
from upright.experiments.frequency_1b.run import LogRequest, response_of_logs
from upright.identification.frequency.response import FrequencyResponse
from upright.records import Record
from upright.signals.steps import smallest_step

DT, LENGTH, PERIODS = 0.01, 1000, 5
LINES = np.array([3, 7, 15, 31, 63])
OMEGA = 2 * math.pi * LINES / (LENGTH * DT)
A, B = 3.0, 2.0
"""theta' = -A theta + B u: its response is B/(j omega + A)."""


def write(path, scale=1.0, unit="rad", command="u", column="theta", other=None):
    """Five periods of a motion in steady state, as its closed form has it."""
    t = np.arange(LENGTH * PERIODS) * DT
    waves = np.exp(1j * (OMEGA * t[:, None] + np.arange(LINES.size)))
    signals = {command: waves.real.sum(axis=1), column: scale * (waves * (B / (1j * OMEGA + A))).real.sum(axis=1)}
    units = {command: "V", column: unit}
    if other is not None:
        signals["extra"] = other * t
    Record(t=t, signals=signals, units=units, inputs=(command,), outputs=(column,)).to_csv(path)
    return path


def request(**more):
    return LogRequest(**({"signals": {}, "counts": {}, "known": {}, "kind": "multisine"} | more))


def asked(path, folder, **more):
    return response_of_logs([path], request(**more), folder).response


def closed(omega):
    return B / (1j * omega + A)


@pytest.mark.parametrize(
    ("scale", "unit", "counts", "to"),
    [(1.0, "rad", {}, "rad"), (180 / math.pi, "deg", {}, "rad"), (2546.5, "counts", {"theta": 2546.5}, "rad"),
     (-2546.5, "counts", {"theta": -2546.5}, "rad"), (1000.0, "mm", {}, "m")],
)  # fmt: skip
def test_a_column_in_any_unit_gives_the_response_in_rad_or_m(scale, unit, counts, to, tmp_path):
    found = asked(write(tmp_path / "log.csv", scale, unit), tmp_path / "out", counts=counts)
    np.testing.assert_allclose(found.omega, OMEGA, rtol=1e-6)
    np.testing.assert_allclose(found.response[:, 0], closed(OMEGA), rtol=1e-3)
    assert found.units == (to, "V")
    again = FrequencyResponse.from_csv(tmp_path / "out" / "frequency.csv")
    np.testing.assert_allclose(again.response, found.response, rtol=1e-6)


def test_counts_stay_counts_where_no_fit_needs_more_and_are_refused_where_one_does(tmp_path):
    path = write(tmp_path / "log.csv", 100.0, "counts")
    found = asked(path, tmp_path / "out")
    assert found.units == ("counts", "V")
    np.testing.assert_allclose(found.response[:, 0], 100 * closed(OMEGA), rtol=1e-3)
    with pytest.raises(BadInput, match=r"--counts theta=2546\.5"):
        asked(path, tmp_path / "out", make="furuta")
    with pytest.raises(BadInput, match="names 'psi', which is no output"):
        asked(path, tmp_path / "out", counts={"psi": 3.0})


def test_columns_are_taken_as_they_are_named(tmp_path):
    path = write(tmp_path / "log.csv", column="alpha", command="volts", other=0.0)
    found = asked(path, tmp_path / "out", command="volts", signals={"theta": "alpha"})
    assert found.outputs == ("theta",)
    np.testing.assert_allclose(found.response[:, 0], closed(OMEGA), rtol=1e-3)


def test_a_column_is_named_without_the_unit_in_its_brackets(tmp_path):
    """A spreadsheet of sines one after the other, in degrees and milliseconds; a second encoder was not connected."""
    omega = np.array([2.0, 5.0, 11.0])
    t = np.concatenate([np.arange(0, 40, 5e-3) + 40 * k for k in range(3)])
    w = np.repeat(omega, t.size // 3)
    turn = np.exp(1j * w * (t % 40))
    table = np.column_stack([1e3 * t, turn.imag, np.degrees((turn * closed(w)).imag), 0 * t])
    head = "Zeit [ms];Motor [V];Winkel [deg];enc2 [deg]"
    np.savetxt(tmp_path / "log.csv", table, delimiter=";", header=head, comments="", fmt="%.9g")
    found = response_of_logs(
        [tmp_path / "log.csv"], request(command="Motor", signals={"theta": "Winkel"}, kind=None), tmp_path / "out"
    ).response
    assert (found.outputs, found.units, found.input) == (("theta",), ("rad", "V"), "Motor [V]")
    np.testing.assert_allclose(found.omega, omega, rtol=1e-6)
    np.testing.assert_allclose(found.response[:, 0], closed(omega), rtol=1e-3)
    whole = response_of_logs([tmp_path / "log.csv"], request(command="Motor", kind=None), tmp_path / "out")
    verdict = log_chapter(whole).verdict
    assert "3 of 3 frequencies" in verdict
    assert "enc2 [deg] follows the command at no frequency" in verdict


def test_a_log_that_does_not_say_what_drives_is_asked_for_it(tmp_path):
    log = Record.from_csv(write(tmp_path / "log.csv"))
    log.replace(inputs=(), outputs=log.names).to_csv(tmp_path / "unsaid.csv")
    text = (tmp_path / "unsaid.csv").read_text(encoding="utf-8")
    (tmp_path / "bare.csv").write_text(
        "\n".join(line for line in text.splitlines() if not line.startswith("#")).replace("u", "a", 1), encoding="utf-8"
    )
    with pytest.raises(BadInput, match=r"say which one drives with --command"):
        asked(tmp_path / "bare.csv", tmp_path / "out")


@pytest.mark.parametrize("written", [False, True])
def test_a_band_keeps_the_frequencies_within_it_its_ends_too(written, tmp_path):
    """From logs and from a response alike."""
    path = write(tmp_path / "log.csv")
    if written:
        asked(path, tmp_path / "out")
        path = tmp_path / "out" / "frequency.csv"
        OMEGA_READ = FrequencyResponse.from_csv(path).omega
        found = asked(path, tmp_path / "again", band=(OMEGA_READ[1], OMEGA_READ[3]))
    else:
        found = asked(path, tmp_path / "out", band=(0.99 * OMEGA[1], 1.01 * OMEGA[3]))
    np.testing.assert_allclose(found.omega, OMEGA[1:4], rtol=1e-6)


@pytest.mark.parametrize("kind", ["multisine", None])
def test_logs_that_repeat_one_another_are_averaged_wherever_in_the_period_they_begin(kind, tmp_path):
    """Of 4 n periods the standard error is half that of n, and the response nearer to the truth."""
    rng = np.random.default_rng(5)
    paths = [tmp_path / f"noisy{i}.csv" for i in range(4)]
    for i, path in enumerate(paths):
        log = Record.from_csv(write(path))
        u, theta = (np.roll(log[n], 171 * i) for n in ("u", "theta"))
        log.replace(signals={"u": u, "theta": theta + rng.normal(0, 0.05, len(log))}).to_csv(path)
    one, four = (response_of_logs(some, request(kind=kind), tmp_path / "out").response for some in (paths[:1], paths))
    # the scatter of a few periods is itself known to 1/sqrt(2 * 2) for each of five lines
    assert np.median(four.error[:, 0] / one.error[:, 0]) == pytest.approx(0.5, rel=0.5)
    np.testing.assert_allclose(four.response[:, 0] / closed(OMEGA), 1.0, atol=4 * four.error.max())
    found = response_of_logs(paths, request(kind=kind), tmp_path / "out")
    assert found.sources == tuple(p.name for p in paths)


def test_logs_of_different_periods_are_refused(tmp_path):
    first = write(tmp_path / "a.csv")
    log = Record.from_csv(first)
    log.replace(t=1.5 * log.t).to_csv(tmp_path / "b.csv")
    with pytest.raises(NotIdentifiable, match="need one period, and hold 10 and 15 s"):
        response_of_logs([first, tmp_path / "b.csv"], request(), tmp_path / "out")


@pytest.mark.parametrize(("column", "step"), [([0.0, 0.5, 2.0, 0.5], 0.5), ([3.0, 3.0, 3.0], 0.0), ([1.0, -1.0], 2.0)])
def test_the_smallest_step_of_a_column_is_its_resolution_and_one_that_never_moves_has_none(column, step):
    assert smallest_step(np.array(column)) == step


STUDY = """
[rig]
plant = "torsional-1"
[parameters]
J_1 = {{ value = "0.0025 kg m^2", uncertainty = "1 %" }}
k_1 = {{ guess = "1 N m/rad" }}
c_1 = {{ guess = "0.01 N m s/rad" }}
{more}
[actuator]
gain = {{ guess = "0.3 N m/V" }}
"""


def analyser(folder, more=""):
    """A disk on a spring as an analyser has it, 2 % of noise; and a study of it without a log."""
    rng = np.random.default_rng(3)
    f = np.geomspace(0.5, 20, 80)
    s = 2j * math.pi * f
    h = 0.1 / (0.0025 * s * s + 0.004 * s + 2.5) * np.exp(0.02 * (rng.normal(size=80) + 1j * rng.normal(size=80)))
    rows = np.column_stack([f, 20 * np.log10(np.abs(h)), np.degrees(np.unwrap(np.angle(h)))])
    np.savetxt(folder / "a.csv", rows, delimiter=",", header="Frequency (Hz),Magnitude (dB),Phase (deg)", comments="")
    (folder / "study.toml").write_text(STUDY.format(more=more), encoding="utf-8")
    return folder / "a.csv", request(make=str(folder / "study.toml"))


def test_an_analysers_table_and_a_study_without_a_log_give_the_rig(tmp_path):
    table, asked_for = analyser(tmp_path)
    result = response_of_logs([table], asked_for, tmp_path / "out")
    fit = result.answer.fit
    assert fit.trusted
    assert result.response.outputs == ("theta_1",)
    for name, true in (("k_1", 2.5), ("c_1", 0.004), ("actuator.gain", 0.1)):
        low, high = fit.estimates[name].interval
        assert low <= true <= high
        assert (high - low) / true < 0.2
    again = response_of_logs([result.response], asked_for, tmp_path / "again").answer.fit
    assert again.estimates["k_1"].value == pytest.approx(fit.estimates["k_1"].value, rel=1e-9)


def test_dry_friction_that_a_table_cannot_show_is_not_sought_and_the_fit_not_trusted(tmp_path):
    table, asked_for = analyser(tmp_path, 'f_1c = { guess = "0.01 N m" }')
    fit = response_of_logs([table], asked_for, tmp_path / "out").answer.fit
    assert not fit.trusted
    assert "dry friction (f_1c) was not sought" in fit.verdict
    assert "f_1c" not in fit.estimates


def test_a_table_of_a_rig_with_several_coordinates_has_to_say_whose_response_it_is(tmp_path):
    table, _ = analyser(tmp_path)
    with pytest.raises(BadInput, match=r"'y' is no coordinate of .*--signal theta_2=COLUMN"):
        response_of_logs([table], request(make="torsional"), tmp_path / "out")
    with pytest.raises(BadInput, match="stands alone"):
        response_of_logs([table, response_of_logs([table], request(), tmp_path / "b").response], request(), tmp_path)
