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
from tests.report.rendering import Rendered
from upright.basis import MEASURED
from upright.experiments.tracking_3.chapter import chapter, length, milli, percentage
from upright.experiments.tracking_3.laws import AT
from upright.experiments.tracking_3.run import run_tracking
from upright.report.html import WORDS_OF_A_VERDICT
from upright.report.page import Table
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


def table(result, caption):
    """The table of the chapter whose caption begins so."""
    blocks = [b for part in chapter(result).parts for b in part.content]
    (found,) = [b for b in blocks if isinstance(b, Table) and b.caption.startswith(caption)]
    return found


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(0.1234, 1, "12.3 %"), (-0.002, 1, "−0.2 %"), (-1e-9, 1, "0.0 %"), (1.0, 0, "100 %"), (math.inf, 1, "–"),
     (0.12345, 2, "12.35 %")],
)  # fmt: skip
def test_a_share_is_a_percentage_and_what_never_was_is_a_dash(value, digits, text):
    assert percentage(value, digits) == text


def test_lengths_are_in_the_unit_in_which_they_are_read():
    assert length(tracking(), math.radians(12.34)) == "12.3 deg"
    carts = tracking(rig=make_rig("rectilinear"))
    assert length(carts, 0.01234, 2) == "12 mm"
    assert (milli(0.12345), milli(math.inf)) == ("0.123", "never")


def test_gains_stand_with_what_they_make_of_the_loop():
    gains = table(whole(), "Gains of")
    assert [row[0] for row in gains.rows] == [law.name for law in LAWS]
    for row, law in zip(gains.rows, LAWS, strict=True):
        cells = [float(cell.replace("−", "-")) for cell in row[1:]]
        assert cells[:4] == pytest.approx(law.K[:4], rel=1e-3)
        assert cells[4] == pytest.approx(law.k_pf, rel=1e-3)
        assert cells[5] == pytest.approx(0.65 * law.k_pf, rel=1e-3)  # newton metres per radian: 0.65 N m/V
        assert cells[6] == pytest.approx(-law.poles.real.max(), rel=1e-2)
        assert cells[7] == pytest.approx(min(-law.poles.real / abs(law.poles)), rel=1e-1)
    assert gains.headings[5:] == ("k_pf", "static force", "decay", "damping")
    assert all(heading.startswith("K θ") for heading in gains.headings[1:5])
    assert gains.numbers == tuple(range(1, 9))
    assert "[V/rad]" in gains.caption
    assert "[N m/rad]" in gains.caption
    assert "[N/m]" in table(tracking(outcome(SET_4), rig=make_rig("rectilinear")), "Gains of").caption


def test_poles_asked_stand_beside_those_of_the_loop_as_it_runs():
    rows = table(whole(), "Poles [1/s]").rows
    assert [row[0] for row in rows] == ["open loop", *(law.name for law in LAWS)]
    for row, law in zip(rows[1:], LAWS, strict=True):
        assert (row[1] == "–") == (law.requested.size == 0)
    assert "7.533" in rows[1][1]  # set 1 of Table 2: -7.533 +- 27.28j
    assert "27.28" in rows[1][1]


def test_a_step_is_told_twice_as_predicted_and_as_measured():
    steps = table(whole(last={"rise": 0.1999, "saturated": 0.0456}, first={"moved": False}), "A step of")
    assert len(steps.rows) == 12
    cells = ("0.101", "3.0 %", "0.202", "0.350", "0.404", "0.607", "7.89", "78.9 %", "0.00 %")
    by_law = {law.name: steps.rows[2 * i : 2 * i + 2] for i, law in enumerate(LAWS)}
    for name, (predicted, measured) in by_law.items():
        assert (predicted[0], measured[0]) == (name, "")
        assert predicted[1] == "predicted"
        assert predicted[2:] == cells
        assert measured[1] == "measured"
    assert by_law["set 4"][1][2:] == ("0.200", *cells[1:8], "4.56 %")
    assert by_law["set 1"][1][2:8] == ("does not move", *("–",) * 5)
    assert by_law["far"][1][2:8] == ("trips at 0.40 s", *("–",) * 5)
    assert len(steps.headings) == len(steps.rows[0])
    assert steps.numbers == tuple(range(2, 11))
    assert "14.3 deg" in steps.caption  # 0.25 rad


def test_without_a_rig_only_what_is_predicted_stands_in_the_tables():
    alone = tracking(outcome(SET_1), outcome(SET_4))
    assert [row[:2] for row in table(alone, "A step of").rows] == [("set 1", "predicted"), ("set 4", "predicted")]
    friction = table(replace(alone, pd=outcome(PD)), "Error at rest")
    assert friction.headings == ("law", "error, at most", "predicted", "push, no friction", "predicted")
    assert [len(row) for row in friction.rows] == [5, 5, 5]


def test_what_friction_leaves_stands_beside_its_bound_and_the_push_beside_its_value_without_friction():
    """Play over step; a tenth of 10 V over k_pf over step; error and give of the runs over step."""
    friction = table(whole(first={"settling_2": math.inf}), "Error at rest")
    rows = {row[0]: row[1:] for row in friction.rows}
    assert set(rows) == {law.name for law in LAWS} - {"far"}  # which trips and has no rest
    share = SET_4.play / SIZE
    assert rows["set 4"][0] == f"{100 * share:.1f} %"
    assert rows["set 4"][1:3] == ("2.0 %", "2.0 %")
    assert rows["set 4"][3] == f"{100 * 0.1 * 10 / SET_4.k_pf / SIZE:.1f} %"
    assert rows["set 4"][4:] == ("20.0 %", "20.0 %")
    assert rows["set 1"][1:3] == ("2.0 %", "still swings")
    assert rows["with a sum"] == ("0 (integral)", "2.0 %", "0.1 %", "0 (integral)", "20.0 %", "0.8 %")
    assert friction.numbers == tuple(range(1, 7))
    assert "(1.0 V)" in friction.caption


def test_the_verdict_says_effort_arrival_push_and_what_pd_does():
    told = chapter(whole())
    assert told.verdict == (
        "All 2 pole sets follow a step of 14.3 deg within effort, travel and twist. Set 4 takes 79 % of the drive's "
        "limit and arrives in 0.607 s. A tuned PD of the near encoder arrives in 0.988 s at 31 % of the limit, but a "
        "push moves it by 40 % of the step, set 4 by 20 %. As stiff, it swings for 1.9 s."
    )
    assert told.sound
    assert told.detail == "Run on a simulated rig."


@pytest.mark.parametrize(
    ("measured", "said"),
    [
        ({"first": {"tripped": 0.456}}, "is too much for set 1 (leaves travel or twist after 0.46 s). Set 4"),
        (
            {"last": {"saturated": 0.0123}},
            "is too much for set 4 (at the drive's limit in 1.2 % of the samples). Set 4",
        ),
        ({"last": {"arrival": math.inf}}, "and never stays within 5 %."),
        ({"stiff": {"moved": False}}, "As stiff, it does not settle."),
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
    assert "Set 4 follows a step of 14.3 deg within" in one.verdict
    assert one.detail == "Predicted with the fitted model; no rig was touched."
    assert [part.title for part in one.parts] == ["Closed loop", "Gains"]
    some = chapter(tracking(outcome(SET_1), outcome(SET_4, ran(), ran()), interrupted=True))
    assert some.detail == (
        "Run on a simulated rig, except for what is predicted to leave the bounds: set 1. Interrupted: this is what "
        "was finished by then."
    )


def test_every_part_has_its_turn_and_says_its_numbers():
    told = chapter(whole())
    assert [part.title for part in told.parts] == ["Closed loop", "Why state feedback", "What friction leaves", "Gains"]
    text = {part.title: " ".join(b for b in part.content if isinstance(b, str)) for part in told.parts}
    assert (
        "The step is 14.3 deg, bounded by effort. Each bound allows: 95 % of the drive's limit 14.4 deg, "
        "60 % of the twist that trips the shaft 17.2 deg."
    ) in text["Gains"]
    assert "set 1 79 %, set 4 79 %" in text["Closed loop"]
    assert "Predicted for set 4: 7.89 V (78.9 %); measured the same." in text["Closed loop"]
    assert "it leaves 0.1 % of the step" in text["What friction leaves"]
    why = text["Why state feedback"]
    p = RIG.plant.parameters()
    bound, least = 0.5 * math.sqrt(p["k_12"] / p["J_1"]), p["k_12"] * p["J_1"] / p["J_2"]
    for words in (
        f"half the root of k/inertia 1, here {bound:.2f} 1/s", f"(inertia 1)/(inertia 2), {least:.2f} N m/rad",
        f"set 4 has {SET_4.stiffness:.1f}", "at 31 % of the limit", "the best of 0 pairs",
        f"decays with {STIFF.decay:.1f} 1/s at a damping ratio of {STIFF.damping:.2g}",
        f"against {SET_4.decay:.2f} 1/s and {SET_4.damping:.2f}.",
        "with the same gains trips the rig 0.3 s after the step. Between",
    ):  # fmt: skip
        assert words in why
    assert "does not trip the rig" in str(chapter(whole(far={"tripped": math.inf})).parts[1].content)
    other = chapter(whole(last={"peak": 7.9}))
    assert "measured 7.9 V." in " ".join(b for b in other.parts[0].content if isinstance(b, str))


def test_what_was_predicted_to_trip_is_not_said_to_have_been_tried():
    done = whole()
    done = replace(done, far=outcome(FAR, ran(tripped=0.35)))
    why = " ".join(b for b in chapter(done).parts[1].content if isinstance(b, str))
    assert "was not run; it is predicted that it trips the rig 0.25 s after the step" in why
    compared = next(b for b in chapter(done).parts[1].content if getattr(b, "name", "") == "track-compared")
    assert compared.caption.endswith("Predicted, not run: far.")


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
    (near, far) = pictures["track-loci"].draw().panels
    swing = math.sqrt(RIG.plant.k_12 / RIG.plant.J_2)
    for ax, zeros in ((near, [(-20.0, 0.0), (0.0, swing)]), (far, [(-20.0, 0.0)])):  # kp/kd = 8/0.4
        (drawn,) = [line for line in ax.lines if line.name == "zero"]
        shown = sorted(zip(drawn.x.tolist(), drawn.y.tolist(), strict=True))
        np.testing.assert_allclose(shown, sorted(zeros), atol=1e-9)
        (marked,) = [line for line in ax.lines if line.name == "kp of the tuned PD"]
        K = np.array([[8.0, 0.4, 0, 0]]) if ax is near else np.array([[0, 0, 8.0, 0.4]])
        model = RIG.linear(AT)
        poles = np.linalg.eigvals(model.A - model.B @ K)
        poles = np.sort_complex(poles[poles.imag > -1e-9])
        np.testing.assert_allclose(np.sort_complex(marked.x + 1j * marked.y), poles, rtol=1e-6)
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
    assert "At rest the effort of set 4 is excessive: the command's rms is 30 % of the limit (10 % is quiet)." in (
        told.verdict
    )
    assert not told.sound
    assert chapter(whole(last={"rms": 0.1})).sound
    assert "excessive" not in chapter(whole(last={"rms": 0.1})).verdict


def variants():
    """A result for each verdict that the chapter can come to."""
    return {
        "as predicted": whole(),
        "trips": whole(first={"tripped": 0.456}),
        "saturates": whole(last={"saturated": 0.0123}),
        "never arrives": whole(last={"arrival": math.inf, "peak": 7.9}),
        "PD swings": whole(stiff={"moved": False}),
        "still": whole(last={"moved": False}, first={"settling_2": math.inf}),
        "busy": whole(last={"rms": 0.3}),
        "far PD stays": whole(far={"tripped": math.inf}),
        "far PD not run": replace(whole(), far=outcome(FAR, ran(tripped=0.35))),
        "on the rig": replace(whole(), performed=""),
        "predicted": tracking(outcome(SET_4)),
        "interrupted": tracking(outcome(SET_1), outcome(SET_4, ran(), ran()), interrupted=True),
    }


def test_a_verdict_takes_at_most_120_words():
    for name, result in variants().items():
        page = chapter(result)
        assert len(f"{page.title} {page.question} {page.verdict} {page.first_line}".split()) <= WORDS_OF_A_VERDICT, name


@pytest.mark.slow
def test_every_sentence_is_printed_for_some_result(tmp_path):
    shaft = run_tracking("rectilinear", 1, tmp_path)
    gain = shaft.fit.model.parameters["actuator.gain"]
    known = {**shaft.fit.model.parameters, "actuator.gain": replace(gain, estimate=not gain.estimate)}
    other = replace(shaft, fit=replace(shaft.fit, model=replace(shaft.fit.model, parameters=known)))
    template = Rendered(chapter.__module__)
    with template.watched():
        for result in (*variants().values(), shaft, other):
            chapter(result)
    assert template.missed == {}
    score = next(s for s in shaft.fit.runs.values() if s.role != "fit")
    fit = next(part for part in chapter(shaft).parts if part.title == "Fit")
    assert all(f"{v:.2f} % of" in str(fit.content) for v in score.fit_percent.values())
