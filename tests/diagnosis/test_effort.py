"""Is an effort that is none told from one that is, by numbers that are read off the columns?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.cases import case
from upright.diagnosis.case import Place
from upright.diagnosis.effort import (
    Push,
    examine_effort,
    examine_push,
    examine_settings,
    examine_uselessness,
    push_of,
    swift,
)
from upright.diagnosis.motion import SmoothedMotion
from upright.physics import find

T = np.arange(1000) * 0.01
SWING = np.exp(-0.1 * T) * np.sin(5 * T)
NOISE = np.random.default_rng(4).normal(size=T.size)


def about(kind, made):
    return [f for f in examine_effort(made) if f.kind == kind]


@pytest.mark.parametrize(
    ("share", "offset", "repeats"), [(2.0, 0.0, True), (-3.0, 5.0, True), (2.0, 0.05 * NOISE, False)]
)
def test_an_effort_that_repeats_a_position_is_told_with_its_factor(share, offset, repeats):
    found = about("effort", case(x=SWING, u=share * SWING + offset, measured=("x",), drive="u"))
    assert bool(found) == repeats
    for finding in found:
        assert finding.columns == ("u",)
        assert finding.severity == "fault"
        assert finding.evidence["factor [1]"] == pytest.approx(share)
        assert finding.sentence == f"'u' repeats the position 'x' (times {share:g}): no effort."


def test_rounding_of_the_position_still_shows_a_copy_and_eleven_levels_show_none():
    step = 0.02
    rounded = np.round(SWING / step) * step
    assert about("effort", case(x=rounded, u=2 * SWING, measured=("x",), drive="u"))
    few = np.round(5 * SWING) / 5  # eleven values at the most
    assert not about("effort", case(x=few, u=2 * few, measured=("x",), drive="u"))
    assert not about("effort", case(x=SWING, v=NOISE, measured=("v",), drive="x"))


def test_an_effort_that_never_changes_while_the_rig_moves_is_a_set_value():
    (finding,) = about("effort", case(x=SWING, u=np.full(T.size, 2.5), measured=("x",), drive="u"))
    assert finding.evidence == {"value [1]": 2.5}
    assert finding.key == "drive = 0"
    assert "'u' is 2.5 from the first to the last sample while the rig moves" in finding.sentence
    still = {"x": {"constant": True}}
    assert not about("effort", case(x=0 * T, u=np.full(T.size, 2.5), measured=("x",), drive="u", columns=still))
    assert not about("effort", case(x=SWING, u=0 * T, measured=("x",), drive="u"))


def cut(level=1.0, low=None):
    return np.clip(2.0 * np.sin(3 * T), -level if low is None else low, level)


def test_a_drive_cut_off_at_its_limit_is_told_with_the_limit_and_its_share():
    u = cut()
    drive = {"u": {"drive": True, "stepwise": False, "constant": False}}
    (finding,) = about("saturation", case(x=SWING, u=u, measured=("x",), drive="u", columns=drive))
    share = 100 * np.mean(np.abs(u) == 1)
    # stretches that the record cuts may be missing
    assert finding.evidence["share [%]"] == pytest.approx(share, rel=0.1)
    assert finding.evidence["limit [V]"] == 1.0
    assert finding.key == "[actuator]\nlimit = 1"
    assert "is cut off at -1 and 1 V for" in finding.sentence
    assert finding.severity == "warning"
    # of another limit to either side the larger one is the drive's
    (finding,) = about("saturation", case(x=SWING, u=cut(1.0, -0.9), measured=("x",), drive="u", columns=drive))
    assert finding.evidence["limit [V]"] == 1.0
    (finding,) = about("saturation", case(x=SWING, u=-cut(1.0, -0.3), measured=("x",), drive="u", columns=drive))
    assert "is cut off at -1 V" in finding.sentence  # at a third of it, it only paused
    for said in ({"drive": False}, {"constant": True}, {"stepwise": True}):
        other = {"u": drive["u"] | said}
        assert not about("saturation", case(x=SWING, u=u, measured=("x",), drive="u", columns=other))
    named = case(x=SWING, u_ref=u, measured=("x",), drive="u_ref", columns={"u_ref": drive["u"]})
    assert not about("saturation", named)  # what was asked for is not the drive


@pytest.mark.parametrize(("peaks", "severity"), [(1, "note"), (4, "note"), (7, "warning")])
def test_up_to_half_a_percent_of_the_samples_at_the_limit_are_a_note(peaks, severity):
    """Each peak stays there for 4 of 4000 samples."""
    t = np.arange(4000) * 0.01
    u = np.sin(3 * t)
    for at in 1000 + 400 * np.arange(peaks):
        u[at : at + 11] = np.linspace(u[at], 3.0, 11)
        u[at + 10 : at + 14], u[at + 14 : at + 20] = 3.0, np.linspace(2.5, u[at + 20], 6)
    drive = {"u": {"drive": True, "stepwise": False, "constant": False}}
    (finding,) = about("saturation", case(x=np.sin(t), u=u, measured=("x",), drive="u", columns=drive))
    assert finding.severity == severity
    assert finding.evidence["share [%]"] == pytest.approx(0.1 * peaks)


def begun(motion, command, size=1.0):
    """Rest, then a swing from one time on, a command from another."""
    x = np.where(motion <= T, size * np.sin(5 * (T - motion)), 0.0)
    return case(x=x, u=np.where(command <= T, 1.0 + 0.1 * T, 0.0), measured=("x",), drive="u")


def test_motion_before_the_first_command_is_told_by_both_instants():
    (finding,) = about("early", begun(2.0, 3.0))
    # 3 % of the range of 2 is passed after asin(0.06)/5 s, in the second sample of the motion
    assert finding.evidence["motion [s]"] == pytest.approx(2.02)
    assert finding.evidence["command [s]"] == pytest.approx(3.0)
    assert finding.columns == ("x", "u")
    assert finding.marks == pytest.approx((2.02, 3.0))
    assert finding.key == 'window = [3, "end"]'
    assert "'x' moves at 2.02 s, 0.98 s before the first command of 'u' at 3 s" in finding.sentence


@pytest.mark.parametrize(
    "made",
    [
        begun(3.0, 2.0),  # as it should be
        begun(2.0, 2.03),  # within three periods of what 3 % take
        begun(0.02, 3.0),  # it never lay still
        begun(2.0, 0.0),  # it acts from the start
        begun(2.0, 0.09),  # a tenth of a second is needed to see rest
    ],
)
def test_a_command_that_comes_first_or_at_once_is_not_late(made):
    assert about("early", made) == []


@pytest.mark.parametrize(
    ("dt", "ahead", "told"), [(2e-3, 0.018, False), (2e-3, 0.022, True), (0.01, 0.02, False), (0.01, 0.04, True)]
)
def test_motion_is_early_by_a_fiftieth_of_a_second_or_three_samples(dt, ahead, told):
    """Seen a sample after a step begins: what a clock or a rounded stamp may be late by is no fault."""
    t = np.arange(1500) * dt
    at = 500
    x = np.where(np.arange(1500) >= at, 1.0, 0.0)
    u = np.where(t >= t[at] + ahead - 1e-9, 1.0, 0.0)
    assert (about("early", case(dt, x=x, u=u, measured=("x",), drive="u")) != []) == told


def test_the_first_of_several_bodies_is_named():
    made = case(
        a=np.where(T >= 2.5, np.sin(5 * (T - 2.5)), 0.0), b=np.where(T >= 2, np.sin(5 * (T - 2)), 0.0),
        c=np.where(T >= 1, 0.001 * np.sin(5 * (T - 1)), 0.0), u=np.where(T >= 4, 1.0, 0.0), measured=("a", "b", "c"),
        drive="u",
    )  # fmt: skip
    (finding,) = about("early", replace(made, plant=find("rectilinear-3")))  # c was held
    assert finding.columns[0] == "b"


@pytest.mark.parametrize(
    ("lie", "kind", "severity", "sentence", "key"),
    [
        ("the reference, not the effort", "effort", "warning", "'v' is the reference, not the effort.",
         'loop = { reference = "`v`" }'),
        ("the command in DAC counts", "effort", "note", "'v' is the command in DAC counts.",
         '[drive]\ncolumn = "v"\nunit = "V"\nscale = 0.001221'),
        ("follows 'x' after 20 ms", "effort", "warning", "'v': follows 'x' after 20 ms.", ""),
        ("the first samples are outliers", "spike", "warning", "'v': the first samples are outliers.",
         'window = [0.03, "end"]'),
    ],
)  # fmt: skip
def test_a_column_that_is_not_what_its_name_says_is_told_once(lie, kind, severity, sentence, key):
    made = case(x=SWING, v=NOISE, measured=("x",), columns={"v": {"remarks": (lie, lie), "drive": False}})
    (finding,) = [f for f in examine_effort(made) if f.columns == ("v",)]
    assert (finding.kind, finding.severity, finding.sentence, finding.key) == (kind, severity, sentence, key)
    assert finding.evidence == pytest.approx({"lowest [1]": NOISE.min(), "highest [1]": NOISE.max()})


def settings(text, size=2.0):
    u = 819.2 * size * np.where((T > 1) & (T < 4), 1.0, 0.0)
    return list(examine_settings(case(
        x=SWING, dac=u, measured=("x",), notes=(f"runParameters: {text}",),
        columns={"dac": {"remarks": ("the command in DAC counts",)}},
    )))  # fmt: skip


def test_settings_are_held_to_what_ran():
    ran = 819.2 * 2 / 819  # ECP: 16 bits of 40 V, as its manual rounds them
    (shifted,) = settings(f"Amplitude = 3, Reps = {ran:.3f}")
    assert "The fields of runParameters are shifted" in shifted.sentence
    assert "'Amplitude' the repetitions (3)" in shifted.sentence
    assert shifted.evidence == pytest.approx(
        {"stored amplitude [V]": 3.0, "stored repetitions [1]": ran, "ran [V]": ran}, abs=1e-3
    )
    (wrong,) = settings("Amplitude = 1.5, Reps = 1")
    assert wrong.sentence == f"runParameters says 1.5 V, but 'dac' ran {ran:.3g} V."
    assert settings(f"Amplitude = {ran:.3f}, Reps = 1") == []
    assert settings("Amplitude = 3") == []
    (negative,) = settings("Amplitude = 1.5, Reps = 1", size=-2.0)
    assert negative.evidence["ran [V]"] == pytest.approx(-ran, abs=1e-3)
    assert settings("Amplitude = 1.5, Reps = 1", size=0.0) == []


def driven_body(end=None, gain=2.0):
    """Smoothed motion of a mass of 1/gain with viscous friction under a command, which acts until `end`."""
    t = np.arange(0, 10, 0.01)
    u = np.sin(2.1 * t) + 0.6 * np.sin(5.3 * t)
    acting = u if end is None else np.where(t < end, u, 0.0)
    x = v = 0.0
    q, speed, a = np.zeros(t.size), np.zeros(t.size), np.zeros(t.size)
    for k in range(t.size):
        now = gain * acting[k] - 0.5 * v
        q[k], speed[k], a[k] = x, v, now
        x, v = x + 0.01 * v, v + 0.01 * now
    plant = find("rectilinear-1")
    return SmoothedMotion(
        plant=plant, t=t, q=q[None], v=speed[None], a=a[None], u=u, fades=np.array([1e-3]), rows=(0,),
        samples=np.arange(t.size), dt=0.01, command=u, weights=np.ones(1),
    )  # fmt: skip


def test_the_end_of_an_effort_is_found_where_it_ceased_to_act():
    push = push_of(driven_body(end=6.0), None)
    assert push.end == pytest.approx(6.0, abs=0.05)
    assert push.cut < 1e-3
    assert push.full > 0.1
    assert push.without > push.full
    assert push.after == pytest.approx(0.0, abs=0.05)
    motion = driven_body(end=6.0)
    moving = np.abs(motion.v[0]) > 0.1 * np.abs(motion.v[0]).max()
    power = np.sum(motion.u[moving & (motion.t >= 6)] ** 2) / np.sum(motion.u[swift(motion, 0)] ** 2)
    assert push.late == pytest.approx(power, rel=0.05)


def test_an_effort_that_acts_throughout_is_explained_whole():
    push = push_of(driven_body(), None)
    assert push.full < 1e-3
    assert push.without > 0.5
    assert push_of(replace(driven_body(), u=np.zeros(1000)), None) is None
    assert push_of(replace(driven_body(), rows=()), None) is None


def test_a_body_is_swift_beyond_a_twentieth_of_its_fastest():
    motion = driven_body()
    v = np.zeros((1, 1000))
    v[0, :4] = 1.0, -0.051, 0.049, 0.06
    assert swift(replace(motion, v=v), 0)[:5].tolist() == [True, True, False, True, False]


def pushed(**how):
    t = np.arange(0, 10, 0.01)
    given = {"without": 0.9, "full": 0.5, "cut": 0.02, "end": 6.0, "after": 0.1, "late": 0.3}
    return Push(**(given | how), rest=np.sin(t), t=t, u=np.cos(t))


def with_drive():
    made = case(x=SWING, u=np.where(T < 8, np.cos(T) + 2, 0.0), measured=("x",), drive="u")
    return replace(made, places={"x_1": Place(column="x", y=SWING, resolution=0.0, unit="m")})


@pytest.mark.parametrize(
    ("how", "tripped"),
    [
        ({}, True),
        ({"cut": 0.14}, True), ({"cut": 0.16}, False),  # less than `most`
        ({"full": 0.11, "cut": 0.04}, True), ({"full": 0.11, "cut": 0.056}, False),  # half of what all of it leaves
        ({"full": 0.1}, False),  # 0.7 of `most`
        ({"without": 0.03}, False), ({"without": 0.05}, True),
        ({"after": 0.46}, False), ({"after": -0.46}, False), ({"after": 0.44}, True),
        ({"late": 0.04}, False), ({"late": 0.05}, True),
        ({"end": 0.4}, False), ({"end": 0.6}, True),  # a twentieth of the time of a strong effort
    ],
)  # fmt: skip
def test_a_trip_leaves_little_before_it_and_much_with_all_of_the_effort(how, tripped):
    found = examine_push(with_drive(), pushed(**how), most=0.15)
    assert bool(found) == tripped
    for finding in found:
        push = pushed(**how)
        assert finding.evidence == pytest.approx({
            "end [s]": push.end, "logged end [s]": 7.99, "unexplained with all [%]": 100 * push.full,
            "unexplained with the first part [%]": 100 * push.cut,
        })  # fmt: skip
        assert finding.marks == (push.end,)
        assert f"({100 * push.full:.0f} % of its force is unexplained with all of the effort" in finding.sentence
        assert "'u' is logged until 7.99 s" in finding.sentence


@pytest.mark.parametrize(
    ("without", "full", "useless"),
    [(0.8, 0.78, True), (0.8, 0.75, False), (0.31, 0.31, True), (0.29, 0.29, False), (0.3, 0.3, True)],
)
def test_an_effort_that_explains_a_twentieth_of_much_is_useless(without, full, useless):
    found = list(examine_uselessness(with_drive(), pushed(without=without, full=full)))
    assert bool(found) == useless
    for finding in found:
        explains = 100 * (1 - full / without)
        assert finding.evidence == pytest.approx(
            {"left to explain [%]": 100 * without, "explained by it [%]": explains}
        )
        assert f"leave {100 * without:.0f} % of the driven body's force" in finding.sentence
        needed, effort = finding.panels[-1].curves
        push = pushed()
        assert np.abs(needed.y).max() == pytest.approx(1.0)
        assert needed.y == pytest.approx(push.rest / np.abs(push.rest).max())
        assert effort.y == pytest.approx(push.u)
        assert (needed.name, effort.name) == ("needed", "'u'")
