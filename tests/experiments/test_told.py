"""Is an experiment whole where it was not interrupted, and made with what its stand can do?"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.experiments.rigs import made
from upright.experiments.laboratory import EXPERIMENTS
from upright.experiments.stand.experiment import ExperimentInput
from upright.experiments.stand.known import Known
from upright.experiments.stand.live import LiveStand
from upright.experiments.stand.twin import TwinStand
from upright.report.page import Chapter
from upright.rig.makes import MAKES, make_rig

ROOM = "upright.experiments"
RUNS = {
    "1b": ("frequency_1b", ("run.run_frequency", "at_once.run_at_once"),
           ("chapter.chapter", "chapter.at_once_chapter")),
    "2": ("regulation_2", ("run.run_regulation",) * 2, ("chapter.chapter",) * 2),
    "2b": ("swing_up_2b", ("run.run_swing_up",) * 2, ("chapter.chapter",) * 2),
    "3": ("tracking_3", ("run.run_tracking", "run.track_on"), ("chapter.chapter",) * 2),
    "4": ("free_swing_4", ("run.run_free_swing", "by_hand.run_by_hand"), ("chapter.chapter", None)),
}  # fmt: skip
"""By experiment: its folder, what runs on a twin and on a live rig, and what tells it."""
PAGE = Chapter(title="t", verdict="v", numbers={"told": 1})


@pytest.fixture
def told(tmp_path, monkeypatch):
    """An experiment told of what is said to have come of it: its chapter, whether whole, and what was run with."""

    def tell(name, live, interrupted, earlier=None):
        folder, runs, chapters = RUNS[name]
        given = []
        fit = SimpleNamespace(interrupted=interrupted)
        result = SimpleNamespace(interrupted=interrupted, fit=fit, answers={})

        def run(*args, **more):
            given.append((args, more))
            return ("study", fit) if name == "4" and live else result

        for module in set(runs):
            where, what = module.split(".")
            expected = module == runs[live]
            monkeypatch.setattr(import_module(f"{ROOM}.{folder}.{where}"), what, run if expected else None)
        for module in filter(None, set(chapters)):
            where, what = module.split(".")
            monkeypatch.setattr(import_module(f"{ROOM}.{folder}.{where}"), what, lambda *_, **__: PAGE)
        monkeypatch.setattr(f"{ROOM}.stand.fits.fit_chapter", lambda *_: PAGE)
        monkeypatch.setattr(ExperimentInput, "identified", lambda _self, stand: (stand.rig, stand.rig))
        monkeypatch.setattr(LiveStand, "described_by", lambda stand, fit, folder: stand)
        make = "torsional" if name == "3" else "furuta"
        text = f'kind = "twin"\nmake = "{make}"\nseed = 3\n'
        stand = made(tmp_path, text) if live else TwinStand(rig=make_rig(make, 3), make=MAKES[make])
        at = ExperimentInput(
            stand=stand, seed=3, folder=tmp_path, earlier=earlier or {"1b": PAGE}, folders={"1b": Path("1b")},
            progress=lambda step, share: None, stopped=lambda: interrupted,
        )  # fmt: skip
        return (*EXPERIMENTS[name].tell(at), given[0])

    return tell


@pytest.mark.parametrize("live", [False, True])
@pytest.mark.parametrize("name", RUNS)
def test_an_experiment_is_whole_where_it_was_not_interrupted(told, name, live):
    """A response by sines is whole, or it raises."""
    page, whole, _ = told(name, live, False)
    assert page is PAGE
    assert whole
    if (name, live) != ("1b", False):
        assert not told(name, live, True)[1]


def test_a_free_swing_takes_the_inertia_of_the_body_that_carries_it(told):
    """Of what 1a hands on, on a twin; of what 1b found, where a hand lifts it."""
    handed = {"k_12": {"value": 1.0, "stderr": 0.1}, "J_d": {"value": 0.01, "stderr": 1e-4}}
    inertia = Known(name="J_d", value=0.01, stderr=1e-4)
    weighed = replace(PAGE, numbers={"handed_on": handed})
    _, _, (_, more) = told("4", False, False, {"1a": weighed})
    assert more["weighed"] == inertia
    found = replace(PAGE, numbers={"parameters": handed})
    _, _, (args, _) = told("4", True, False, {"1b": found})
    assert args[-1] == (inertia,)
    assert told("4", False, False)[2][1]["weighed"] is None


def test_what_an_experiment_can_be_made_on_follows_from_the_rig(tmp_path):
    """A rig in a minute needs one at hand whose numbers are still to be found; a shaft no pendulum."""
    live = made(tmp_path)
    twin = TwinStand(rig=make_rig("furuta"), make=MAKES["furuta"])
    shaft = TwinStand(rig=make_rig("torsional"), make=MAKES["torsional"])
    known = replace(live, fit=Path("fit.json"))

    def on(stand):
        return [name for name, e in EXPERIMENTS.own.items() if e.on(stand)]

    assert on(live) == ["1b", "2", "2b", "4", "quick"]
    assert on(known) == ["2", "2b"]
    assert on(twin) == ["1b", "2", "2b", "4"]
    assert on(shaft) == ["1b", "3"]
