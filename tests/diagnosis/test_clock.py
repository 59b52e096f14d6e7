"""Gaps, jitter and rounded stamps of a log are told by what is missing from it."""

from __future__ import annotations

import numpy as np
import pytest

from upright.diagnosis import Finding, examine
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
