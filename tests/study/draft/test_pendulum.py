"""Is the study that a log drafts one that a person would have written? Logs come from closed forms."""

import math
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.study.draft.test_recognise import col
from upright.errors import BadInput
from upright.physics import Coordinate, Joint, Plant, find
from upright.quantities import quantity
from upright.readers import inspect, read
from upright.study.draft.draft import draft
from upright.study.draft.pendulum import _gain, starts_hanging
from upright.study.draft.recognise import Recognised, moves_against
from upright.study.load import load_study

G = 9.81
LENGTH = 0.35
W = math.sqrt(G / LENGTH)
T = np.arange(4000) * 0.01
# a small swing loses amplitude in a straight line under dry friction, and then rests
ENVELOPE = np.clip(0.2 - 0.008 * T, 0.0, None)
SWING = ENVELOPE * np.cos(W * T)
ENC1, ENC2 = np.round(4000 * SWING), np.round(3000 * ENVELOPE * np.sin(1.7 * W * T))


def test_one_angle_is_a_pendulum_of_the_length_its_period_tells(drafted):
    _, study = drafted(theta=SWING)
    assert study.plant == "pendulum"
    assert study.model.parameters["l_cg"].value == pytest.approx(LENGTH, rel=0.01)
    assert {"l_cg", "b_2", "b_2c"} <= set(study.model.estimated)


def test_a_swing_about_half_a_turn_hangs_there(drafted):
    _, study = drafted(theta=math.pi + SWING)
    np.testing.assert_allclose(study.runs[0].y[:, 0], np.interp(study.runs[0].t, T, SWING), atol=2e-3)


def test_degrees_and_nameless_columns_about_half_a_turn_are_angles(drafted):
    _, study = drafted(c1=math.pi + 3 * SWING, c2=np.gradient(3 * SWING, T))
    assert study.plant == "pendulum"


def test_encoder_counts_are_found_in_radians(drafted):
    step = 2 * math.pi / 4000
    _, study = drafted(theta=np.round(SWING / step) * step)
    assert study.runs[0].resolution == pytest.approx((step,), rel=1e-6)


def test_the_part_before_the_release_and_the_rest_are_left_out(drafted):
    before = np.full(300, SWING[0])
    t = np.arange(300 + T.size) * 0.01
    _, study = drafted(t=t, theta=np.concatenate([before, SWING]))
    assert 2.9 < study.runs[0].t[0] < 3.1 + 2 * math.pi / W  # within a period of the release at 3 s
    assert study.runs[-1].t[-1] < 3 + 26  # dry friction stops it 25 s after the release


def test_a_long_swing_keeps_its_tail_for_prediction(drafted):
    _, study = drafted(theta=SWING)
    assert [run.role for run in study.runs] == ["fit", "predict"]


def test_a_cart_and_an_angle_with_volts_are_a_driven_cart_pendulum(drafted):
    v = np.where((T > 1) & (T < 20), np.sign(np.sin(T)), 0.0)
    x = np.where(T > 1, 0.1 * (1 - np.cos(T - 1)), 0.0)
    text, study = drafted(v=v, x=x, theta=np.where(T > 1, 0.1 * np.sin(W * (T - 1)), 0.0))
    assert study.plant == "cart-pendulum"
    assert study.runs[0].measured == ("x", "theta")
    assert 'column = "v"' in text
    assert "actuator.gain" in study.model.estimated
    assert "sign = -1   # the first" not in text


def test_a_drive_that_moves_its_body_backwards_is_reversed(drafted):
    v = np.where((T > 1) & (T < 20), 1.0, 0.0)
    x = np.where(T > 1, -0.1 * (1 - np.cos(T - 1)), 0.0)
    text, study = drafted(v=v, x=x, theta=np.where(T > 1, 0.1 * np.sin(W * (T - 1)), 0.0))
    assert "sign = -1   # the first" in text
    assert study.runs[0].u.min() == -1.0


def test_a_moving_cart_without_a_drive_is_prescribed_by_its_own_motion(drafted):
    x = np.where(T > 1, 0.1 * (1 - np.exp(-(T - 1))), 0.0)
    _, study = drafted(x=x, theta=np.where(T > 1, SWING, 0.0))
    assert list(study.runs[0].held) == ["x"]
    assert study.runs[0].measured == ("theta",)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_pendulum_that_is_thrown_the_wrong_way_is_mirrored(drafted, sign):
    # steady answer of theta'' = -x''/l - w^2 theta to x = a sin(nu t), with a start at rest left out
    nu, a = 3.0, 0.02
    theta = a * nu**2 / LENGTH / (W**2 - nu**2) * np.sin(nu * T) + 0.05 * np.cos(W * T)
    text, _ = drafted(x=a * np.sin(nu * T), theta=sign * theta)
    assert ("\nsign = -1   # it swings" in text) == (sign == -1)


def test_an_arm_that_hardly_moves_is_no_second_coordinate(drafted):
    _, study = drafted(psi=1e-4 * np.sin(T), theta=SWING)
    assert study.plant == "pendulum"


def test_two_encoders_in_counts_are_a_chain(drafted):
    _, study = drafted(enc1=ENC1, enc2=ENC2)
    assert study.plant == "rectilinear-2"
    assert study.runs[0].measured == ("x_1", "x_2")


def test_the_plant_may_be_named(drafted):
    _, study = drafted(plant="torsional-2", enc1=ENC1, enc2=ENC2)
    assert study.runs[0].measured == ("theta_1", "theta_2")


def test_what_the_log_does_not_show_is_marked(drafted):
    text, _ = drafted(enc1=np.round(4000 * SWING))
    assert "counts_per_m" in [line.split(" =")[0] for line in text.splitlines() if "MEASURE" in line]


def test_a_log_in_which_nothing_moves_is_refused_with_a_sentence(drafted):
    with pytest.raises(BadInput, match="no column moves"):
        drafted(theta=np.zeros_like(T), x=np.ones_like(T))


def test_file_and_column_names_survive_any_characters(drafted):
    _, study = drafted(name='a "quoted" log.csv', theta=SWING)
    assert study.runs[0].label.startswith('a "quoted" log')


@pytest.mark.real_data
@pytest.mark.slow
def test_every_real_log_drafts_a_study_that_loads(tmp_path):
    folder = Path(os.environ["UPRIGHT_REAL_DATA"])
    logs = [p for p in folder.rglob("*") if p.suffix in (".csv", ".mat", ".txt") and "README" not in p.name]
    refused = []
    for log in logs:
        try:
            record = read(log)
            text = draft(record, inspect(record), log, tmp_path / "study.toml")
        except BadInput as error:
            refused.append(f"{log.name}: {error}")
            continue
        (tmp_path / "study.toml").write_text(text, encoding="utf-8")
        assert load_study(tmp_path / "study.toml").runs, log.name
    assert len(refused) <= 2, refused  # the authors' own parameters are a .mat file too, and no log
    assert len(logs) > 50


def test_a_command_in_converter_counts_drives_in_volts(drafted):
    # ECP's front end: 409 counts are 0.5 V
    command = np.where((T > 5) & (T < 10), -409.0, 0.0)
    text, study = drafted(target_value=command, cart1pos=ENC1, cart2pos=ENC2)
    assert 'column = "target_value"' in text
    run = study.runs[0]
    assert {round(float(v), 3) for v in np.unique(run.u)} == {-0.499, 0.0}


def test_a_nameless_column_that_only_switches_is_the_command(drafted):
    # a cart pushed to and fro by -4 A and 4 A, switched far more often than once in a hundred samples
    current = np.where(np.mod(T, 0.6) < 0.3, 4.0, -4.0)
    text, study = drafted(c1=current, c2=0.3 + 0.01 * np.sin(2 * np.pi * T / 0.6) + 1e-4 * np.sin(40 * T))
    assert study.plant == "rectilinear-1"
    assert '[drive]\ncolumn = "c1"' in text
    assert "Column 'c2' says neither unit nor kind" in text


def test_an_angle_that_swings_by_more_than_half_a_turn_is_in_degrees(drafted):
    text, study = drafted(theta=np.degrees(4 * SWING))
    assert study.model.parameters["l_cg"].value == pytest.approx(LENGTH, rel=0.1)  # 0.8 rad lengthens it by 4 %
    at = np.interp(study.runs[0].t, T, 4 * SWING)
    np.testing.assert_allclose(study.runs[0].y[:, 0], at, atol=0.02)
    assert "taken for degrees" in text


def pushed(sign: float, *, moving: bool) -> tuple[np.ndarray, np.ndarray]:
    """A cart that volts push along `sign`, and those volts, on for two seconds in every three; it may move before."""
    u = np.where((T % 3.0 < 2.0) & (T > 1.0), 1.0 - 2.0 * ((T // 3) % 2), 0.0)
    x, v, out = 0.0, (-0.3 * sign if moving else 0.0), []
    for push in u:  # damped, with steps far below the time constant of 0.5 s
        out.append(x)
        for _ in range(10):
            v += 1e-3 * (0.5 * sign * push - 2.0 * v)
            x += 1e-3 * v
    return u, np.array(out)


def guessed_gain(plant, guess="rad", low=-0.3, high=0.3, frequency=5.0, command=None):
    """Gain that a draft begins with, of a coordinate and a command that go so far."""
    column, drive = col("q", guess, low=low, high=high), col("u", **(command or {"low": -2.0, "high": 1.5}))
    return _gain(Recognised(
        plant=plant, columns={"q": column}, rest={"q": 0.0}, drive=drive, reversed=False, throw=0.0,
        window=(0.0, 1.0), frequency=frequency, settled=True, doubts=(),
    ))  # fmt: skip


@pytest.mark.parametrize(
    ("plant", "inertia"), [("furuta", 2e-3), ("cart-pendulum", 1.1), ("pendulum", (G / 25.0) ** 2)]
)
def test_a_gain_begins_where_the_start_inertia_swings_as_far_as_was_seen(plant, inertia):
    """J A w^2 = k u: of 0.3 rad at 5 rad/s under 2 V at most; a kilogram at g/w^2 has J = (g/w^2)^2."""
    assert guessed_gain(plant) == pytest.approx(inertia * 0.3 * 25.0 / 2.0)
    assert guessed_gain(plant, low=-1.3, high=-0.7) == pytest.approx(guessed_gain(plant))
    assert guessed_gain(plant, low=0.0, high=0.0) == 1e-9
    # 409 counts of ECP's converter are half a volt
    dac = {"low": -1636.0, "high": 1227.0, "remarks": ("the command in DAC counts",)}
    assert guessed_gain(plant, command=dac) == pytest.approx(guessed_gain(plant), rel=2e-3)
    assert guessed_gain(plant, command={"low": 0.0, "high": 0.0}) == pytest.approx(2 * guessed_gain(plant))


@pytest.mark.parametrize(("guess", "unit"), [("deg", math.pi / 180), ("mm", 1e-3), ("counts", math.tau / 16_000)])
def test_a_gain_begins_as_large_in_other_units_of_the_swing(guess, unit):
    """Counts are those of an encoder of 16,000 a turn; a start is right within a few percent of the unit."""
    other = guessed_gain("furuta", guess, low=-0.3 / unit, high=0.3 / unit)
    assert other == pytest.approx(guessed_gain("furuta"), rel=0.05)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("moving", [False, True])
def test_the_sign_of_the_drive_is_that_of_the_acceleration(sign, moving):
    # a cart that still rolls the other way when the first command comes would tell the opposite
    u, x = pushed(sign, moving=moving)
    assert moves_against(T, u, x) == (sign < 0)


def test_the_place_of_a_pendulum_that_moves_when_the_command_comes_is_not_its_zero(drafted):
    u = np.where((T > 0.2) & (T < 1.0), 1.0, 0.0)  # it swings from the start, at 0.06 rad when the command comes
    _, study = drafted(theta=SWING + 0.5, u=u)
    at = np.interp(study.runs[0].t, T, SWING)
    np.testing.assert_allclose(study.runs[0].y[:, 0], at, atol=0.02)


def test_a_clock_in_microseconds_is_told_not_fitted(drafted):
    with pytest.raises(BadInput, match=r"every 2 s, got one every 1e\+04 s; its clock may count microseconds"):
        drafted(t=1e6 * T, theta=SWING)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("u [V]", "V"),
        ("u_V", "V"),
        ("v (mV)", "V"),
        ("i_A", "A"),
        ("F [N]", "N"),
        ("tau_Nm", "N m"),
        ("T [Nm]", "N m"),
        ("Drehmoment [mNm]", "N m"),  # no word that is known: its unit says that it is applied
        ("Kraft (N)", "N"),
    ],
)
def test_a_command_may_wear_its_unit_and_is_drafted_without_its_prefix(drafted, name, unit):
    t = np.arange(4000) * 0.01
    u = 2 * np.sin(3 * t) + np.sin(7.3 * t)
    text, study = drafted("cart-pendulum", **{"x": 0.05 * np.sin(2 * t), "theta": 0.3 * np.cos(6 * t), name: u})
    drive = tomllib.loads(text)["drive"]
    assert (drive["column"], drive["unit"]) == (name, unit)
    per = 1e-3 if "mV" in name or "mNm" in name else 1.0
    largest = max(np.abs(run.u).max() for run in study.runs)
    np.testing.assert_allclose(largest, per * np.abs(u).max(), rtol=1e-6)


@pytest.mark.parametrize("name", ["v [m/s]", "f [Hz]", "i_a", "t_amb [K]", "theta [V]"])
def test_what_only_begins_like_a_command_drives_nothing(drafted, name):
    t = np.arange(4000) * 0.01
    other = 2 * np.sin(3 * t) + np.sin(7.3 * t)
    text, _ = drafted("cart-pendulum", x=0.05 * np.sin(2 * t), theta=0.3 * np.cos(6 * t), **{name: other})
    assert "drive" not in tomllib.loads(text)


def test_an_arm_that_turns_to_and_fro_stays_in_rad_where_its_steps_are_parts_of_a_turn(drafted):
    t = np.arange(4000) * 0.01
    step = 2 * math.pi / 4096
    arm, rod = (np.round(x / step) * step for x in (8 * np.sin(2 * t), 0.5 * np.cos(6 * t)))
    text, _ = drafted("furuta", psi=arm, theta=rod, u=np.cos(2 * t))
    assert tomllib.loads(text)["sensors"]["psi"]["unit"] == "rad"


class Spring(Plant):
    """A weight whose axis has a spring: sizes in every unit that a swing sets."""

    m_p: float = quantity("kg", "mass", above=0)
    l_cg: float = quantity("m", "to the centre of gravity", above=0)
    J_p: float = quantity("kg m^2", "moment of inertia", at_least=0)
    k: float = quantity("N m/rad", "spring", at_least=0)
    n: float = quantity("1", "share", at_least=0)
    b: float = quantity("N m s/rad", "viscous friction", default=0.0)
    d: float = quantity("N s/m", "drag", default=0.0)
    f: float = quantity("N m", "dry friction", default=0.0)
    coordinates = (Coordinate("theta", "rad", "angle"),)
    joints = (Joint(on="theta", coulomb="f"),)

    @staticmethod
    def energies(p, q, v):
        T = (p.J_p + p.m_p * p.l_cg**2) * v[0] ** 2 / 2
        return T, (p.k + p.n * p.m_p * G * p.l_cg) * q[0] ** 2 / 2, (p.b + p.d * p.l_cg**2) * v[0] ** 2 / 2


def swinging(w: float) -> Recognised:
    return Recognised(plant="own", columns={}, rest={}, drive=None, reversed=False, throw=0.0,
                      window=(0.0, 9.0), frequency=w, settled=True, doubts=())  # fmt: skip


def test_a_plant_of_the_user_s_own_that_slides_starts_from_sizes_that_swing_as_slowly():
    """Of 1 kg: w^2 = k / m of the spring, a thousandth of critical damping, and two of the weight as dry friction."""
    w = 4.0
    asked = starts_hanging(swinging(w), find("rectilinear-2")).guesses
    assert asked["k_12"] / asked["m_2"] == pytest.approx(w**2)
    assert asked["c_1"] / (2 * asked["m_2"] * w) == pytest.approx(1e-3)
    assert asked["f_1c"] == pytest.approx(2e-3 * asked["m_2"] * G)


def test_a_plant_of_the_user_s_own_starts_from_sizes_that_swing_as_slowly():
    """Of 1 kg: w^2 = g / l of the weight, k / J of the spring, and a thousandth of critical damping."""
    w = 4.0
    starts = starts_hanging(swinging(w), Spring)
    mass, _ = starts.assumed["m_p"]
    asked = starts.guesses
    assert mass == 1.0
    assert G / asked["l_cg"] == pytest.approx(w**2)
    assert asked["J_p"] == pytest.approx(mass * asked["l_cg"] ** 2)
    assert asked["k"] / asked["J_p"] == pytest.approx(w**2)
    assert asked["b"] / (2 * asked["J_p"] * w) == pytest.approx(1e-3)
    assert asked["d"] / (2 * mass * w) == pytest.approx(1e-3)
    assert asked["f"] == pytest.approx(2e-3 * mass * G * asked["l_cg"])
    assert asked["n"] == 1.0
    assert asked.keys() == {"l_cg", "J_p", "k", "n", "b", "d", "f"}
