"""Do tables and sentences of experiment 3 say the figures of its runs, in the units that they name?"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.experiments.tracking_3.closed_form import (
    FAR,
    PD,
    RIG,
    SET_1,
    SET_4,
    SIZE,
    STIFF,
    SUM,
    outcome,
    ran,
    tracking,
)
from upright.basis import MEASURED
from upright.experiments.tracking_3 import tables
from upright.experiments.tracking_3.chapter import chapter
from upright.experiments.tracking_3.laws import AT
from upright.rig.makes import make_rig

LAWS = (SET_1, SET_4, SUM, PD, STIFF, FAR)


TRUSTED = replace(RIG, basis=MEASURED)


def whole(**measured):
    """Every law tried, with the same figures but for those of the laws named by their place."""
    return tracking(
        outcome(SET_1, ran(), ran(**measured.get("first", {}))), outcome(SET_4, ran(), ran(**measured.get("last", {}))),
        summed=outcome(SUM, ran(), ran(error=0.001 * SIZE, give=0.002, **measured.get("summed", {}))),
        pd=outcome(PD, ran(), ran(share=0.31, give=0.4 * SIZE, arrival=0.9876, **measured.get("pd", {}))),
        stiff=outcome(STIFF, ran(), ran(settling_5=1.8765, **measured.get("stiff", {}))),
        far=outcome(FAR, ran(), ran(**({"tripped": 0.4} | measured.get("far", {})))), model=TRUSTED,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(0.1234, 1, "12.3 %"), (-0.002, 1, "−0.2 %"), (-1e-9, 1, "0.0 %"), (1.0, 0, "100 %"), (math.inf, 1, "–"),
     (0.12345, 2, "12.35 %")],
)  # fmt: skip
def test_a_share_is_a_percentage_and_what_never_was_is_a_dash(value, digits, text):
    assert tables.percentage(value, digits) == text


def test_lengths_are_in_the_unit_in_which_they_are_read():
    assert tables.length(tracking(), math.radians(12.34)) == "12.3 deg"
    carts = tracking(rig=make_rig("rectilinear"))
    assert tables.length(carts, 0.01234, 2) == "12 mm"
    assert (tables.milli(0.12345), tables.milli(math.inf)) == ("0.123", "never")


def test_gains_stand_with_what_they_make_of_the_loop():
    table = tables.gain_table(whole())
    assert [row[0] for row in table.rows] == [law.name for law in LAWS]
    for row, law in zip(table.rows, LAWS, strict=True):
        cells = [float(cell.replace("−", "-")) for cell in row[1:]]
        assert cells[:4] == pytest.approx(law.K[:4], rel=1e-3)
        assert cells[4] == pytest.approx(law.k_pf, rel=1e-3)
        assert cells[5] == pytest.approx(0.65 * law.k_pf, rel=1e-3)  # newton metres per radian: 0.65 N m/V
        assert cells[6] == pytest.approx(-law.poles.real.max(), rel=1e-2)
        assert cells[7] == pytest.approx(min(-law.poles.real / abs(law.poles)), rel=1e-1)
    assert table.headings == ("law", "K θ₁", "K θ̇₁", "K θ₂", "K θ̇₂", "k_pf", "static force", "decay", "damping") or all(
        heading.startswith("K ") for heading in table.headings[1:5]
    )
    assert table.numbers == tuple(range(1, 9))
    assert "[V/rad]" in table.caption
    assert "[N m/rad]" in table.caption
    assert "[N/m]" in tables.gain_table(tracking(rig=make_rig("rectilinear"))).caption


def test_poles_asked_stand_beside_those_of_the_loop_as_it_runs():
    rows = tables.shaft_pole_table(whole()).rows
    assert [row[0] for row in rows] == ["open loop", *(law.name for law in LAWS)]
    for row, law in zip(rows[1:], LAWS, strict=True):
        assert (row[1] == "–") == (law.requested.size == 0)
    assert "7.533" in rows[1][1]  # set 1 of Table 2: -7.533 +- 27.28j
    assert "27.28" in rows[1][1]


def test_a_step_is_told_twice_as_predicted_and_as_measured():
    table = tables.step_table(whole(last={"rise": 0.1999, "saturated": 0.0456}, first={"moved": False}))
    assert len(table.rows) == 12
    cells = ("0.101", "3.0 %", "0.202", "0.350", "0.404", "0.607", "7.89", "78.9 %", "0.00 %")
    by_law = {law.name: table.rows[2 * i : 2 * i + 2] for i, law in enumerate(LAWS)}
    for name, (predicted, measured) in by_law.items():
        assert (predicted[0], measured[0]) == (name, "")
        assert predicted[1] == "predicted"
        assert predicted[2:] == cells
        assert measured[1] == "measured"
    assert by_law["set 4"][1][2:] == ("0.200", *cells[1:8], "4.56 %")
    assert by_law["set 1"][1][2:8] == ("does not move", *("–",) * 5)
    assert by_law["far"][1][2:8] == ("trips at 0.40 s", *("–",) * 5)
    assert len(table.headings) == len(table.rows[0])
    assert table.numbers == tuple(range(2, 11))
    assert "14.3 deg" in table.caption  # 0.25 rad


def test_without_a_rig_only_what_is_predicted_stands_in_the_tables():
    alone = tracking(outcome(SET_1), outcome(SET_4))
    assert [row[:2] for row in tables.step_table(alone).rows] == [("set 1", "predicted"), ("set 4", "predicted")]
    table = tables.friction_table(alone)
    assert table.headings == ("law", "error, at most", "predicted", "push, no friction", "predicted")
    assert [len(row) for row in table.rows] == [5, 5]


def test_what_friction_leaves_stands_beside_its_bound_and_the_push_beside_its_value_without_friction():
    """Play over step; a tenth of 10 V over k_pf over step; error and give of the runs over step."""
    table = tables.friction_table(whole(first={"settling_2": math.inf}))
    rows = {row[0]: row[1:] for row in table.rows}
    assert set(rows) == {law.name for law in LAWS} - {"far"}  # which trips and has no rest
    share = SET_4.play / SIZE
    assert rows["set 4"][0] == f"{100 * share:.1f} %"
    assert rows["set 4"][1:3] == ("2.0 %", "2.0 %")
    assert rows["set 4"][3] == f"{100 * 0.1 * 10 / SET_4.k_pf / SIZE:.1f} %"
    assert rows["set 4"][4:] == ("20.0 %", "20.0 %")
    assert rows["set 1"][1:3] == ("2.0 %", "still swings")
    assert rows["with a sum"] == ("0 (sum)", "2.0 %", "0.1 %", "0 (sum)", "20.0 %", "0.8 %")
    assert table.numbers == tuple(range(1, 7))
    assert "(1.0 V)" in table.caption


def test_the_verdict_says_effort_arrival_push_and_what_pd_does():
    told = chapter(whole())
    assert told.verdict == (
        "A step of 14.3 deg is followed by all 2 sets of poles within effort, travel and twist; set 4 takes 79 % of "
        "the drive's limit and arrives in 0.607 s. A tuned PD of the near encoder arrives in 0.988 s, with 31 % of the "
        "limit, but a push of the drive moves it by 40 % of the step, set 4 by 20 %; made as stiff, the PD swings for "
        "1.9 s."
    )
    assert told.sound
    assert told.detail.startswith("Tried on the rig.")


@pytest.mark.parametrize(
    ("measured", "said"),
    [
        ({"first": {"tripped": 0.456}}, "is too much for set 1 (leaves travel or twist after 0.46 s); set 4"),
        (
            {"last": {"saturated": 0.0123}},
            "is too much for set 4 (at the drive's limit in 1.2 % of the samples); set 4",
        ),
        ({"last": {"arrival": math.inf}}, "and never comes to stay within 5 %."),
        ({"stiff": {"moved": False}}, "made as stiff, the PD does not settle."),
        ({"pd": {"moved": False}}, "arrives in 0.607 s."),
        ({"last": {"moved": False}}, "within effort, travel and twist."),
    ],
)
def test_the_verdict_says_what_went_wrong(measured, said):
    assert said in chapter(whole(**measured)).verdict


@pytest.mark.parametrize(
    ("measured", "sound"),
    [({}, True), ({"first": {"settling_5": math.inf}}, False), ({"first": {"moved": False}}, False),
     ({"last": {"saturated": 0.01}}, False), ({"first": {"tripped": 1.0}}, False),
     ({"pd": {"moved": False}, "stiff": {"moved": False}}, True)],
)  # fmt: skip
def test_the_verdict_can_be_built_on_where_every_set_settles_within_the_limits(measured, sound):
    assert chapter(whole(**measured)).sound == sound


def test_a_single_set_is_called_by_its_name_and_what_was_not_tried_is_said():
    one = chapter(tracking(outcome(SET_4)))
    assert "is followed by set 4 within" in one.verdict
    assert one.detail == "Predicted with the fitted numbers; no rig was touched."
    assert [part.title for part in one.parts] == ["Gains", "Closed loop"]
    some = chapter(tracking(outcome(SET_1), outcome(SET_4, ran(), ran()), interrupted=True))
    assert some.detail == (
        "Tried on the rig, but for what is predicted to leave the bounds: set 1. It was interrupted; what was finished "
        "is reported."
    )


def test_every_part_has_its_turn_and_says_its_numbers():
    told = chapter(whole())
    assert [part.title for part in told.parts] == ["Gains", "Closed loop", "What friction leaves", "Why state feedback"]
    text = {part.title: " ".join(b for b in part.content if isinstance(b, str)) for part in told.parts}
    assert (
        "The step is 14.3 deg, bounded by effort; what each bound allows: 95 % of the drive's limit 14.4 deg, "
        "60 % of the twist that trips the shaft 17.2 deg."
    ) in text["Gains"]
    assert "set 1 79 %, set 4 79 %" in text["Closed loop"]
    assert "Predicted for set 4: 7.89 V (78.9 %); found the same." in text["Closed loop"]
    assert "it leaves 0.1 % of the step" in text["What friction leaves"]
    why = text["Why state feedback"]
    p = RIG.plant.parameters()
    bound, least = 0.5 * math.sqrt(p["k_12"] / p["J_1"]), p["k_12"] * p["J_1"] / p["J_2"]
    for words in (
        f"half the root of k/inertia 1, {bound:.2f} 1/s here", f"(inertia 1)/(inertia 2), {least:.2f} N m/rad",
        f"where set 4 has {SET_4.stiffness:.1f}", "at 31 % of the limit", "the best of 0 pairs",
        f"decays with {STIFF.decay:.1f} 1/s at a damping ratio of {STIFF.damping:.2g}",
        f"against {SET_4.decay:.2f} 1/s and {SET_4.damping:.2f}.",
        "trips the rig 0.3 s after the step",
    ):  # fmt: skip
        assert words in why
    assert "does not trip the rig" in str(chapter(whole(far={"tripped": math.inf})).parts[-1].content)
    other = chapter(whole(last={"peak": 7.9}))
    assert "found 7.9 V." in " ".join(b for b in other.parts[1].content if isinstance(b, str))


def test_what_was_predicted_to_trip_is_not_said_to_have_been_tried():
    done = whole()
    done = replace(done, far=outcome(FAR, ran(tripped=0.35)))
    why = " ".join(b for b in chapter(done).parts[-1].content if isinstance(b, str))
    assert "was not tried; it is predicted that it trips the rig 0.25 s after the step" in why
    compared = next(b for b in chapter(done).parts[-1].content if getattr(b, "name", "") == "track-compared")
    assert compared.caption.endswith("Predicted, not tried: far.")


def test_numbers_are_those_of_the_runs_in_si_units():
    told = chapter(whole(last={"saturated": 0.25})).numbers
    assert (told["step"], told["limit"], told["step_reason"]) == (SIZE, 10.0, "bounded by effort")
    law = told["laws"]["set 4"]
    assert law["k_pf"] == SET_4.k_pf
    assert law["static_force_per_error"] == SET_4.stiffness
    assert law["error_at_most"] == SET_4.play
    np.testing.assert_array_equal(law["K"], SET_4.K)
    assert law["found"] == {
        "change": 0.24, "rise": 0.1011, "peak_time": 0.2022, "overshoot": 0.0303, "settling_2": 0.4044,
        "settling_5": 0.3505, "arrival": 0.6067, "error": 0.02 * SIZE, "effort_peak": 7.89, "effort_share": 0.789,
        "saturated": 0.25, "rest": {"quiet": True, "rms": 0.02, "peak": 0.04},
        "twist": 0.11, "travel": 0.22, "give": 0.05, "tripped": math.inf,
    }  # fmt: skip
    assert (law["within_limits"], told["laws"]["set 1"]["within_limits"]) == (False, True)
    assert told["laws"]["far"]["found"]["rise"] is None
    assert chapter(tracking(outcome(SET_1))).numbers["laws"]["set 1"]["found"] is None


def test_the_cover_has_arrival_overshoot_and_effort_of_the_strongest_set():
    found = {k.what: k.value for k in chapter(whole()).findings}
    assert found == {
        "set 4: arrival within 5 % [s]": "0.607", "set 4: overshoot": "3.0 %", "set 4: effort, of the limit": "78.9 %",
    }  # fmt: skip
    assert list({k.what for k in chapter(whole(last={"moved": False})).findings}) == ["set 4: effort, of the limit"]


def test_poles_of_one_s_own_are_the_next_step_of_a_fit():
    (step,) = chapter(tracking(outcome(SET_1), folder=Path("fits/fit.json"))).steps
    assert step.command == 'upright track fits/fit.json --poles "-10+-20j, -25+-10j"'


def test_pictures_of_the_reasons_are_of_the_fitted_model():
    """Zeros of PD at -kp/kd and, at the near encoder, at the far disk on its spring."""
    told = chapter(whole())
    pictures = {b.name: b for part in told.parts for b in part.content if hasattr(b, "draw")}
    assert set(pictures) == {"track-poles", "track-steps", "track-compared", "track-bargain", "track-loci"}
    (near, far) = pictures["track-loci"].draw().axes
    swing = math.sqrt(RIG.plant.k_12 / RIG.plant.J_2)
    for ax, zeros in ((near, [(-20.0, 0.0), (0.0, swing)]), (far, [(-20.0, 0.0)])):  # kp/kd = 8/0.4
        (drawn,) = [line for line in ax.get_lines() if line.get_label() == "zero"]
        np.testing.assert_allclose(sorted(drawn.get_xydata().tolist()), sorted(zeros), atol=1e-9)
        (marked,) = [line for line in ax.get_lines() if line.get_label() == "kp of the tuned PD"]
        K = np.array([[8.0, 0.4, 0, 0]]) if ax is near else np.array([[0, 0, 8.0, 0.4]])
        model = RIG.linear(AT)
        poles = np.linalg.eigvals(model.A - model.B @ K)
        poles = np.sort_complex(poles[poles.imag > -1e-9])
        np.testing.assert_allclose(np.sort_complex(marked.get_xdata() + 1j * marked.get_ydata()), poles, rtol=1e-6)
    (bargain,) = pictures["track-bargain"].draw().axes
    curve = next(line for line in bargain.get_lines() if line.get_label().startswith("PD, near"))
    np.testing.assert_allclose(curve.get_xdata()[[0, -1]], 0.65 * np.array([0.2 * 8.0, 2.5 * SET_4.k_pf]))
    ends = {line.get_label(): line.get_xydata().tolist() for line in bargain.get_lines() if len(line.get_xdata()) == 1}
    for law in (SET_1, SET_4, PD, STIFF):
        assert ends[law.name] == [[law.stiffness, max(law.decay, 0.0)]]
    assert bargain.get_xlabel() == "static force per error [N m/rad]"


def test_a_set_that_bangs_at_rest_is_named_and_not_sound():
    """A tenth of the limit is quiet; three tenths are the largest disturbance of their own rig."""
    busy = whole(last={"rms": 0.3})
    told = chapter(busy)
    assert "At rest the effort is excessive: the command's rms is 30 % of the limit with set 4 (10 % is quiet)." in (
        told.verdict
    )
    assert not told.sound
    assert chapter(whole(last={"rms": 0.1})).sound
    assert "excessive" not in chapter(whole(last={"rms": 0.1})).verdict
