"""Does the page of a response say what was found, of which kind, in figures that can be computed again?"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from upright.experiments.frequency_1b.chapter import (
    _bench,
    _simplex_sentence,
    _start_sentence,
    _steps,
    _way_table,
    log_chapter,
)
from upright.experiments.frequency_1b.run import LoggedResponse
from upright.identification.frequency.fitting import Way
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.model.fit import Estimate, Pole
from upright.physics import find
from upright.report.page import Table
from upright.rig.makes import MAKES

FALL, SWING = ("inverted", "unstable pole"), ("rest", "mode")
COULOMB = find("furuta").joints[0].coulomb


def estimate(value: float, error: float = 0.0) -> Estimate:
    return Estimate(value=value, stderr=error, interval=(value - 2 * error, value + 2 * error), unit="1/s")


def way(name: str, **how: float) -> Way:
    found = {"squares_dB": 12.34, "evaluations": 567, "seconds": 0.891} | how
    return Way(name=name, values={}, model=np.zeros((1, 1), dtype=complex), **found)


def answer(kind=FALL, real=5.0, imag=27.0, simplex=5.25 + 26.0j, names=(), parameters=None, **squares):
    """What a fit of a Furuta pendulum came to; the number that matters is the real part where it falls."""
    return SimpleNamespace(
        key=(*kind, Pole(real=estimate(real, 0.005), imag=estimate(imag, 0.005))), simplex_pole=simplex,
        squares=SimpleNamespace(names=names, way=way("least squares", seconds=2.0), **squares), simplex=way("simplex"),
        rig=SimpleNamespace(plant=find("furuta"), parameters=parameters or {}), data=SimpleNamespace(hold=3.5e-3),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({}, "says 5.250, 5 % more."),
        ({"simplex": 4.9 + 99j}, "says 4.900, 2 % less."),
        ({"kind": SWING}, "says 26.00, 3.7 % less."),
        ({"kind": SWING, "simplex": 99 + 27.27j}, "says 27.27, 1 % more."),
        ({"simplex": complex(math.nan, 3.0)}, "ends at a rig without such a pole."),
        ({"kind": SWING, "simplex": complex(3.0, math.inf)}, "ends at a rig without such a pole."),
    ],
)
def test_the_simplex_is_held_against_the_real_part_where_it_falls_and_the_imaginary_where_it_swings(how, said):
    assert _simplex_sentence(answer(**how)).endswith(said)


@pytest.mark.parametrize(
    ("simplex", "names", "blamed"),
    [(5.25, (COULOMB,), True), (4.75, (COULOMB,), True), (5.04, (COULOMB,), False), (5.25, ("J_p",), False)],
)
def test_dry_friction_is_blamed_for_more_than_a_percent_where_there_is_any(simplex, names, blamed):
    sentence = _simplex_sentence(answer(simplex=complex(simplex, 0.0), names=names))
    assert ("dry friction has to pass for viscous friction" in sentence) == blamed


@pytest.mark.parametrize(("kind", "unit", "walked", "found"), [
    (FALL, "1/s", "5.250", "5.0000"), (SWING, "rad/s", "26.00", "27.0000"),
])  # fmt: skip
def test_both_ways_stand_side_by_side_with_the_number_that_matters(kind, unit, walked, found):
    """Its interval of 0.02 is a 250th of 5 and a 1350th of 27: five and six digits show the ends apart."""
    table = _way_table(answer(kind))
    assert table.headings == ("", "dB²", "models", "s", f"{kind[1]} [{unit}]")
    assert table.rows == (("simplex", "12.3", "567", "0.89", walked), ("least squares", "12.3", "567", "2.0", found))
    assert table.numbers == (1, 2, 3, 4)


def test_the_bench_is_told_with_its_tolerances_and_those_of_experiment_1a():
    known = {
        "J_d": SimpleNamespace(value=4e-3, uncertainty=2e-5), "m_p": SimpleNamespace(value=0.1, uncertainty=2e-4),
        "g": SimpleNamespace(value=9.81, uncertainty=None),
    }  # fmt: skip
    make = SimpleNamespace(bench={"m_p": 2e-3, "r": 3e-3})
    told = _bench(SimpleNamespace(make=make, answer=answer(parameters=known)))
    assert told.startswith("Known from the bench: m_p to 0.2 %, r to 0.3 %; from experiment 1a: J_d to 0.5 %. ")
    assert told.endswith("the unstable pole does not depend on it.")
    swings = _bench(SimpleNamespace(make=make, answer=answer(SWING)))
    assert swings == (
        "Known from the bench: m_p to 0.2 %, r to 0.3 %; it fixes the scale of masses, stiffness, frictions and gain."
    )


def test_a_rig_that_falls_is_designed_for_where_it_falls(tmp_path):
    def commands(kind):
        return [s.command for s in _steps(SimpleNamespace(answer=answer(kind), folder=tmp_path, make=MAKES["furuta"]))]

    gains, again, _ = commands(FALL)
    assert "--at inverted --poles" in gains
    assert '--rig furuta --hold "3.5 ms" -o again' in again
    assert "--lqr 1,0,1,0" in commands(SWING)[0]


def test_intervals_are_widened_where_the_errors_stated_were_too_small():
    told = _start_sentence(answer(reached=3, starts=8, misfit=2.25))
    assert told.startswith("3 of 8 starts reached the same minimum; chi square per degree of freedom 2.2 ")
    assert "by whose root intervals are widened" in told
    assert "widened" not in _start_sentence(answer(reached=8, starts=8, misfit=0.9))


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
        assert told.verdict == "Nowhere does half of the power follow the command: this log tells no response."
