"""Does the chapter of a log say of its time and columns what an inspection found, and draw them so?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.readers.inspection import Column, Gap, Inspection, TimeBase
from upright.readers.resolution import Resolution
from upright.records import Record
from upright.report.log import chapter, draw_columns

T = np.linspace(0.0, 2.0, 41)
TIME = TimeBase(samples=41, period=0.05, duration=2.0, late=0.0, rounding=0.0, jitter=0.0, gaps=(), rebuilt=False)
PLAIN = Column(
    name="theta", unit="rad", guess="", low=-1.25, high=2.5, resolution=Resolution(), constant=False, low_share=0.0,
    high_share=0.0, turns=0, drive=False, idle=False, switches=(), stepwise=False, remarks=(),
)  # fmt: skip


def seen(*columns, time=TIME, rests=(), notes=()):
    return Inspection(
        file="runs/swing.csv", reader="table", time=time, columns=columns or (PLAIN,), rests=rests, notes=notes
    )


def record(*names):
    return Record(t=T, signals={n: np.sin(3 * T) + i for i, n in enumerate(names)})


def page(*columns, **more):
    return chapter(record("theta"), seen(*columns, **more)).parts[0].content


def times(**changes):
    rests = changes.pop("rests", ())
    return page(time=replace(TIME, **changes), rests=rests)[0].sentences


def test_time_is_told_in_milliseconds_and_hertz():
    assert times() == ("41 samples over 2 s, period 50 ms (20 Hz).",)
    assert times(period=0.004, rebuilt=True, rounding=1e-3)[0].endswith(
        "period 4 ms (250 Hz), rebuilt from stamps rounded to 1 ms."
    )


@pytest.mark.parametrize(("jitter", "said"), [(5e-4, ""), (5.1e-4, ", jitter 0.51 ms (99 %)")])
def test_jitter_is_told_beyond_a_hundredth_of_the_period(jitter, said):
    assert times(jitter=jitter)[0] == f"41 samples over 2 s, period 50 ms (20 Hz){said}."


@pytest.mark.parametrize(("late", "said"), [(0.075, False), (0.08, True), (-0.08, True), (-0.05, False)])
def test_a_late_beginning_is_told_beyond_one_sample_and_a_half(late, said):
    assert (f"The first sample is at {late:g} s, not at 0." in times(late=late)) == said


def test_gaps_are_counted_and_the_largest_is_told():
    small, large = Gap(start=0.5, length=0.1, missing=1), Gap(start=1.25, length=0.2, missing=3)
    assert times(gaps=(small,))[1] == "1 gap, the largest 100 ms at 0.5 s (1 sample missing)."
    assert times(gaps=(large, small))[1] == "2 gaps, the largest 200 ms at 1.25 s (3 samples missing)."
    assert times(gaps=(small, large))[1] == "2 gaps, the largest 200 ms at 1.25 s (3 samples missing)."


def test_six_spans_at_rest_are_told():
    spans = tuple((i / 4, i / 4 + 0.125) for i in range(7))
    (said,) = times(rests=spans)[1:]
    assert said.startswith("Nothing moves: 0 to 0.125 s, 0.25 to 0.375 s, ")
    assert said.endswith(", 1.25 to 1.375 s.")


def remarks(**changes):
    return page(replace(PLAIN, **changes))[1].rows[0][-1]


def test_a_column_stands_with_its_range_unit_and_step():
    rows = page(
        replace(PLAIN, resolution=Resolution(step=0.01, decimals=True)), replace(PLAIN, name="u", unit="", guess="V"),
        replace(PLAIN, name="n", unit=""),
    )[1]  # fmt: skip
    assert rows.headings == ("column", "unit", "lowest", "highest", "resolution", "remarks")
    assert rows.rows == (
        ("theta", "rad", "-1.25", "2.5", "0.01 (decimals)", ""), ("u", "V?", "-1.25", "2.5", "", ""),
        ("n", "", "-1.25", "2.5", "", ""),
    )  # fmt: skip
    assert [rows.headings[i] for i in rows.numbers] == ["lowest", "highest"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"constant": True, "low": 2.5, "drive": True, "turns": 3}, "constant 2.5"),
        ({"constant": True, "idle": True}, "idle, always 0"),
        ({"drive": True}, "drives?"),
        ({"drive": True, "remarks": ("holds the reference",)}, "holds the reference"),
        ({"drive": True, "switches": ((0.5, 2.0), (1.5, 0.0))}, "drives?; leaves 0 at 0.5 s, back at 0 at 1.5 s"),
        ({"switches": ((0.5, 2.0), (1.5, 0.0)), "stepwise": True}, "switches to 2 at 0.5 s, to 0 at 1.5 s"),
        ({"switches": ((0.5, 2.0),) * 6, "stepwise": True}, "switches " + ", ".join(["to 2 at 0.5 s"] * 6)),
        ({"switches": ((0.5, 2.0),) * 7, "stepwise": True}, ""),
        ({"turns": -2}, "offset of -2 turns (2 pi each)"),
        ({"drive": True, "low_share": 0.25}, "drives?; at -1.25 for 25 % of the samples (saturated?)"),
        ({"drive": True, "high_share": 0.125}, "drives?; at 2.5 for 12 % of the samples (saturated?)"),
        ({"drive": True, "high_share": 0.125, "stepwise": True}, "drives?"),
        ({"high_share": 0.125}, ""),
    ],
)
def test_remarks_say_what_stands_out(changes, said):
    assert remarks(**changes) == said


def test_notes_stand_between_the_columns_and_their_picture():
    content = page(notes=("Times repeat.",))
    assert content[2].sentences == ("Note: Times repeat.",)
    assert content[-1].description == "theta from -1.25 to 2.5"
    assert len(page()) == 3


def test_columns_are_drawn_over_time_with_rests_and_gaps_drives_last():
    columns = (
        replace(PLAIN, name="u", unit="", guess="V", drive=True, stepwise=True), PLAIN,
        replace(PLAIN, name="stamp", remarks=("This is the time once more.",)),
        replace(PLAIN, name="k", remarks=("A sample index.",)), replace(PLAIN, name="still", constant=True),
        replace(PLAIN, name="a" * 31, unit="", remarks=("It follows theta.",)),
    )  # fmt: skip
    rows = record("u", "theta", "stamp", "k", "still", "a" * 31)
    gaps = tuple(Gap(start=0.01 * i, length=0.01, missing=1) for i in range(21))
    drawing = draw_columns(rows, seen(*columns, time=replace(TIME, gaps=gaps), rests=((0.5, 0.75),)))
    labels = [a.get_ylabel() for a in drawing.axes]
    assert labels == ["theta\n[rad]", "…" + "a" * 29, "u\n[V?]"]
    for axes, name in zip(drawing.axes, ("theta", "a" * 31, "u"), strict=True):
        np.testing.assert_array_equal(axes.lines[-1].get_data(), (T, rows[name]))
        marked = [line.get_xdata()[0] for line in axes.lines[:-1]]
        np.testing.assert_allclose(marked, [g.start for g in gaps[:20]])
        assert [(p.get_x(), p.get_x() + p.get_width()) for p in axes.patches] == [(0.5, 0.75)]
    assert [a.lines[-1].get_drawstyle() for a in drawing.axes] == ["default", "default", "steps-post"]
    assert [a.get_title(loc="left") for a in drawing.axes] == ["", "It follows theta.", ""]
    assert [a.get_xlabel() for a in drawing.axes] == ["", "", "time [s]"]
    assert not any(a.yaxis.label.get_parse_math() for a in drawing.axes)  # a dollar in a name is a dollar
    assert drawing.get_suptitle() == "swing.csv, 41 samples, grey: at rest"


def test_eight_columns_are_drawn_at_most_and_a_name_of_thirty_letters_is_whole():
    names = ["b" * 30, *(f"c{i}" for i in range(8))]
    drawing = draw_columns(record(*names), seen(*(replace(PLAIN, name=n, unit="") for n in names)))
    assert [a.get_ylabel() for a in drawing.axes] == names[:8]


@pytest.mark.parametrize(("value", "reach"), [(0.25, 1.0), (-40.0, 40.0)])
def test_where_nothing_moves_the_constant_stands_in_the_middle_of_its_axis(value, reach):
    still = replace(PLAIN, constant=True, low=value, high=value)
    drawing = draw_columns(record("theta"), seen(still, rests=((0.0, 2.0),)))
    (axes,) = drawing.axes
    assert axes.get_ylim() == (value - reach, value + reach)
    assert [t.get_text() for t in axes.texts] == [f"constant {value:g}"]
    assert not axes.patches
    assert drawing.get_suptitle().endswith("41 samples, nothing moves")


def test_a_log_of_nothing_but_times_is_drawn_all_the_same():
    stamp = replace(PLAIN, name="stamp", remarks=("This is the time once more.",))
    assert [a.get_ylabel() for a in draw_columns(record("stamp"), seen(stamp)).axes] == ["stamp\n[rad]"]
