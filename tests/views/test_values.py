"""Does a value show its own numbers, each under its heading, with its unit?"""

from __future__ import annotations

import math

import numpy as np
import pytest

import upright as up
from upright.report.drawing import BLUE, VERMILLION
from upright.views import MOST_PANELS, MOST_ROWS, summary, text

T = np.array([1.0, 1.25, 1.5, 1.75, 2.0])
COLUMNS = {
    "theta": np.array([0.0, 3.0, -2.0, 1.0, 0.5]), "V": np.array([4.0, 4.5, 4.25, 5.0, 4.0]),
    "turns": np.array([1.0, 2.0, 3.0, 4.0, 7.0]), "note": np.full(5, 6.0),
}  # fmt: skip
RECORD = up.Record(
    t=T, signals=COLUMNS, units={"theta": "rad", "V": "V", "turns": "1", "note": ""},
    outputs=("theta",), inputs=("V",),
)  # fmt: skip


def table(value):
    return summary(value).parts[0].content[0]


def test_a_record_lists_the_range_unit_and_role_of_every_column():
    shown = table(RECORD)
    assert shown.headings == ("column", "unit", "role", "least", "greatest")
    assert shown.rows == (
        ("theta", "rad", "measured", "−2.000", "3.000"), ("V", "V", "drives", "4.000", "5.000"),
        ("turns", "–", "", "1.000", "7.000"), ("note", "not specified", "", "6.000", "6.000"),
    )  # fmt: skip
    assert shown.caption == "Columns"
    assert [shown.headings[i] for i in shown.numbers] == ["least", "greatest"]
    seen = summary(RECORD)
    assert (seen.title, seen.verdict) == ("Record (no file)", "5 samples from 1 to 2 s, one every 250 ms.")
    assert seen.parts[0].content[1].description == "4 columns over 1 s."


@pytest.mark.parametrize(("n", "caption"), [(24, "Columns"), (25, "Columns (the first 24 of 25)")])
def test_a_long_list_of_columns_says_how_many_it_left_out(n, caption):
    assert MOST_ROWS == 24
    shown = table(up.Record(t=T, signals={f"c{i}": T + i for i in range(n)}))
    assert (shown.caption, len(shown.rows), shown.rows[-1][0]) == (caption, 24, "c23")


def drawn(figure):
    return {a.get_ylabel(): np.array(a.lines[0].get_data()) for a in figure.axes}


def test_a_record_draws_what_is_measured_and_what_drives_over_time():
    figure = RECORD.plot()
    panels = drawn(figure)
    assert list(panels) == ["theta [rad]", "V [V]"]
    np.testing.assert_array_equal(panels["theta [rad]"], (T, COLUMNS["theta"]))
    np.testing.assert_array_equal(panels["V [V]"], (T, COLUMNS["V"]))
    assert [a.get_xlabel() for a in figure.axes] == ["", "time [s]"]
    assert len({a.lines[0].get_color() for a in figure.axes}) == 2
    assert not any(a.yaxis.label.get_parse_math() for a in figure.axes)


def test_columns_that_are_asked_for_are_drawn_even_where_they_never_change():
    assert list(drawn(RECORD.plot("note", "turns"))) == ["note [?]", "turns [1]"]
    still = up.Record(t=T, signals={"a": np.ones(5), "b": np.zeros(5), "c": T}, units={"a": "m", "b": "m", "c": "m"})
    assert list(drawn(still.plot())) == ["c [m]"]  # nobody said a role: all that move
    many = up.Record(t=T, signals={f"c{i}": T + i for i in range(9)}, units={f"c{i}": "m" for i in range(9)})
    assert list(drawn(many.plot())) == [f"c{i} [m]" for i in range(MOST_PANELS)]
    assert MOST_PANELS == 6


def test_where_nothing_moves_the_first_column_is_drawn():
    still = up.Record(t=T, signals={"a": np.ones(5), "b": np.zeros(5)}, units={"a": "m", "b": "m"})
    assert list(drawn(still.plot())) == ["a [m]"]


def test_a_plant_lists_what_it_needs_and_what_is_not_zero():
    plant = up.Pendulum(m_p=0.25, l_cg=0.125, J_p=0.0, b_2=2e-3)
    rows = {row[0]: row[1:3] for row in table(plant).rows}
    assert rows["m_p"] == ("0.250000", "kg")
    assert rows["l_cg"] == ("0.125000", "m")
    assert rows["b_2"] == ("2.00000·10⁻³", "N m s/rad")
    assert "g" in rows
    assert "b_2c" not in rows  # zero, and nobody has to give it
    assert [table(plant).headings[i] for i in table(plant).numbers] == ["value"]
    said = summary(plant)
    assert said.title == "Pendulum"
    assert said.verdict == "Moves in theta [rad]; driven by T [N m]; equilibria: hanging, inverted."


@pytest.mark.parametrize(
    ("plant", "unit", "said"),
    [
        (up.Pendulum(m_p=0.25, l_cg=0.125, J_p=0.0), "V", "Pendulum behind a drive of 0.6500 N m/V."),
        (up.Pendulum(m_p=0.25, l_cg=0.125, J_p=0.0), "1", "Pendulum behind a drive of 0.6500 N m."),
        (up.CartPendulum(m_c=0.6, m_p=0.14, l_cg=0.19, J_p=6e-4), "A", "CartPendulum behind a drive of 0.6500 N/A."),
    ],
)
def test_a_drive_gives_the_plant_s_force_for_the_unit_of_its_command(plant, unit, said):
    rig = up.Rig.known(plant, gain=0.65, unit=unit)
    assert summary(rig).verdict.replace("\N{NO-BREAK SPACE}", " ") == said


CONTINUOUS = up.StateSpace([[0.0, 1.0], [-25.0, -6.0]], [0.0, 2.0], states=("x", "v"), inputs=("F",), point={"x": 0.5})


def test_a_linear_model_lists_its_matrices_state_by_state():
    """s^2 + 6 s + 25 = (s + 3)^2 + 4^2."""
    shown = table(CONTINUOUS)
    assert shown.headings == ("", "x", "v", "F")
    assert shown.rows == (("x'", "0", "1.0000", "0"), ("v'", "−25.000", "−6.0000", "2.0000"))
    assert (shown.caption, shown.numbers) == ("x' = A x + B u", (1, 2, 3))
    said = summary(CONTINUOUS)
    assert said.title == "Linear model about x = 0.5"
    assert said.verdict == "Poles [1/s]: −3.000 ± 4.000j."
    assert text(CONTINUOUS).startswith("Linear model about x = 0.5. Poles [1/s]: −3.000 ± 4.000j.")


def test_a_sampled_model_says_its_period_and_poles_of_z():
    sampled = up.StateSpace([[0.5, 0.0], [0.0, -0.25]], [1.0, 0.0], dt=0.02, states=("x", "v"), inputs=("F",))
    shown = table(sampled)
    assert [row[0] for row in shown.rows] == ["x[k+1]", "v[k+1]"]
    assert shown.caption == "x[k+1] = A x[k] + B u[k]"
    said = summary(sampled)
    assert said.title == "Linear model sampled every 20 ms"
    assert said.verdict.startswith("Poles [z]: ")
    assert set(said.verdict[len("Poles [z]: ") : -1].split(", ")) == {"0.5000", "−0.2500"}


def test_gains_stand_under_the_names_of_their_states():
    """For x'' = -25 x - 6 x' + 2 F and poles -5 +- 12 j: 169 = 25 + 2 k_x, 10 = 6 + 2 k_v."""
    gains = up.place(CONTINUOUS, [-5 + 12j, -5 - 12j])
    shown = table(gains)
    assert (shown.caption, shown.headings, shown.numbers) == ("u = -K x", ("K", "x", "v"), (1, 2))
    assert shown.rows == (("F", "72.0000", "2.00000"),)
    assert summary(gains).verdict == "Poles of the loop [1/s]: −5.000 ± 12.00j."
    assert summary(gains).detail == gains.sentence
    sampled = up.place(CONTINUOUS.to_sampled(0.02), [0.5, 0.25])
    assert "Poles of the loop [z]: " in summary(sampled).verdict


def marks(axes):
    return {line.get_label(): (line.get_marker(), line.get_color(), np.array(line.get_data())) for line in axes.lines
            if not str(line.get_label()).startswith("_")}  # fmt: skip


def shaded(axes):
    return [(p.get_x(), p.get_x() + p.get_width()) for p in axes.patches]


def test_poles_of_a_model_stand_in_their_plane():
    (axes,) = CONTINUOUS.plot().axes
    marker, _, (re, im) = marks(axes)["poles"]
    assert marker == "x"
    np.testing.assert_allclose(sorted(zip(re, im, strict=True)), [(-3, -4), (-3, 4)])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("real part [1/s]", "imaginary part [1/s]")
    assert not shaded(axes)  # nothing is unstable


def test_poles_of_a_plant_stand_there_once_for_each_equilibrium():
    """Without friction m g l/(J + m l^2) = w^2: +- j w hanging, +- w inverted."""
    plant = up.Pendulum(m_p=0.2, l_cg=0.25, J_p=2e-3, g=9.81)
    w = math.sqrt(0.2 * 9.81 * 0.25 / (2e-3 + 0.2 * 0.25**2))
    (axes,) = plant.plot().axes
    found = marks(axes)
    assert list(found) == ["about hanging", "about inverted"]
    assert [found[n][:2] for n in found] == [("x", BLUE), ("o", VERMILLION)]
    np.testing.assert_allclose(sorted(found["about hanging"][2][1]), [-w, w])
    np.testing.assert_allclose(sorted(found["about inverted"][2][0]), [-w, w])
    ((left, right),) = shaded(axes)
    assert left == 0.0
    assert right > w  # the unstable one stands on the shade


@pytest.mark.parametrize("value", [CONTINUOUS.to_sampled(0.02), up.place(CONTINUOUS.to_sampled(0.02), [0.5, 0.25])])
def test_poles_of_what_is_sampled_stand_in_the_circle_of_z(value):
    (axes,) = value.plot().axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("real part of z", "imaginary part of z")
    circle = np.array(axes.lines[0].get_data())
    np.testing.assert_allclose(np.hypot(*circle), 1.0)
    np.testing.assert_allclose(circle[:, 0], circle[:, -1], atol=1e-12)
    np.testing.assert_allclose([circle.min(axis=1), circle.max(axis=1)], [[-1, -1], [1, 1]], atol=1e-3)
    expected = np.exp(0.02 * (-3 + 4j)) if isinstance(value, up.StateSpace) else 0.5
    _, _, (re, im) = marks(axes)["poles"]
    assert np.abs(re + 1j * im - expected).min() < 1e-9
    assert not shaded(axes)


def test_what_has_no_view_is_named():
    with pytest.raises(TypeError, match="int has no view"):
        summary(3)
