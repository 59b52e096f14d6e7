"""How does experiment 1b go? Sweep the hanging rig, fit what it answers, and know the pole it will fall by.

What was weighed and measured on the bench fixes the scale: a response alone sees masses, frictions and the drive's gain
only relative to each other. The unstable pole does not depend on that scale.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upright.control import Rig
from upright.identification import Parameter
from upright.identification import Rig as Asked
from upright.identification.frequency.answer import Answer, explain
from upright.lab.frequency_1b.broadband import ask
from upright.lab.frequency_1b.sweeps import Sweep, stepped_sine
from upright.lab.rigs.makes import MAKES, PLANTS, Make, make_rig
from upright.lab.weighing_1a.run import Known
from upright.progress import Progress
from upright.study.fit_file import write_response_fit

BAND: Mapping[str, tuple[float, float]] = {
    "linear": (5.0, 45.0),
    "furuta": (3.0, 35.0),
    "rectilinear": (6.0, 70.0),
    "torsional": (4.0, 70.0),
}
"""Frequencies asked [rad/s]: below, dry friction holds the rig; above, it hardly moves."""

BENCH: Mapping[str, Mapping[str, float]] = {
    "linear": {"m_p": 2e-3, "l_cg": 3e-3},
    "furuta": {"m_p": 2e-3, "l_cg": 3e-3, "r": 3e-3},
    "rectilinear": {"m_2": 3e-3},
    "torsional": {"J_2": 1e-2},
}
"""What is weighed, balanced on an edge or ruled, and how well (relative standard deviation); it fixes the scale."""

SOUGHT: Mapping[str, tuple[str, ...]] = {
    "linear": ("m_c", "J_p", "b_1", "b_2", "b_1c", "b_2c"),
    "furuta": ("J_d", "J_p", "b_1", "b_2", "b_1c", "b_2c"),
    "rectilinear": ("m_1", "k_12", "c_1", "c_2", "f_1c", "f_2c"),
    "torsional": ("J_1", "k_12", "c_1", "c_2", "f_1c", "f_2c"),
}
LAG = 1e-3
"""First guess of the drive's time constant [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Result:
    """The experiment on one rig.

    Attributes
    ----------
    rig : Rig
        The twin, which knows the truth.
    make : str
    sweep : Sweep
    answer : Answer
    folder : Path
        Holds `frequency.csv`, `sweep.csv` and `fit.json`.
    kind : str
        How it was asked: sines, multisine or sweep.
    seconds : float
        Time at the computer [s].
    """

    rig: Rig
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


def bench(rig: Rig, make: str) -> dict[str, float]:
    """What the bench says about the numbers of `BENCH`, each off by its tolerance; exact for the rig as designed."""
    rng = np.random.default_rng([rig.seed, 43])
    true = rig.plant.parameters()
    off = rng.normal(size=len(BENCH[make])) * (rig.seed > 0)
    return {n: true[n] * (1 + s * z) for (n, s), z in zip(BENCH[make].items(), off, strict=True)}


def asked(make: str, known: Mapping[str, float], *, tolerance: Mapping[str, float] | None = None) -> Asked:
    """What a fit may know about a rig of a make: the design's numbers as guesses, and what the bench says."""
    design = make_rig(make)
    tolerance = BENCH[make] if tolerance is None else tolerance
    units = {n: design.plant.quantity(n) for n in design.plant.names()}
    parameters: dict[str, Parameter] = {}
    for name, value in design.plant.parameters().items():
        weighed = name in known
        parameters[name] = Parameter(
            name=name, unit=units[name].unit, meaning=units[name].meaning, value=known.get(name, value), lower=0.0,
            estimate=name in SOUGHT[make] and not weighed,
            uncertainty=tolerance.get(name, 0.0) * known[name] if weighed else 0.0,
        )  # fmt: skip
    source = design.plant.inputs[0]
    gain = f"{source.unit}/{design.unit}"
    for name, value, unit, sought, meaning in (
        ("actuator.gain", design.gain, gain, True, "force per unit of command"),
        ("actuator.delay", design.delay, "s", False, "dead time"),
        ("actuator.lag", LAG, "s", True, "first-order lag"),
    ):
        parameters[name] = Parameter(name=name, value=value, unit=unit, meaning=meaning, estimate=sought, lower=0.0)
    return Asked(plant=type(design.plant), parameters=parameters)


def run(
    rig: Rig | Make,
    seed: int,
    folder: Path,
    progress: Progress | None = None,
    stopped: Callable[[], bool] = lambda: False,
    *,
    weighed: Sequence[Known] = (),
    kind: str = "sines",
) -> Result:
    """Sweep one rig of a make, fit it, and leave `frequency.csv`, `sweep.csv` and `fit.json` in a folder.

    Parameters
    ----------
    rig : Rig or str
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
    tell = progress or (lambda step, share: None)
    rig = make_rig(rig, seed) if isinstance(rig, str) else rig
    make = make_of(rig)
    low, high = BAND[make]
    tell("sweeping the rig", 0.0)
    if kind == "sines":
        sweep = stepped_sine(rig, make_rig(make), low=low, high=high)
    else:
        sweep = ask(rig, make_rig(make), kind, low=low, high=high, seed=seed)
    if stopped():
        raise KeyboardInterrupt
    said, tolerance = bench(rig, make), dict(BENCH[make])
    for k in weighed:
        said[k.name], tolerance[k.name] = k.value, k.stderr / k.value
    at = next(iter(rig.plant.equilibria))

    def follow(step: str, share: float) -> None:
        tell(step, 0.3 + (0.25 * share if "least" in step else 0.4))

    answer = explain(
        asked(make, said, tolerance=tolerance), at, sweep.response, seed=seed, tell=follow, stopped=stopped
    )
    tell("writing the log and the fit", 0.9)
    write_response_fit(answer, folder, PLANT[make], f"Frequency response of {rig.name}, seed {rig.seed}")
    sweep.log.to_csv(folder / "sweep.csv")
    tell("done", 1.0)
    return Result(
        rig=rig, make=make, sweep=sweep, answer=answer, folder=folder, kind=kind, seconds=time.perf_counter() - began,
    )  # fmt: skip


def make_of(rig: Rig) -> Make:
    """Make of a rig."""
    return next(make for make in MAKES if type(PLANTS[make]) is type(rig.plant))


PLANT: Mapping[str, str] = {
    "linear": "cart-pendulum", "furuta": "furuta", "rectilinear": "rectilinear-2", "torsional": "torsional-2",
}  # fmt: skip
"""Plants as files name them."""
