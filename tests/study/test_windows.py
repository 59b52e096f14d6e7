"""Is it said how much of a log counts? Shares by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import upright as up
from upright.report.page import Points
from upright.study.windows import window_sentence, windows
from upright.verbs import log as verbs


@pytest.mark.parametrize(
    ("parts", "sentence"),
    [
        ([("fit", 0.3, 49.8)], "Fits 0.3 to 49.8 s, 99 % of the record."),
        ([("fit", 5, 20), ("predict", 20, 30)], "Fits 5 to 20 s and predicts 20 to 30 s, 50 % of the record."),
        (
            [("fit", 10, 30), ("fit", 0, 20)],
            "Fits 0 to 20, 10 to 30 s, 60 % of the record.",
        ),  # what overlaps counts once
        ([("fit", 49.8, 50)], "Fits 49.8 to 50 s, 0.4 % of the record."),
    ],
)
def test_windows_are_told_with_their_share_of_the_record(parts, sentence):
    assert window_sentence(parts, 0.0, 50.0) == sentence


def test_instants_of_a_late_clock_are_told_apart():
    """A clock that counts from midnight: four digits of 50 000 s would be ten seconds."""
    assert window_sentence([("fit", 50_000.3, 50_049.8)], 50_000.0, 50_050.0) == (
        "Fits 50000.3 to 50049.8 s, 99 % of the record."
    )


def part_of(file, role, first, last, record):
    """A run that is a part of a log, whose source has the log's hash and what was done to it behind the name."""
    return SimpleNamespace(
        source=f"{file} (sha256 12ab); window {first} to {last}", role=role, t=np.array([first, last]), record=record
    )


def test_parts_of_one_log_are_told_together_and_every_log_by_its_name():
    """10 of 40 s and 8 of 20 s."""
    runs = [
        part_of("a.csv", "fit", 0.0, 4.0, (0.0, 40.0)), part_of("b.csv", "predict", 2.0, 10.0, (0.0, 20.0)),
        part_of("a.csv", "predict", 6.0, 12.0, (0.0, 40.0)),
    ]  # fmt: skip
    assert windows(runs) == (
        "a.csv: fits 0 to 4 s and predicts 6 to 12 s, 25 % of the record.",
        "b.csv: predicts 2 to 10 s, 40 % of the record.",
    )
    assert windows(runs[::2]) == ("Fits 0 to 4 s and predicts 6 to 12 s, 25 % of the record.",)


def crane_like(t):
    return {"x": 0.1 * np.sin(t), "theta": 0.3 * np.cos(6 * t), "v": np.sin(2 * t)}


STUDY = """
[rig]
plant = "pendulum"
[parameters]
m_p = 1.0
l_cg = { guess = "0.3 m" }
[sensors.theta]
column = "theta"
unit = "rad"
[[runs]]
label = "a"
file = "log.csv"
window = [10.0, 20.0]
[[runs]]
label = "b"
file = "log.csv"
window = [20.0, 30.0]
role = "predict"
"""


def test_a_study_tells_them_of_its_runs(study):
    t = np.arange(4001) * 0.01
    asked = study(STUDY, t=t, **crane_like(t))
    assert windows(asked.runs) == ("Fits 10 to 20 s and predicts 20 to 30 s, 50 % of the record.",)


def test_init_and_identify_print_them(tmp_path):
    t = np.arange(1001) * 0.01
    theta = 0.3 * np.exp(-0.05 * t) * np.cos(6 * t)
    still = np.full(1000, 0.3)  # a hand holds it for half of the record
    log = pd.DataFrame({"t": np.arange(2001) * 0.01, "theta": np.r_[still, theta]})
    draft = verbs.init(log, plant="pendulum")
    (sentence,) = (line for line in draft.value.splitlines() if line.startswith("# Fits"))
    assert sentence.endswith("50 % of the record.")
    printed = [s for p in draft.chapter.parts for b in p.content if isinstance(b, Points) for s in b.sentences]
    assert sentence.removeprefix("# ") in printed
    fit = up.identify(log, up.Pendulum)
    for chapter in (fit.chapter, fit.brief()):
        told = [s for p in chapter.parts for b in p.content if isinstance(b, Points) for s in b.sentences]
        assert any(s.startswith("Fits 1") and s.endswith("50 % of the record.") for s in told)
