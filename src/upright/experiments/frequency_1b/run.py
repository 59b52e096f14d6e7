"""Experiment 1b: a frequency response of the hanging rig, fits to it, and the pole that the rig will fall by.

What was weighed and measured on the bench fixes the scale: a response alone sees masses, frictions and the drive's gain
only relative to each other. The unstable pole does not depend on that scale.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upright.control import ServoRig
from upright.experiments.frequency_1b.sweeps import Sweep, broadband, stepped_sine
from upright.experiments.makes import Make, make_of, make_rig
from upright.experiments.weighing_1a.run import Known
from upright.identification import Parameter
from upright.identification import Rig as Asked
from upright.identification.frequency.answer import Answer, explain
from upright.progress import Progress, silent
from upright.study.results import write_response_fit

LAG = 1e-3
"""First guess of the drive's time constant [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyRun:
    """The experiment on one rig.

    Attributes
    ----------
    rig : ServoRig
        The twin, which knows the truth.
    make : Make
    sweep : Sweep
    answer : Answer
    folder : Path
        Holds `frequency.csv`, `sweep.csv` and `fit.json`.
    kind : str
        How it was asked: sines, multisine or sweep.
    seconds : float
        Time at the computer [s].
    """

    rig: ServoRig
    make: Make
    sweep: Sweep
    answer: Answer
    folder: Path
    kind: str
    seconds: float

    @property
    def truth(self) -> Mapping[str, float]:
        """What only a twin knows, `actuator.*` included."""
        return {**self.rig.plant.parameters(), **self.rig.drive}


def bench(rig: ServoRig, make: Make) -> dict[str, float]:
    """What the bench says of the numbers that it tells, each off by its tolerance; exact for the rig as designed."""
    rng = np.random.default_rng([rig.seed, 43])
    true = rig.plant.parameters()
    off = rng.normal(size=len(make.bench)) * (rig.seed > 0)
    return {n: true[n] * (1 + s * z) for (n, s), z in zip(make.bench.items(), off, strict=True)}


def asked(make: Make, known: Mapping[str, float], tolerance: Mapping[str, float]) -> Asked:
    """What a fit may know about a rig of a make: the design's numbers as guesses, and what is known, how well."""
    design, plant = make_rig(make.key), type(make.plant)
    parameters: dict[str, Parameter] = {}
    for name, value in make.plant.parameters().items():
        weighed, what = name in known, plant.quantity(name)
        parameters[name] = Parameter(
            name=name, unit=what.unit, meaning=what.meaning, value=known.get(name, value), lower=0.0,
            estimate=name in make.sought and not weighed,
            uncertainty=tolerance.get(name, 0.0) * known[name] if weighed else 0.0,
        )  # fmt: skip
    for name, value, unit, sought, meaning in (
        ("actuator.gain", make.gain, make.gain_unit, True, "force per unit of command"),
        ("actuator.delay", design.delay, "s", False, "dead time"),
        ("actuator.lag", LAG, "s", True, "first-order lag"),
    ):
        parameters[name] = Parameter(name=name, value=value, unit=unit, meaning=meaning, estimate=sought, lower=0.0)
    return Asked(plant=plant, parameters=parameters)


def run_frequency(
    rig: ServoRig | str,
    seed: int,
    folder: Path,
    progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False,
    *,
    weighed: Sequence[Known] = (),
    kind: str = "sines",
) -> FrequencyRun:
    """Sweep one rig of a make, fit it, and leave `frequency.csv`, `sweep.csv` and `fit.json` in a folder.

    Parameters
    ----------
    rig : ServoRig or str
        A rig of a make, or the make of which `seed` is taken.
    seed : int
    folder : Path
    progress, stopped : callables
        Told the step at work and the share done; asked between two steps whether to stop.
    weighed : sequence of Known
        What experiment 1a found; it joins what the bench says.
    kind : {"sines", "multisine", "sweep"}

    Raises
    ------
    KeyboardInterrupt
        When `stopped` says so.
    """
    began = time.perf_counter()
    rig = make_rig(rig, seed) if isinstance(rig, str) else rig
    make = make_of(rig.plant)
    progress("sweeping the rig", 0.0)
    sweep = stepped_sine(rig, make) if kind == "sines" else broadband(rig, make, kind, seed=seed)
    if stopped():
        raise KeyboardInterrupt
    said, tolerance = bench(rig, make), dict(make.bench)
    for k in weighed:
        said[k.name], tolerance[k.name] = k.value, k.stderr / k.value
    at = next(iter(rig.plant.equilibria))

    def follow(step: str, share: float) -> None:
        progress(step, 0.3 + (0.25 * share if "least" in step else 0.4))

    answer = explain(asked(make, said, tolerance), at, sweep.response, seed=seed, tell=follow, stopped=stopped)
    progress("writing the log and the fit", 0.9)
    write_response_fit(answer, folder, make.plant_name, f"Frequency response of {rig.name}, seed {rig.seed}")
    sweep.log.to_csv(folder / "sweep.csv")
    progress("done", 1.0)
    return FrequencyRun(
        rig=rig, make=make, sweep=sweep, answer=answer, folder=folder, kind=kind, seconds=time.perf_counter() - began,
    )  # fmt: skip
