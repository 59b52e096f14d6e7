"""Is the draft of a log the same whenever its clock began, whatever its units and whichever way round it is counted?"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.doctored import PLANTS, batch
from tests.alike import differences
from tests.study.draft.test_balanced import balanced
from tests.study.draft.test_release import lifted, swing
from upright.identification import Run
from upright.readers.inspection import inspect_record
from upright.records import Provenance, Record
from upright.study.draft.compare import explained
from upright.study.draft.draft import draft
from upright.study.load import Study, load_study
from upright.units import parse

DT = 2.0**-8
"""Sampling period [s]: sums of it and of whole seconds are exact."""
LATER = 1024.0
UNITS = {"rad": (180 / math.pi, "deg"), "m": (1000.0, "mm"), "V": (1000.0, "mV")}
CHAINS = "rectilinear-2", "torsional-2"
SPECIAL = {
    ("pendulum", "lifted by a hand"): lambda: {"theta": np.concatenate([lifted(1.2, 0.9, 1.5), swing(0.9)])},
    ("furuta", "balanced upright"): lambda: dict(zip(("psi", "theta", "u"), balanced(), strict=True)),
    ("torsional-2", "let go three times"): lambda: dict(zip(("theta_1", "theta_2"), let_go(), strict=True)),
}
CASES = [*((plant, k) for plant in PLANTS for k in range(3)), *SPECIAL]


def let_go() -> tuple[np.ndarray, np.ndarray]:
    """Two disks that swing as one after each of three releases; between them a hand turns them back."""
    t = DT * np.arange(1500)
    swung = 0.4 * np.exp(-0.4 * t) * np.cos(9.0 * t)
    turned = np.concatenate([np.full(100, 0.4), swung, np.linspace(swung[-1], 0.4, 150)])
    first = np.tile(turned, 3)
    return np.round(first / 1e-3) * 1e-3, np.round(1.3 * first / 1e-3) * 1e-3


@cache
def log(plant: str, k: int | str) -> Record:
    if isinstance(k, str):
        signals = SPECIAL[plant, k]()
        units = {n: "V" if n == "u" else "rad" for n in signals}
        t, origin = DT * np.arange(signals["theta" if "theta" in signals else "theta_1"].size), "log.csv"
        return Record(t=t, signals=signals, units=units, provenance=Provenance(file=origin, reader="table"))
    record = batch(plant, "", 3, seed=7)[k].record
    return replace(record, t=DT * np.arange(record.t.size), units={**record.units, "u": "V"})


def drafted(record: Record, plant: str) -> dict[str, Any]:
    return tomllib.loads(draft(record, inspect_record(record), Path("log.csv"), Path("study.toml"), plant=plant))


@cache
def study(plant: str, k: int | str) -> dict[str, Any]:
    return drafted(log(plant, k), plant)


def shares(record: Record) -> dict[str, float]:
    """What two plants explain of the accelerations of one angle."""
    plants = "pendulum", "torsional-1"
    texts = {p: draft(record, inspect_record(record), Path("log.csv"), Path("study.toml"), plant=p) for p in plants}
    return explained(record, texts, "log.csv")


def in_units(record: Record) -> Record:
    new = {n: UNITS[record.units[n]] for n in record.signals}
    signals = {n: new[n][0] * x for n, x in record.signals.items()}
    return replace(record, signals=signals, units={n: unit for n, (_, unit) in new.items()})


def changed(record: Record, change: Callable[[str, np.ndarray], np.ndarray]) -> Record:
    return replace(record, signals={n: change(n, x) for n, x in record.signals.items()})


def numbers(tables: dict[str, Any]) -> dict[str, float]:
    """Every number [SI] of a table by name, whichever role it has."""
    out: dict[str, float] = {}
    for name, entry in tables.items():
        for role, value in entry.items() if isinstance(entry, dict) else [("", entry)]:
            if not isinstance(value, bool):
                out[f"{name} {role}"] = parse(value) if isinstance(value, str) else float(value)
    return out


@pytest.mark.parametrize(("plant", "k"), CASES)
def test_a_draft_does_not_depend_on_when_the_clock_began(plant, k):
    record = log(plant, k)
    later = drafted(replace(record, t=record.t + LATER), plant)
    for run, before in zip(later["runs"], study(plant, k)["runs"], strict=True):
        assert np.subtract(run.pop("window"), before["window"]) == pytest.approx([LATER, LATER], abs=DT)
    here = {**study(plant, k), "runs": [{n: v for n, v in r.items() if n != "window"} for r in study(plant, k)["runs"]]}
    assert later == here


@pytest.mark.parametrize(("plant", "k"), CASES)
def test_a_draft_has_the_same_numbers_of_a_log_in_other_units(plant, k):
    here, other = study(plant, k), drafted(in_units(log(plant, k)), plant)
    for table in ("rig", "parameters", "actuator", "runs", "defaults"):
        assert other.get(table) == here.get(table)
    for name, sensor in here["sensors"].items():
        per, unit = UNITS[sensor["unit"]]
        theirs = other["sensors"][name]
        assert theirs["unit"] == unit
        assert theirs.get("offset", 0.0) == pytest.approx(per * sensor.get("offset", 0.0), rel=1e-6)
        assert theirs.get("counts_per_rev") == sensor.get("counts_per_rev")


def test_a_balanced_pendulum_in_counts_of_the_assumed_encoder_has_the_numbers_of_that_in_radians():
    """Of 4096 a turn, as its draft says; where it is kept up is half of them from where it hangs."""
    record, here = log("furuta", "balanced upright"), study("furuta", "balanced upright")
    signals = {n: x if n == "u" else np.round(x * 4096 / math.tau) for n, x in record.signals.items()}
    units = {n: "V" if n == "u" else "counts" for n in signals}
    other = drafted(replace(record, signals=signals, units=units), "furuta")
    for table in ("rig", "parameters", "actuator", "runs", "defaults"):
        assert other[table] == here[table]
    assert [s["counts_per_rev"]["value"] for s in other["sensors"].values()] == [4096, 4096]
    assert other["sensors"]["theta"]["offset"] == -2048


def loaded(record: Record, plant: str) -> Study:
    text = draft(record, inspect_record(record), Path("log.csv"), Path("study.toml"), plant=plant)
    return load_study(Path("study.toml"), text=text, records={"log.csv": record})


def common(run: Run, other: Run) -> tuple[Run, Run]:
    """Samples of both: five digits of a window may leave out its last sample, or its first."""
    first, last = max(run.t[0], other.t[0]), min(run.t[-1], other.t[-1])
    assert last - first > run.t[-1] - run.t[0] - 3 * DT
    return tuple(r.samples(slice(*np.searchsorted(r.t, [first, last + DT / 2]))) for r in (run, other))


@pytest.mark.parametrize(("plant", "k"), CASES)
def test_runs_are_the_same_on_another_clock_and_in_other_units(plant, k):
    """In SI, to the six digits with which a draft writes the zero of a sensor."""
    record = log(plant, k)
    here = loaded(record, plant)
    for away, other in ((LATER, replace(record, t=record.t + LATER)), (0.0, in_units(record))):
        study = loaded(other, plant)
        assert list(differences(here.model, study.model, rel=1e-5)) == []
        for ours, run in zip(here.runs, study.runs, strict=True):
            assert run.quanta == pytest.approx(ours.quanta, rel=0.006)  # three digits
            both = common(ours, replace(run, t=run.t - away, resolution=ours.resolution))
            found = differences(*both, rel=1e-6, near=1e-5 * float(np.ptp(ours.y)))
            assert [path for path in found if not path.startswith((".source", ".record"))] == []


@pytest.mark.parametrize(("plant", "k"), CASES)
def test_a_draft_is_that_of_the_rig_in_a_mirror(plant, k):
    """Equations of all these plants are odd, so a log with every sign turned is one of the same rig."""
    here, other = study(plant, k), drafted(changed(log(plant, k), lambda _, x: -x), plant)
    for table in ("rig", "parameters", "actuator", "runs", "defaults", "drive"):
        assert other.get(table) == here.get(table)
    for name, sensor in here["sensors"].items():
        apart = other["sensors"][name].get("offset", 0.0) + sensor.get("offset", 0.0)
        whole = 2 * math.pi if sensor["unit"] == "rad" else math.inf  # upright is half a turn either way
        assert math.remainder(apart, whole) == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize(("plant", "k"), [case for case in CASES if case != ("furuta", "balanced upright")])
def test_a_command_eight_times_as_large_is_an_eighth_of_the_gain_or_where_that_is_known_every_force(plant, k):
    here, other = study(plant, k), drafted(changed(log(plant, k), lambda n, x: 8 * x if n == "u" else x), plant)
    forces = 8.0 if plant in CHAINS and "drive" in here else 1.0
    expected = {
        n: v * (1.0 if n.startswith(("delta", "v_")) else forces) for n, v in numbers(here["parameters"]).items()
    }
    rounding = 0.011  # two numbers of three digits
    assert numbers(other["parameters"]) == pytest.approx(expected, rel=rounding)
    if plant not in CHAINS and "actuator" in here:
        gain = {n: v / 8 for n, v in numbers(here["actuator"]).items()}
        assert numbers(other["actuator"]) == pytest.approx(gain, rel=rounding)


def test_what_other_plants_explain_does_not_depend_on_clock_units_or_mirror():
    record = log("pendulum", 1)
    here = shares(record)
    assert here["pendulum"] > here["torsional-1"] > 0
    others = replace(record, t=record.t + LATER), in_units(record), changed(record, lambda _, x: -x)
    for other in others:
        assert shares(other) == pytest.approx(here, rel=1e-6)
