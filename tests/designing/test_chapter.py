"""Does the page of a design say how much its loop stands, in units that can be checked, and what to try?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import upright as up
from upright.basis import MEASURED
from upright.designing.chapter import chapter
from upright.designing.run import DesignRequest, design_for
from upright.gains import Margins
from upright.report.page import Table
from upright.report.symbols import number
from upright.systems import StateSpace

ARM = up.Rig.known(
    up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4), gain="0.65 N m/V", limit="10 V", period="2 ms",
    counts=4096,
)  # fmt: skip
CART = up.Rig.known(
    up.CartPendulum(m_c=0.9, m_p=0.12, l_cg=0.2, J_p=1.5e-3), gain="2 N/V", limit="10 V", period="2 ms",
    counts=(20_000, 4096),
)  # fmt: skip
POLES = (-4.0, -5.0, -16.0, -3.0)
FINE = Margins(least_gain=0.2, most_gain=5.0, phase=0.7, delay=0.02, modulus=0.6)


@pytest.fixture(scope="module")
def done():
    """Of a rig whose numbers are trusted, so that the loop alone decides."""
    rig = replace(ARM, basis=MEASURED)
    return design_for(rig, DesignRequest(at="inverted", poles=POLES, period=2e-3, limit=10.0))


def with_margins(done, margins, **how):
    return replace(done, chosen=replace(done.chosen, margins=margins), **how)


def tables(told):
    return [block for part in told.parts for block in part.content if isinstance(block, Table)]


@pytest.mark.parametrize(
    ("changes", "chance", "words"),
    [
        ({}, None, ""),
        ({"modulus": 0.41, "least_gain": 0.69, "delay": 2.01e-3}, 0.991, ""),
        ({"modulus": 0.39}, None, "modulus margin is only 0.39"),
        ({"least_gain": 0.71}, None, "a gain 29 % weaker makes it unstable"),
        ({"delay": 1.9e-3}, None, "it bears only 1.9 ms more delay"),
        ({}, 0.98, "2 % of the rigs sampled from the fit's covariance are unstable with it"),
        ({"modulus": 0.3, "delay": 1e-3}, None, "modulus margin is only 0.30; it bears only 1 ms more delay"),
    ],
)
def test_a_loop_stands_with_margin_or_with_what_it_lacks(done, changes, chance, words):
    """Asked are 0.4 of distance, a third of gain, a period of delay and 99 % of the rigs."""
    told = with_margins(done, replace(FINE, **changes), chance=chance, peak_sampled=2.5)
    head = f"Stable, with reservations: {words}" if words else "Stable with margin"
    assert told._loop_verdict() == f"{head}; recovering from the default start takes 25 % of the drive's limit."
    page = chapter(told)
    assert page.sound == (not words)
    offered = any("--sampled" in step.command for step in page.steps)
    assert offered == ("modulus margin" in words)


def test_a_start_beyond_the_limit_saturates_and_its_share_that_does_not_is_told(done):
    told = with_margins(done, FINE, peak_sampled=25.0)._loop_verdict()
    assert "takes 25 V, 250 % of the limit, and saturates the drive; a start up to 40 % as far does not." in told
    assert with_margins(done, FINE, peak_sampled=10.0)._loop_verdict().endswith("takes 100 % of the drive's limit.")
    free = with_margins(done, FINE, request=replace(done.request, limit=None))
    assert free._loop_verdict() == "Stable with margin."
    assert any("so saturation is not predicted" in w for w in chapter(free).warnings)
    assert not any("saturates" in w for w in chapter(done).warnings)


def test_a_loop_that_falls_is_not_sound_and_is_not_taken_anywhere(done):
    falls = with_margins(done, None, peak_sampled=math.inf)
    page = chapter(falls)
    assert chapter(with_margins(done, FINE, peak_sampled=1.0)).sound
    assert page.verdict.startswith("The sampled loop falls: with a period of 2 ms, a delay of 1 sample and the ")
    assert not page.sound
    commands = [step.command for step in page.steps]
    assert any("--sampled" in c for c in commands)
    assert not any("upright export" in c for c in commands)
    assert any("upright export" in s.command for s in chapter(with_margins(done, FINE)).steps)
    assert "takes" not in page.parts[2].content[0]  # no peak of a loop that falls
    already = chapter(replace(falls, request=replace(falls.request, sampled=True)))
    assert not any("--sampled" in step.command for step in already.steps)


@pytest.mark.parametrize(("rig", "speeds", "units"), [
    (ARM, "rad/s, rad/s", ["V/rad", "V s/rad", "V/rad", "V s/rad"]),
    (CART, "m/s, rad/s", ["V/m", "V s/m", "V/rad", "V s/rad"]),
])  # fmt: skip
def test_gains_and_noise_stand_in_the_command_s_unit_for_each_state_s(rig, speeds, units):
    """u = -K x: a gain has the command's unit over its state's."""
    done = design_for(rig, DesignRequest(at="inverted", poles=POLES, period=2e-3, limit=10.0))
    gains, _, ways, *_ = tables(chapter(done))
    assert [row[-1] for row in gains.rows] == units
    assert [float(row[1].replace("−", "-")) for row in gains.rows] == pytest.approx(done.continuous[0], rel=1e-4)
    assert ways.headings[1:3] == (f"speed noise [{speeds}]", "command noise [V]")
    assert [row[0].endswith(" (chosen)") for row in ways.rows] == [w is done.chosen for w in done.ways]
    for row, way in zip(ways.rows, done.ways, strict=True):
        assert row[1] == ", ".join(number(v, 2) for v in way.speed_noise)
        assert float(row[-2]) == pytest.approx(1e3 * way.margins.delay, rel=5e-3)
        assert float(row[-3]) == pytest.approx(math.degrees(way.margins.phase), rel=5e-3)


@pytest.mark.parametrize(("unit", "per"), [("N", "V/N"), ("m/s^2", "V/(m/s²)"), ("N/m", "V/(N/m)"), ("1", "V")])
def test_a_state_of_any_unit_has_a_gain_per_that(unit, per):
    """Other units than lengths, angles and speeds come with matrices of one's own."""
    model = StateSpace(A=[[-1.0]], B=[[1.0]], C=[[1.0]], states=("x",), inputs=("u",), units={"x": unit, "u": "V"})
    told = chapter(design_for(model, DesignRequest(at="", poles=(-3.0,), period=1e-3, speed="")))
    assert tables(told)[0].rows[0][-1] == per


def test_who_says_how_late_a_command_acts_is_told(done):
    late = design_for(ARM.replace(delay="3 ms"), done.request)
    assert late.sampled.delay == pytest.approx(1.5)
    for design, words in (
        (late, "1.5 samples late (as the file says)"), (done, "1 sample late (assumed)"),
        (design_for(ARM, replace(done.request, delay=2.0)), "2 samples late (as requested)"),
    ):  # fmt: skip
        assert words in chapter(design).parts[2].content[0]
    plain = StateSpace(A=[[-1.0]], B=[[1.0]], C=[[1.0]])
    wish = DesignRequest(at="", poles=(-3.0,), period=1e-3, speed="")
    assert "(assumed)" in chapter(design_for(plain, wish)).parts[2].content[0]
    held = chapter(design_for(plain.to_sampled(1e-3), wish))
    assert "0 samples late (besides what the matrices hold)" in held.parts[2].content[0]


def test_a_way_by_which_the_loop_falls_says_so_instead_of_a_noise(done):
    """Of plain matrices no noise is known, and only the margins are missing."""
    fallen = replace(done.ways[0], margins=None, command_noise=None)
    held = replace(done.ways[1], margins=None)
    told = chapter(replace(done, ways=(fallen, held, *done.ways[2:])))
    rows = tables(told)[2].rows
    assert rows[0][2:] == ("falls", "–", "–", "–", "–")
    assert rows[1][2:] == (number(held.command_noise, 2), "–", "–", "–", "–")
    bare = replace(fallen, speed_noise=None)
    alone = chapter(replace(done, ways=(bare,), chosen=replace(done.chosen, speed_noise=None)))
    assert tables(alone)[2].rows == ((bare.name, "falls", "–", "–", "–"),)
    assert tables(alone)[2].numbers == (2, 3, 4)


def test_poles_of_sampled_matrices_are_those_whose_motion_outlasts_a_third_of_a_sample():
    """Of 5 ms: what dies faster than 3/0.005 = 600 1/s is counted and not written."""
    model = StateSpace(A=[[math.exp(-3.0 * 0.005), 0.1], [0.0, math.exp(-700 * 0.005)]], B=[[0.1], [0.2]],
                       C=[[1.0, 0.0]], dt=0.005)  # fmt: skip
    told = chapter(design_for(model, DesignRequest(at="", poles=(-5.0, -20.0), period=5e-3, speed="")))
    rows = {row[0]: row[1] for row in tables(told)[1].rows}
    assert rows["model, open loop"][1:] == "3, and 1 faster"  # behind its minus
    assert "faster" not in rows["requested"]
    fast = StateSpace(A=[[math.exp(-700 * 0.005)]], B=[[0.2]], C=[[1.0]], dt=0.005)
    told = chapter(design_for(fast, DesignRequest(at="", poles=(-5.0,), period=5e-3, speed="")))
    assert tables(told)[1].rows[0] == ("model, open loop", "1 faster")
    assert told.title == "Gains for plain matrices"  # which have no name


def test_the_file_of_a_double_integrator_s_design_holds_what_can_be_worked_out_by_hand():
    """u = -6 x - 5 v moves by -2 and -3 1/s; from x = 1 it begins with its peak, 6. A filtered difference of 2 ms
    keeps half of the last one, so that v = 250 (x - x_before) + v_before/2."""
    model = StateSpace(A=[[0.0, 1.0], [0.0, 0.0]], B=[[0.0], [1.0]], C=[[1.0, 0.0]], states=("x", "v"), outputs=("x",),
                       inputs=("a",))  # fmt: skip
    done = design_for(model, DesignRequest(at="", poles=(-2.0, -3.0), period=2e-3, limit=10.0, start=(1.0, 0.0)))
    told = chapter(done).numbers
    np.testing.assert_allclose(told["K"], [6.0, 5.0], rtol=1e-9)
    np.testing.assert_allclose(np.sort(told["poles"]["asked"].real), [-3, -2])
    np.testing.assert_allclose(np.sort(told["poles"]["attained"].real), [-3, -2], rtol=1e-9)
    np.testing.assert_allclose(told["poles"]["open_loop"], 0.0, atol=1e-9)
    assert told["worst_miss"] < 1e-9
    assert told["condition"] == pytest.approx(1.0)  # one input places two poles in one way
    assert told["peak_command"] == pytest.approx(6.0)
    assert told["peak_command_sampled"] == pytest.approx(6.0)
    assert (told["states"], told["command"], told["period"], told["limit"]) == (["x", "v"], "a", 2e-3, 10.0)
    assert (told["delay_samples"], told["lag"], told["converter"], told["effort_weight"]) == (1.0, 0.0, 0.0, None)
    assert told["readings"] == [{"name": "x", "unit": "1", "step": 0.0, "sign": 1.0}]
    law = told["law"]
    np.testing.assert_allclose(law["A"], [[0, 0], [-250, 0.5]])  # of x_before and v_before
    np.testing.assert_allclose(law["D"], [[-6 - 5 * 250, 0.0]], rtol=1e-9)
    np.testing.assert_allclose(law["C"], [[5 * 250, -5 * 0.5]], rtol=1e-9)
    without = chapter(replace(done, placement=None)).numbers
    assert (without["poles"]["asked"], without["poles"]["attained"]) == (None, None)
    assert (without["worst_miss"], without["condition"]) == (None, None)


def test_the_converter_of_the_drive_goes_into_the_file_and_none_where_nobody_named_one(done):
    assert chapter(done).numbers["converter"] == 0.0
    on = replace(ARM.replace(converter=0.005), basis=MEASURED)
    known = replace(done, request=replace(done.request, on=on))
    assert chapter(known).numbers["converter"] == 0.005


def test_a_rig_that_nobody_identified_is_led_to_a_fit_and_one_with_a_fit_is_not(done):
    proposed = [s.command for s in chapter(done).steps]
    assert any("upright identify STUDY.toml" in c for c in proposed)
    drawn = replace(done, rig=replace(done.rig, draws=((done.rig.plant, done.rig.gain),)))
    assert not any("upright identify STUDY.toml" in s.command for s in chapter(drawn).steps)


@pytest.mark.slow
@pytest.mark.parametrize("weights", [(), (1.0, 0.0, 30.0, 0.1)])
def test_the_way_of_the_poles_of_least_cost_passes_through_those_chosen(weights):
    """Its middle, the 150th of 300 weights a hundredfold either way, is the effort weight that was chosen."""
    done = design_for(ARM, DesignRequest(at="inverted", weights=weights, period=2e-3, limit=10.0))
    assert done.R is not None
    pictures = {b.name: b for part in chapter(done).parts for b in part.content if hasattr(b, "draw")}
    (plane,) = pictures["locus"].draw().panels
    drawn = [
        complex(*z) for line in plane.lines if not line.mark for z in zip(line.x, line.y, strict=True) if z[1] == z[1]
    ]
    for pole in done.wanted[done.wanted.imag >= 0]:
        assert min(abs(z - pole) for z in drawn) < 0.05 * abs(pole)
