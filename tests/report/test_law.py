"""Does the chapter of a recovered law say its numbers, how it was evaluated, and what it leaves unexplained?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.closed_loop import Recovery
from upright.closed_loop.recovery import Gain, TriedStructure
from upright.closed_loop.structures import Channel
from upright.laws import Law
from upright.records import Record
from upright.report.law import chapter, draw_law

N = 400
T = 3.0 + 0.01 * np.arange(N)
STEPS = np.where(np.arange(N) < 200, 0.0, (-1.0) ** np.arange(N))  # it moves in the second half alone
RECORD = Record(t=T, signals={"u": STEPS, "y": 0 * T, "r": 0 * T})
LAW = Law(
    np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[-2.0, 2.0]], measured=("y",), reference_names=("r",),
    references=np.zeros((1, 1)), period=0.01, limit=7.5,
)  # fmt: skip
FOUND = Recovery(
    law=LAW, command="u", feedforward={}, channels=(Channel(measured="y", reference="r", kp=2.0),),
    gains={"kp": Gain(value=2.0, stderr=0.1, interval=(1.8, 2.25), meaning="on the error")}, structure="P of r - y",
    rows=np.arange(N), recorded=STEPS, reproduced=STEPS - 0.25, used=np.ones(N, dtype=bool), resolution=0.5,
    saturated=0.0, every=1, unit="V",
    candidates=tuple(TriedStructure(name=f"s{i // 2}", parameters=i + 1, missed=0.5 + i) for i in range(20)),
)  # fmt: skip


def page(**changes):
    return chapter(RECORD, replace(FOUND, **changes), "run.csv")


def test_gains_stand_with_their_intervals_and_meaning():
    table = page().parts[0].content[0]
    assert table.headings == ("", "value", "at least", "at most", "acts")
    assert table.rows == (("kp", "2", "1.8", "2.25", "on the error"),)
    assert (table.caption, table.numbers) == ("P of r - y", (1, 2, 3))
    assert (page().title, page().verdict) == ("u of run.csv", "P of r - y.")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, ("Evaluated every 10 ms, once per row; answers at the same sample.",)),
        ({"every": 4}, ("Evaluated every 10 ms, 4 times per row; answers at the same sample.",)),
        ({"rows": np.arange(0, N, 2)}, ("Evaluated every 10 ms; answers at the same sample.",)),
        ({"law": replace(LAW, delay=1.0)}, ("Evaluated every 10 ms, once per row; a sample late.",)),
        (
            {"saturated": 0.125, "law": replace(LAW, windup="hold")},
            ("Evaluated every 10 ms, once per row; answers at the same sample.",
             "Limited to 7.5 V in 12 % of the rows (its sum stands still meanwhile)."),
        ),
        (
            {"saturated": 0.5, "unit": ""},
            ("Evaluated every 10 ms, once per row; answers at the same sample.",
             "Limited to 7.5 in 50 % of the rows."),
        ),
    ],
)  # fmt: skip
def test_it_says_how_often_how_late_and_how_often_limited(changes, said):
    assert page(**changes).parts[0].content[1].sentences == said


def test_the_best_of_every_structure_is_listed_eight_at_most():
    table = page().parts[2].content[0]
    assert table.headings == ("structure", "numbers", "missed on rows held out V")
    assert table.rows == tuple((f"s{k}", str(2 * k + 1), f"{0.5 + 2 * k:g}") for k in range(8))
    assert page(unit="").parts[2].content[0].headings[2] == "missed on rows held out"


def test_a_poor_law_asks_for_its_columns_and_a_good_one_goes_into_a_study():
    """Residuals of a quarter within the column's step of a half; reproduced upside down they explain nothing."""
    good = page()
    assert good.sound
    assert good.steps[0].command.splitlines()[0] == 'loop = { kind = "recover", command = "u", reference = "r" }'
    poor = page(reproduced=-STEPS)
    assert not poor.sound
    assert poor.steps[0].command == "upright show run.csv"
    assert "--measured and --reference" in poor.steps[0].sentence


def test_the_command_is_drawn_whole_close_up_and_as_what_is_left():
    drawing = draw_law(RECORD, FOUND)
    whole, close, left = drawing.axes
    lines = {line.get_label(): np.array(line.get_data()) for line in whole.lines}
    # the first three rows may hold junk
    np.testing.assert_array_equal(lines["recorded"], (T[3:], STEPS[3:]))
    np.testing.assert_array_equal(lines["law"], (T[3:], STEPS[3:] - 0.25))
    near = {line.get_label(): np.array(line.get_data()) for line in close.lines}
    assert near["recorded"].shape == (2, 120)
    assert near["recorded"][0, 0] >= T[199]  # where it moves most
    rows = np.searchsorted(T, near["recorded"][0] - 1e-9)
    np.testing.assert_array_equal(near["recorded"], (T[rows], STEPS[rows]))
    np.testing.assert_array_equal(near["law"], (T[rows], STEPS[rows] - 0.25))
    np.testing.assert_allclose(left.lines[0].get_data(), (T[3:], np.full(N - 3, 0.25)))
    (step,) = left.patches
    assert (step.get_y(), step.get_y() + step.get_height()) == (-0.25, 0.25)
    assert [a.get_ylabel() for a in drawing.axes] == ["u [V]", "u [V]", "residual [V]"]
    assert left.get_xlabel() == "time [s]"
    assert not any(a.yaxis.label.get_parse_math() for a in drawing.axes)
    assert not draw_law(RECORD, replace(FOUND, resolution=0.0)).axes[2].patches
    assert whole.get_title(loc="left") == f"P of r - y; explains {FOUND.explained:.4g} %"


def test_a_short_log_is_its_own_close_up_and_a_long_name_is_cut():
    short = replace(
        FOUND, rows=np.arange(9), recorded=STEPS[200:209], reproduced=STEPS[200:209], command="v" * 30, unit=""
    )
    whole, close, _ = draw_law(RECORD, short).axes
    assert len(close.lines[0].get_xdata()) == len(whole.lines[0].get_xdata()) == 6
    assert whole.get_ylabel() == "v" * 24
