"""Does the page of a response say what was found, of which kind, in figures that can be computed again?"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from upright.experiments.frequency_1b.chapter import chapter, log_chapter
from upright.experiments.frequency_1b.run import LoggedResponse
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.model.fit import Estimate, Pole
from upright.report.page import Table

FALL, SWING = ("inverted", "unstable pole"), ("hanging", "mode")


def estimate(value: float, error: float = 0.0) -> Estimate:
    return Estimate(value=value, stderr=error, interval=(value - 2 * error, value + 2 * error), unit="1/s")


@pytest.fixture
def page_of(done):
    """The page where the number that matters is 5 1/s if the rig falls and 27 rad/s if it swings."""

    def made(kind=FALL, simplex=5.25 + 26.0j, make=done.make, data=done.answer.data, **squares):
        a = done.answer
        told = replace(
            a, key=(*kind, Pole(real=estimate(5.0, 0.005), imag=estimate(27.0, 0.005))), simplex_pole=simplex,
            simplex=replace(a.simplex, squares_dB=12.34, evaluations=567, seconds=0.891), data=data,
            squares=replace(a.squares, way=replace(a.squares.way, seconds=2.0), **squares),
        )  # fmt: skip
        return chapter(replace(done, answer=told, make=make))

    return made


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({}, "gives 5.250 1/s, 5 % more."),
        ({"simplex": 4.9 + 99j}, "gives 4.900 1/s, 2 % less."),
        ({"kind": SWING}, "gives 26.00 rad/s, 3.7 % less."),
        ({"kind": SWING, "simplex": 99 + 27.27j}, "gives 27.27 rad/s, 1 % more."),
        ({"simplex": complex(math.nan, 3.0)}, "ends at a rig without such a pole."),
        ({"kind": SWING, "simplex": complex(3.0, math.inf)}, "ends at a rig without such a pole."),
    ],
)
def test_the_simplex_is_held_against_the_real_part_where_it_falls_and_the_imaginary_where_it_swings(page_of, how, said):
    assert page_of(names=("J_p",), **how).detail.endswith(said)


@pytest.mark.parametrize(
    ("simplex", "names", "blamed"),
    [(5.25, ("b_1c",), True), (4.75, ("b_1c",), True), (5.04, ("b_1c",), False), (5.25, ("J_p",), False)],
)
def test_dry_friction_is_blamed_for_more_than_a_percent_where_there_is_any(page_of, simplex, names, blamed):
    page = page_of(simplex=complex(simplex, 0.0), names=names)
    assert ("dry friction passes for viscous friction" in page.detail) == blamed


@pytest.mark.parametrize(("kind", "unit", "walked", "found"), [
    (FALL, "1/s", "5.250", "5.0000"), (SWING, "rad/s", "26.00", "27.0000"),
])  # fmt: skip
def test_both_ways_stand_side_by_side_with_the_number_that_matters(page_of, kind, unit, walked, found):
    """Its interval of 0.02 is a 250th of 5 and a 1350th of 27: five and six digits show the ends apart."""
    page = page_of(kind)
    table, *_ = [b for part in page.parts for b in part.content if isinstance(b, Table)]
    assert table.headings == ("", "dB²", "models", "s", f"{kind[1]} [{unit}]")
    assert table.rows[0] == ("simplex on dB", "12.3", "567", "0.89", walked)
    assert (table.rows[1][0], *table.rows[1][3:]) == ("least squares", "2.0", found)
    assert table.numbers == (1, 2, 3, 4)
    assert ("falls upright" in page.question) == (kind == FALL)


def first_of(page, title):
    return next(part for part in page.parts if part.title == title).content


def test_the_bench_is_told_with_its_tolerances_and_those_of_experiment_1a(page_of, done):
    """The rig model knows m_p to 0.2 % and l_cg to 0.3 %; what is not of the bench was weighed."""
    told = first_of(page_of(), "Parameters")[0]
    assert told.startswith("Known from the bench: m_p to 0.2 %, l_cg to 0.3 %. A response sees ")
    assert told.endswith("the unstable pole does not depend on it.")
    weighed = first_of(page_of(SWING, make=replace(done.make, bench={"m_p": 2e-3})), "Parameters")[0]
    assert weighed == (
        "Known from the bench: m_p to 0.2 %; from experiment 1a: l_cg to 0.3 %. "
        "The bench fixes the scale of masses, stiffness, frictions and gain."
    )


def test_a_rig_that_falls_is_designed_for_where_it_falls(page_of, done):
    data = replace(done.answer.data, hold=3.5e-3)
    gains, again, _ = (s.command for s in page_of(data=data).steps)
    assert "--at inverted --poles" in gains
    assert '--rig linear --hold "3.5 ms" -o again' in again
    assert "--lqr 1,0,1,0" in page_of(SWING).steps[0].command


def test_intervals_are_widened_where_the_errors_stated_were_too_small(page_of):
    told = first_of(page_of(reached=3, starts=8, misfit=2.25), "Parameters")[1]
    assert told.startswith("3 of 8 starts reached the same minimum. Chi square per degree of freedom is 2.2 ")
    assert "intervals are widened by its root" in told
    assert "widened" not in first_of(page_of(reached=8, starts=8, misfit=0.9), "Parameters")[1]


def logged(coherence: float = 0.95) -> LoggedResponse:
    """A mass on a spring at three frequencies, magnitude and phase of each known to 3 %."""
    omega = np.array([2.0, 5.0, 12.0])
    response = (1 / (25.5 - omega**2 + 0.4j * omega))[:, None]
    data = FrequencyResponse(
        omega=omega, response=response, outputs=("x",), units=("m", "V"), variance=2 * (0.03 * np.abs(response)) ** 2,
        coherence=np.array([[0.9876], [coherence], [coherence]]), distortion=np.full((3, 1), 0.01),
    )  # fmt: skip
    return LoggedResponse(sources=("a.csv", "b.csv"), response=data, answer=None, folder=Path("out"))


def test_a_response_is_tabled_in_decibels_degrees_and_percent():
    found = logged()
    told = log_chapter(found)
    (table,) = [b for part in told.parts for b in part.content if isinstance(b, Table)]
    assert table.headings == ("", "rad/s", "dB", "deg", "error [%]", "coherence")
    assert table.numbers == (1, 2, 3, 4, 5)
    columns = list(zip(*table.rows, strict=True))
    assert columns[0] == ("x",) * 3
    assert columns[5][0] == "0.9876"  # so near 1 three digits would not do
    values = [[float(v.replace("−", "-")) for v in column] for column in columns[1:]]
    response = found.response.response[:, 0]
    for column, expected in zip(values, (
        found.response.omega, 20 * np.log10(np.abs(response)), np.degrees(np.angle(response)),
        100 * found.response.error[:, 0], found.response.coherence[:, 0],
    ), strict=True):  # fmt: skip
        assert column == pytest.approx(expected, rel=5e-4, abs=1e-3)
    assert "3 frequencies from 2 to 12 rad/s in a.csv, b.csv." in told.parts[0].content[0]


@pytest.mark.parametrize(
    ("coherence", "share", "sound"), [(0.51, "3 of 3", True), (0.49, "1 of 3", True), (0.49, "", False)]
)
def test_magnitudes_are_known_where_half_of_the_power_follows_the_command(coherence, share, sound):
    found = logged(coherence)
    if not sound:
        found = replace(found, response=replace(found.response, coherence=np.full((3, 1), coherence)))
    told = log_chapter(found)
    assert told.sound == sound
    if sound:
        error = 100 * float(np.median(found.response.error[found.response.coherence >= 0.5]))
        assert f"({share} frequencies), magnitudes are known to {error:.1f} % (median" in told.verdict
    else:
        assert told.verdict.startswith("At no frequency does half of the power follow the command")
