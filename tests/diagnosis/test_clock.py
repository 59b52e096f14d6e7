"""Gaps, jitter and rounded stamps of a log are told by what is missing from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.cases import case
from upright.diagnosis import Finding, examine
from upright.diagnosis.clock import examine_clock, read_mended, steps_panel
from upright.records import Provenance, Record

DT, N = 0.01, 1000
T = np.arange(N) * DT


def about_time(t: np.ndarray) -> list[Finding]:
    log = {"theta": np.sin(5 * t) * np.exp(-0.1 * t)}
    record = Record(t=t, signals=log, units={"theta": "rad"}, provenance=Provenance(file="log.csv", reader="table"))
    return [f for f in examine(record).findings if f.kind in ("gap", "jitter", "clock")]


@pytest.mark.parametrize(
    ("without", "gaps", "longest", "begins", "severity"),
    [
        # rows that were lost, by their number: a gap lasts one sample more than it misses
        ([300], 1, 20.0, 2.99, "note"),
        ([300, 301], 1, 30.0, 2.99, "warning"),
        ([300, 700], 2, 20.0, 2.99, "warning"),
        ([300, *range(700, 710)], 2, 110.0, 6.99, "warning"),
        ([*range(300, 310), 700], 2, 110.0, 2.99, "warning"),
    ],
)
def test_samples_that_were_lost_are_counted_and_the_longest_silence_is_named(without, gaps, longest, begins, severity):
    (finding,) = about_time(np.delete(T, without))
    assert (finding.kind, finding.severity, finding.spoils) == ("gap", severity, False)
    assert finding.evidence["gaps [1]"] == gaps
    assert finding.evidence["missing samples [1]"] == len(without)
    assert finding.evidence["longest [ms]"] == pytest.approx(longest)
    assert f"from {begins:.5g} s on" in finding.sentence
    assert finding.sentence.startswith(f"{gaps} gap{'s' if gaps > 1 else ''} in time")
    # the window begins where the longest silence ends
    assert finding.key == f'window = [{begins + longest / 1e3:.6g}, "end"]'
    assert finding.marks[0] == pytest.approx(2.99)


def test_a_log_that_lost_more_than_a_tenth_of_what_it_has_is_spoilt():
    (finding,) = about_time(np.delete(T, np.arange(500, 600)))  # 100 of 900
    assert finding.spoils
    (finding,) = about_time(np.delete(T, np.arange(500, 580)))  # 80 of 920
    assert not finding.spoils


def test_a_uniform_clock_brings_no_finding():
    assert about_time(T) == []


@pytest.mark.parametrize(("share", "found", "spoilt"), [(0.02, False, False), (0.2, True, False), (0.65, True, True)])
def test_jitter_counts_from_a_twentieth_of_the_period_and_spoils_from_a_half(share, found, spoilt):
    """Every stamp late by up to half the share: steps differ from the period by up to the share of it."""
    late = 0.5 * share * DT * np.where(np.arange(N) % 2, 1.0, -1.0)
    findings = about_time(T + late)
    assert [f.kind for f in findings] == ["jitter"] * found
    for finding in findings:
        assert finding.evidence["jitter [ms]"] == pytest.approx(1e3 * share * DT, rel=0.01)
        assert finding.evidence["period [ms]"] == pytest.approx(1e3 * DT, rel=0.01)
        assert finding.spoils is spoilt


def test_stamps_rounded_coarsely_are_told_as_rounding_and_not_as_jitter():
    t = np.unique(np.round(np.arange(N) * 0.0165, 2))  # hundredths of a second, of a clock of 16.5 ms
    (finding,) = about_time(t)
    assert finding.kind == "clock"
    assert finding.evidence["rounding [ms]"] == pytest.approx(10.0)


def clock(time=None, *, t=T, notes=(), **signals):
    """Findings about a time base of which the inspection says so much."""
    made = case(x=np.sin(5 * t), t=t, notes=notes) if not signals else case(t=t, notes=notes, **signals)
    inspection = replace(made.inspection, time=replace(made.inspection.time, **(time or {})))
    return examine_clock(replace(made, inspection=inspection))


@pytest.mark.parametrize(
    ("rounding", "jitter", "found"),
    [(1.1e-3, 6e-4, True), (0.9e-3, 6e-4, False), (1.1e-3, 4e-4, False)],
)
def test_rounding_is_coarse_from_a_tenth_of_the_period_if_the_stamps_wander(rounding, jitter, found):
    findings = clock({"rounding": rounding, "jitter": jitter, "period": 0.01, "rebuilt": False})
    assert bool([f for f in findings if f.kind == "clock"]) == found
    for f in findings:
        if f.kind == "clock":
            assert f.sentence == (
                "The time stamps are rounded to 1.1 ms, which is coarse beside the period of 10 ms, and do not follow"
                " a uniform clock."
            )
            assert f.evidence == pytest.approx({"rounding [ms]": 1.1, "period [ms]": 10.0})


def test_a_clock_that_was_rebuilt_is_a_note_with_how_far_it_wandered():
    said = "Time was rounded to 1 ms; rebuilt from the sample index: stamps wander up to 0.52 ms"
    (finding,) = clock({"rounding": 1e-3, "rebuilt": True, "period": 0.01, "jitter": 0.0}, notes=(said,))
    assert finding.severity == "note"
    assert "rounded to 1 ms and wander up to 0.52 ms from a uniform clock of 10 ms" in finding.sentence
    assert finding.evidence == pytest.approx({"rounding [ms]": 1.0, "wander [ms]": 0.52})


@pytest.mark.parametrize(
    ("jitter", "rounding", "found"),
    [(4.9e-4, 0.0, False), (5.1e-4, 0.0, True), (6e-4, 6e-4, False), (6.1e-4, 6e-4, True)],
)
def test_jitter_within_a_coarse_rounding_is_that_rounding(jitter, rounding, found):
    findings = clock({"jitter": jitter, "rounding": rounding, "period": 0.01, "rebuilt": False})
    jitters = [f for f in findings if f.kind == "jitter"]
    assert bool(jitters) == found
    for f in jitters:
        assert f"by more than {1e3 * jitter:.3g} ms ({1e4 * jitter:.0f} %)" in f.sentence
        assert f.key == 'period = "10 ms"'
        assert not f.spoils


def doubled(rows, n=1000):
    x = np.sin(5 * np.arange(n) * DT)
    for row in rows:
        x[row] = x[row - 1]
    return x


def test_rows_that_repeat_while_the_rig_moves_are_counted_from_three_on():
    fast = [60, 250, 440]  # where the sine passes zero, near enough
    y = 2 * doubled(fast)
    (finding,) = [f for f in clock(x=doubled(fast), y=y) if f.kind == "doubled"]
    assert finding.evidence == pytest.approx({"doubled rows [1]": 3, "share [%]": 0.3})
    assert finding.sentence.startswith("3 rows repeat the row before in every measured column")
    assert "(the first at 0.6 s)" in finding.sentence
    assert finding.columns == ("x", "y")
    assert not finding.spoils
    (panel,) = finding.panels
    (curve,) = panel.curves
    assert curve.t.size == 31
    assert finding.marks == (pytest.approx(curve.t[15]),)
    assert round(curve.t[15] / DT) in fast
    assert [f for f in clock(x=doubled(fast[:2])) if f.kind == "doubled"] == []
    # a row that only one of them repeats was not written twice
    assert [f for f in clock(x=doubled(fast), y=np.sin(5 * T)) if f.kind == "doubled"] == []


@pytest.mark.parametrize(("every", "spoilt"), [(31, True), (37, False)])
def test_more_than_three_doubled_rows_in_a_hundred_spoil_a_record(every, spoilt):
    t = np.arange(1000) * DT
    x = 5 * t + 0.1 * t**2
    rows = np.arange(20, 980, every)
    x[rows] = x[rows - 1]
    (finding,) = [f for f in clock(x=x) if f.kind == "doubled"]
    assert finding.spoils == spoilt
    assert finding.evidence["doubled rows [1]"] == rows.size


def test_a_clock_that_starts_again_is_cut_at_its_reset_and_the_longest_piece_is_read(tmp_path):
    t = 0.01012347 * np.concatenate([np.arange(40), np.arange(60)])
    x = np.arange(100.0)
    t[70] = t[69]
    log = tmp_path / "log.csv"
    log.write_text("t [s],x [m]\n" + "".join(f"{a:.8f},{b:.6f}\n" for a, b in zip(t, x, strict=True)), "utf-8")
    record, (reset, repeat) = read_mended(log)
    rows = [k for k in range(40, 100) if k != 70]
    assert record.t == pytest.approx(t[rows])
    assert record["x [m]"] == pytest.approx(x[rows])
    assert reset.evidence == pytest.approx({"resets [1]": 1, "back by [s]": t[39]})
    assert reset.sentence == (
        "The clock starts again 1 time: row 41 is at 0 s after 0.394815 s. Only rows 41 to 100 are looked at below."
    )
    assert repeat.evidence == pytest.approx({"repeated instants [1]": 1, "equal rows [1]": 0})
    assert repeat.advice == "Which row holds? The first was kept below."
    assert "(first at 0.293581 s)" in repeat.sentence
    curve = reset.panels[0].curves[0]
    assert (curve.t[41], curve.y[41]) == pytest.approx((41.0, t[41]))


@pytest.mark.parametrize(("equal", "advice"), [(0, "Which row holds?"), (1, "Drop them"), (2, "Drop them")])
def test_rows_of_one_instant_are_compared_with_the_row_before_them(equal, advice, tmp_path):
    """Rows 21 and 51 repeat an instant; so many of them repeat their values too."""
    t, x = 0.01 * np.arange(80), np.arange(80.0) ** 2
    for i, k in enumerate((20, 50)):
        t[k] = t[k - 1]
        x[k] = x[k - 1] if i < equal else x[k]
    log = tmp_path / "log.csv"
    log.write_text("t [s],x [m]\n" + "".join(f"{a:.8f},{b:.6f}\n" for a, b in zip(t, x, strict=True)), "utf-8")
    _, found = read_mended(log)
    (repeat,) = [f for f in found if f.kind == "doubled"]
    assert repeat.evidence == pytest.approx({"repeated instants [1]": 2, "equal rows [1]": equal})
    assert repeat.advice.startswith(advice)


def test_steps_are_drawn_in_milliseconds_where_they_end():
    (curve,) = steps_panel(np.array([0.0, 0.01, 0.03])).curves
    assert curve.t.tolist() == [0.01, 0.03]
    assert curve.y == pytest.approx([10.0, 20.0])


def test_rows_of_one_instant_are_equal_when_the_second_repeats_the_first(tmp_path):
    """The second row is written twice; two rows of the instant after the next are not the same."""
    rows = [(0, 0.0), (1, 0.5), (1, 0.5), (2, 0.9), (3, 1.2), (3, 1.3), *((k, np.sin(0.1 * k)) for k in range(4, 100))]
    log = tmp_path / "log.csv"
    log.write_text("time [s],x [m]\n" + "".join(f"{0.01 * k:.2f},{x:.6f}\n" for k, x in rows), encoding="utf-8")
    record, (finding,) = read_mended(log)
    assert finding.evidence == {"repeated instants [1]": 2.0, "equal rows [1]": 1.0}
    assert len(record) == 100
