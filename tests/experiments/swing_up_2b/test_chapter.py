"""Do verdict, tables and next steps of experiment 2b say what its log shows?"""

from __future__ import annotations

import math
from contextlib import ExitStack
from types import SimpleNamespace

import pytest

from tests.experiments.swing_up_2b.closed_form import BAD, GOOD, LAW, RIG, climbed, experiment
from tests.report.rendering import Rendered
from upright.experiments.swing_up_2b.chapter import chapter, check_chapter
from upright.experiments.swing_up_2b.run import FAULTS, FaultyEncoder
from upright.report.html import WORDS_OF_A_VERDICT

UP = "Peak command 8 of 10 V, travel 0.6 of 1.5 rad."


def lie(**what):
    rest = {
        "name": "theta", "factor": -0.5, "estimate": 0.49987, "error": 0.001, "refused": True, "spoke": 0.0123,
        "tilt": math.radians(7.5), "suspicion": "theta", "fell": 0.2345,
    }  # fmt: skip
    return FaultyEncoder(**(rest | what))


@pytest.mark.parametrize(
    ("ascent", "caught", "verdict"),
    [
        (climbed(), True, f"Upright after 2.00 s and 5 half swings. It stood to the end, 6 s. {UP}"),
        (
            climbed(falls=[(2.5, 3.0)]), True,
            f"Upright after 3.00 s and 5 half swings, at catch 2. It stood to the end, 5 s. {UP}",
        ),
        (climbed(caught=3.01), False, f"The pendulum did not stand for 5 s: it fell 0 times. {UP}"),
        (climbed(falls=[(2.5, 3.0), (3.5, 3.8)]), False, f"The pendulum did not stand for 5 s: it fell 2 times. {UP}"),
        (climbed(caught=99), False, f"The pendulum was not caught in 8 s. {UP} Allow more time or travel."),
        (
            climbed(tripped=7.895), False,  # it still stands, but no loop stabilises it any more
            "The drive was switched off at the end of the travel after 7.90 s. Allow more travel, or pump less.",
        ),
    ],
)  # fmt: skip
def test_the_verdict_says_how_far_it_came(ascent, caught, verdict):
    done = experiment(ascent)
    page = chapter(done)
    # a twentieth of 8 V, of 10 V: its rms over 0.3 or more of a period is below its peak of 4 % of the limit
    outcome, _, rest = page.verdict.partition(" The command at rest has an rms of ")
    assert (done.caught, outcome) == (caught, verdict)
    assert bool(rest) == caught
    assert "quiet" not in rest
    assert page.sound == caught
    assert page.numbers["verdict"] == page.verdict
    assert page.numbers["swing_up"]["held"] == caught


def test_no_loop_is_closed_on_an_encoder_that_is_wrong():
    done = experiment(check=BAD)
    told = chapter(done)
    assert told.verdict.startswith("No loop was closed. The encoder of theta shows 2")
    assert [part.title for part in told.parts] == ["Encoders, before a loop is closed"]
    assert [(k.what, k.value) for k in told.findings] == [("swing-up", "no")]
    assert told.numbers["swing_up"] is None
    assert told.numbers["sensors"]["theta"]["sound"] is False
    assert [step.sentence for step in told.steps] == ["Repair the encoder, then try again."]


def test_the_table_of_encoders_has_scale_interval_and_what_is_explained():
    told = check_chapter(RIG, BAD, "own.csv")
    (table,) = [b for b in told.parts[0].content if hasattr(b, "rows")]
    assert table.rows == (
        ("psi", "1.0010", "4.0·10⁻³", "99.90 %", "healthy"), ("theta", "2.0000", "2.0·10⁻³", "98.0 %", "faulty"),
    )  # fmt: skip
    assert table.numbers == (1, 2, 3)
    assert told.steps[0].command == ""
    assert told.numbers["sensors"]["psi"] == {"scale": 1.001, "stderr": 0.002, "explained": 0.999, "sound": True}


def test_encoders_that_are_right_lead_on_to_the_gains():
    told = check_chapter(RIG, GOOD, "own.csv", "mine.json")
    assert told.sound
    assert told.steps[0].command == "upright regulate mine.json"


def test_the_way_up_is_a_table_of_what_the_log_shows():
    """8 V of 10: never at the limit; the catch's ellipsoid is three quarters of what the linear model allows."""
    told = chapter(experiment(climbed(falls=[(2.5, 3.0)], volts=8.0)))
    (table,) = [b for b in told.parts[0].content if hasattr(b, "rows")]
    a, b = 5 * (8.0 - 5.0 / 3), 5 * 8.0  # the last third of standing, as angles of 0.4 V cos
    mean = (math.sin(b) - math.sin(a)) / (b - a)
    rms = 0.04 * math.sqrt(0.5 + (math.sin(2 * b) - math.sin(2 * a)) / (4 * (b - a)) - mean**2)
    assert table.rows == (
        ("upright for good after", "3.00", "s"),
        ("half swings before the first catch", "5", ""),
        ("catches, falls", "2, 1", ""),
        ("largest command, of its limit", "8 of 10", "V"),
        ("share of the time at the limit", "0.0 %", ""),
        ("command at rest, rms, of the limit", f"{100 * rms:.1f} %", ""),
        ("farthest from the middle, of the travel", "0.6 of 1.5", "rad"),
        ("ellipsoid of the catch, of what the linear model allows", "75.0 %", ""),
    )
    (never,) = [b for b in chapter(experiment(climbed(caught=99))).parts[0].content if hasattr(b, "rows")]
    assert never.rows[0] == ("upright for good after", "never", "s")


def test_lies_are_counted_by_who_notices_them_and_when():
    """Of four faults three are found hanging; two fall, and a watch speaks before one of them."""
    faults = (
        lie(), lie(factor=4.0, spoke=0.5, fell=0.3),
        lie(refused=False, spoke=math.inf, tilt=0.0, suspicion="", fell=math.inf),
        lie(fell=math.inf),
    )  # fmt: skip
    told = chapter(experiment(climbed(), faulty=faults))
    points, table = told.parts[2].content
    assert points.sentences == (
        "Hanging, 3 of 4 faults are detected before a loop is closed. A loop started 3 degrees from upright falls with "
        "2 of them. A watch beside it switches off before the fall in 1 cases.",
    )
    assert table.rows[0] == ("theta", "−0.5", "0.4999", "12", "7.5", "theta", "234")
    assert table.rows[1] == ("theta", "4", "0.4999", "500", "7.5", "theta", "300")
    assert table.rows[2] == ("theta", "−0.5", "0.4999", "–", "–", "–", "stands")
    assert table.numbers == (1, 2, 3, 4, 6)
    assert told.numbers["faults_tried"] == len(FAULTS)
    assert told.numbers["faulty_encoders"][0]["fell"] == 0.2345
    assert chapter(experiment(climbed())).numbers["faults_tried"] == 0


def test_the_next_step_follows_from_what_came_of_it():
    own = chapter(experiment(climbed(), source="fit.json"))
    export = "upright export FOLDER/swing_up.json --to c"
    assert [s.command for s in own.steps] == [export, 'upright swing-up fit.json --seed 3 --fault "theta=2"']
    sheet = [s.command for s in chapter(experiment(climbed())).steps]
    assert sheet == [
        export, 'upright swing-up --rig furuta --seed 3 --fault "theta=2"', "upright swing-up FIT.json --seed 3",
    ]  # fmt: skip
    lost = [s.command for s in chapter(experiment(climbed(caught=99), source="fit.json")).steps]
    assert lost[0] == "upright swing-up fit.json --seed 3 --travel 3"  # twice as far
    broken = [s.command for s in chapter(experiment(check=BAD, source="fit.json")).steps]
    assert broken == ["upright swing-up fit.json --seed 3"]


def test_the_cover_has_time_and_command_of_a_pendulum_that_was_caught():
    told = chapter(experiment(climbed(falls=[(2.5, 3.0)])))
    assert [(k.what, k.value) for k in told.findings] == [
        ("from hanging to upright", "3.00 s"), ("largest command of the swing-up", "8.00 V"),
    ]  # fmt: skip
    assert [k.value for k in chapter(experiment(climbed(caught=99))).findings] == ["no"]
    up = told.numbers["swing_up"]
    assert (up["upright_after"], up["half_swings"]) == (pytest.approx(3.0), 5)
    assert up["handovers"] == pytest.approx((2.0, 3.0))
    assert up["falls"] == pytest.approx((2.5,))
    assert (up["peak_command"], up["share_saturated"]) == (pytest.approx(8.0), 0.0)
    assert up["travel"] == pytest.approx(0.6, abs=1e-4)
    assert told.numbers["law"] | {"K": 0, "P": 0} == {
        "K": 0, "P": 0, "size": LAW.size, "sure": LAW.sure, "reach": LAW.reach, "limit": 10.0, "travel": 1.5,
        "held_for": 5.0, "body": vars(LAW.body),
    }  # fmt: skip


def test_a_rig_with_numbers_of_its_own_is_called_by_its_seed():
    assert chapter(experiment(climbed())).title.endswith(", seed 3")
    assert "seed" not in chapter(experiment(climbed(), truth=RIG)).title
    assert "the fit of the hanging rig" in chapter(experiment(climbed(), source="fit.json")).detail
    assert "nominal parameters" in chapter(experiment(climbed())).detail


def test_every_sentence_is_printed_for_some_result():
    busy = experiment(climbed(volts=8.0), law=SimpleNamespace(**{**vars(LAW), "limit": 0.9}), source="fit.json")
    faults = (lie(), lie(spoke=math.inf, suspicion="", fell=math.inf))
    results = (
        experiment(climbed(falls=[(2.5, 3.0)]), faulty=faults), busy, experiment(climbed(), truth=RIG),
        experiment(climbed(), performed=""), experiment(climbed(caught=3.01)), experiment(climbed(caught=99)),
        experiment(climbed(tripped=7.895)), experiment(check=BAD),
    )  # fmt: skip
    templates = [Rendered(chapter.__module__, name) for name in ("chapter", "check", "encoders")]
    with ExitStack() as watched:
        for template in templates:
            watched.enter_context(template.watched())
            for result in results:
                page = chapter(result)
                assert len(f"{page.title} {page.question} {page.verdict}".split()) <= WORDS_OF_A_VERDICT
            for check in (GOOD, BAD):
                check_chapter(RIG, check, "own.csv")
    assert [template.missed for template in templates] == [{}, {}, {}]
    assert "excessive" in chapter(busy).verdict
