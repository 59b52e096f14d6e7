"""Is the response of a table that another program wrote the one that it was written from?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.identification.frequency.balance import Balance
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.frequency.table import is_table, response_of_table
from upright.physics import CartPendulum
from upright.readers import read

OMEGA = 2 * np.pi * np.geomspace(0.5, 20, 40)
H = 0.1 / (2.5 - 0.0025 * OMEGA**2 + 0.004j * OMEGA)
"""A disk on a spring: theta per volt."""
HZ, DB, DEG = OMEGA / (2 * np.pi), 20 * np.log10(np.abs(H)), np.degrees(np.unwrap(np.angle(H)))


def write(path, names, *columns, delimiter=","):
    np.savetxt(path, np.column_stack(columns), delimiter=delimiter, header=names, comments="", fmt="%.12g")
    return path


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        ("Frequency (Hz),Magnitude (dB),Phase (deg)", (HZ, DB, DEG)),
        ("w,mag,phase", (OMEGA, np.abs(H), DEG)),
        ("omega [rad/s],Re,Im", (OMEGA, H.real, H.imag)),
        ("freq_hz,gain_dB,phase_rad", (HZ, DB, np.radians(DEG))),
        ("Frequenz [Hz],Betrag [dB],Winkel [°]", (HZ, DB, DEG)),
        ("f,Amplitude,Phase", (HZ, DB, DEG)),  # no ratio is below 0
        ("ω (rad/s),|H|,arg(H) (rad)", (OMEGA, np.abs(H), np.angle(H))),
        ("Phase (deg),Frequency (kHz),Magnitude (deg/V)", (DEG, HZ / 1000, np.degrees(np.abs(H)))),
    ],
)
def test_a_table_in_any_dialect_is_the_response_it_was_written_from(names, columns, tmp_path):
    path = write(tmp_path / "analyser.csv", names, *columns)
    assert is_table(path)
    read_back = response_of_table(path)
    np.testing.assert_allclose(read_back.omega, OMEGA, rtol=1e-10)
    np.testing.assert_allclose(read_back.response[:, 0], H, rtol=1e-9)
    assert not read_back.drive.any()
    assert not read_back.states_coherence


def test_a_workbook_of_excel_is_such_a_table_too(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [("Frequency (Hz)", "Magnitude (dB)", "Phase (deg)"), *zip(HZ, DB, DEG, strict=True)]:
        book.active.append(list(row))
    book.save(tmp_path / "analyser.xlsx")
    assert is_table(tmp_path / "analyser.xlsx")
    np.testing.assert_allclose(response_of_table(tmp_path / "analyser.xlsx").response[:, 0], H, rtol=1e-9)


def test_outputs_are_told_apart_by_their_names_and_take_those_that_are_asked(tmp_path):
    path = write(
        tmp_path / "two.csv", "freq [Hz];theta_re;theta_im;psi_re;psi_im", HZ, H.real, H.imag, -H.imag, H.real,
        delimiter=";",
    )  # fmt: skip
    both = response_of_table(path)
    assert both.outputs == ("theta", "psi")
    np.testing.assert_allclose(both.response, np.column_stack([H, 1j * H]), rtol=1e-9)
    assert response_of_table(path, {"alpha": "psi_re"}).outputs == ("alpha",)
    with pytest.raises(BadInput, match="no column 'phi'; its columns are theta_re"):
        response_of_table(path, {"alpha": "phi"})


def test_what_had_to_be_guessed_is_told(tmp_path):
    (first, second, third, _) = response_of_table(write(tmp_path / "a.csv", "w,mag,phase", OMEGA, np.abs(H), DEG)).notes
    assert first == "'w' states no unit and is taken as rad/s."
    assert second == "'mag' states no unit and is taken as a ratio, not as dB."
    assert third == "'phase' states no unit and is taken as deg."


def test_rows_in_any_order_and_a_row_at_zero_are_no_trouble(tmp_path):
    order = np.random.default_rng(1).permutation(OMEGA.size + 1)
    omega, re, im = (np.append(x, 0.0)[order] for x in (OMEGA, H.real, H.imag))
    mixed = response_of_table(write(tmp_path / "mixed.csv", "omega,re,im", omega, re, im))
    np.testing.assert_allclose(mixed.response[:, 0], H, rtol=1e-9)
    assert "1 rows are left out" in mixed.notes[-2]


def test_a_magnitude_without_its_phase_is_refused(tmp_path):
    with pytest.raises(BadInput, match="needs magnitude and phase"):
        response_of_table(write(tmp_path / "half.csv", "f,mag", HZ, np.abs(H)))


@pytest.mark.parametrize("sigma", [0.003, 0.03])
def test_neighbours_scatter_as_the_noise_that_was_added(sigma):
    """Median of the sizes of 796 normal numbers of known deviation, of which neighbours share points.

    Its relative standard error is 1.17/sqrt(796/3) = 0.07; three of them.
    """
    rng = np.random.default_rng(5)
    omega = np.geomspace(1.0, 100.0, 400)
    noisy = np.exp(sigma * (rng.normal(size=400) + 1j * rng.normal(size=400))) / (1j * omega + 10.0)
    scattered = FrequencyResponse(omega=omega, response=noisy[:, None], outputs=("y",)).with_scatter()
    assert scattered.error == pytest.approx(sigma, rel=0.21)


def test_a_motion_of_unknown_size_is_that_of_the_linear_model():
    """A pendulum on a cart, driven so hard that it would turn over if the size were known to be that of one unit."""
    plant = CartPendulum(m_c=0.6, m_p=0.135, l_cg=0.15, J_p=6e-4, b_1=1.2, b_2=3e-5)
    exact = plant.linear("hanging").to_control()(1j * OMEGA)[:, 0].T
    data = FrequencyResponse(omega=OMEGA, response=exact, outputs=("x", "theta"))
    values = {**plant.parameters(), "actuator.gain": 1.0}
    np.testing.assert_allclose(
        Balance(plant=CartPendulum, at="hanging", data=data).response(values)[0], exact, rtol=1e-9
    )
    driven = replace(data, drive=np.ones(OMEGA.size))
    large = Balance(plant=CartPendulum, at="hanging", data=driven).response(values)[0]
    assert np.abs(large / exact - 1).max() > 0.01


@pytest.mark.parametrize("names", ["Frequency (Hz),Magnitude (dB),Phase (deg)", "f,mag,phase", "frequency,x,y"])
def test_such_a_table_is_no_log_and_the_refusal_says_what_reads_it(names, tmp_path):
    path = write(tmp_path / "analyser.csv", names, HZ, DB, DEG)
    with pytest.raises(BadInput, match="a frequency response and no log; `upright frequency` reads it"):
        read(path)


def test_a_log_that_holds_a_frequency_beside_its_time_is_read(tmp_path):
    t = np.arange(40) * 0.01
    record = read(write(tmp_path / "chirp.csv", "frequency (Hz),t,theta_mag", HZ, t, DB))
    np.testing.assert_allclose(record.t, t, atol=1e-12)
    np.testing.assert_allclose(record["frequency (Hz)"], HZ, rtol=1e-9)
