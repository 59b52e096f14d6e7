"""Experiment 1b: a frequency response of the hanging rig, fits to it, and the pole that the rig will fall by.

What was weighed and measured on the bench fixes the scale: a response alone sees masses, frictions and the drive's gain
only relative to each other. The unstable pole does not depend on that scale. The same from logs, a study or a
file, for a rig of one's own.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright import units
from upright.errors import BadInput, nearest
from upright.experiments.frequency_1b.sweeps import Sweep, broadband, stepped_sine
from upright.experiments.stand.known import Known, bench_values, model_of
from upright.identification import GreyBox
from upright.identification.frequency.answer import FrequencyFit, explain
from upright.identification.frequency.fitting import nonlinear_friction
from upright.identification.frequency.response import FrequencyResponse, is_response
from upright.identification.frequency.spectra import response_of
from upright.identification.frequency.table import is_table, response_of_table
from upright.identification.model.fit import Fit
from upright.physics import Plant
from upright.progress import Progress, silent
from upright.records import Record
from upright.rig import Rig
from upright.rig.hardware import Hardware
from upright.rig.makes import Make, hardware_of_make, make_named, make_of, make_rig
from upright.signals.steps import smallest_step
from upright.study.load import load_study
from upright.study.results import write_response_fit


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyRun:
    """The experiment on one rig.

    Attributes
    ----------
    rig : Rig
        The twin, which knows the truth.
    folder : Path
        Holds `frequency.csv`, `sweep.csv` and `fit.json`.
    kind : str
        Excitation: sines, multisine or sweep.
    seconds : float
        Time at the computer [s].
    """

    rig: Rig
    make: Make
    sweep: Sweep
    answer: FrequencyFit
    folder: Path
    kind: str
    seconds: float

    @property
    def truth(self) -> Mapping[str, float]:
        """What only a twin knows, `actuator.*` included."""
        return {**self.rig.plant.parameters(), **self.rig.drive}


def run_frequency(
    rig: Rig | str,
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
    rig : Rig or str
        A rig of a make, or the make of which `seed` is taken.
    progress, stopped : callables
        Called with the current step and the share completed; asked between two steps whether to stop.
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
    known, tolerance = bench_values(rig, make), dict(make.bench)
    for k in weighed:
        known[k.name], tolerance[k.name] = k.value, k.stderr / k.value
    at = next(iter(rig.plant.equilibria))

    def follow(step: str, share: float) -> None:
        progress(step, 0.3 + (0.25 * share if "least" in step else 0.4))

    answer = explain(model_of(make, known, tolerance), at, sweep.response, seed=seed, tell=follow, stopped=stopped)
    progress("writing the log and the fit", 0.9)
    title = f"Frequency response of {rig.name}, seed {rig.seed}"
    write_response_fit(answer, folder, make.plant_name, title, known_hardware=hardware_of_make(rig))
    sweep.log.to_csv(folder / "sweep.csv")
    progress("done", 1.0)
    return FrequencyRun(
        rig=rig, make=make, sweep=sweep, answer=answer, folder=folder, kind=kind, seconds=time.perf_counter() - began,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class LogRequest:
    """How sources are to be read; SI units.

    Attributes
    ----------
    make : str, optional
        Whose design gives plant and guesses, or a study whose rig does, its runs aside; None for a response without a
        fit, or when the study of the logs says it.
    command : str, optional
        Column of the command; the log's own when omitted.
    signals : mapping of str to str
        Column by coordinate; as the log names them when empty.
    counts : mapping of str to float
        Counts per rad or m by coordinate, negative when they count the other way.
    kind : str, optional
        Excitation; recognised from the command when omitted.
    hold : float, optional
        Time for which the converter holds a command [s].
    band : (float, float)
        Frequencies to keep [rad/s].
    known : mapping of str to (float, float)
        Value and standard uncertainty [SI] of what is known.
    seed : int
        Of the starts.
    """

    make: str | None = None
    command: str | None = None
    signals: Mapping[str, str]
    counts: Mapping[str, float]
    kind: str | None = None
    hold: float | None = None
    band: tuple[float, float] | None = None
    known: Mapping[str, tuple[float, float]]
    seed: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class LoggedResponse:
    """A response and, when the rig is known, what follows from it; `sources` are the files' names."""

    sources: tuple[str, ...]
    response: FrequencyResponse
    answer: FrequencyFit | None
    folder: Path


def response_of_logs(
    sources: Sequence[Path | FrequencyResponse], request: LogRequest, folder: Path, *, data: Path | None = None,
    tell: Progress = silent,
) -> LoggedResponse:  # fmt: skip
    """Response of the sources, fitted when plant and numbers are named; writes `frequency.csv` and `fit.json`.

    Parameters
    ----------
    sources : sequence of Path or FrequencyResponse
        One study, one response, or logs that repeat one another.
    data : Path, optional
        Folder of a study's logs.
    tell : Progress
        Called with the current step.
    """
    rest: GreyBox | None = None
    plant, hardware = "", Hardware()
    first, files = sources[0], [s for s in sources if isinstance(s, Path)]
    if len(files) < len(sources) > 1:
        raise BadInput("A frequency response stands alone: hand over one, or the logs that it would come from.")
    if isinstance(first, FrequencyResponse):
        response = _between(first, request.band)
    elif len(files) == 1 and first.suffix == ".toml":
        rest, plant, records, resolution, hardware = _study(first, data)
        response = response_of(records, command="u", outputs=records[0].outputs, kind=request.kind, hold=request.hold,
                               resolution=resolution, band=request.band)  # fmt: skip
    elif len(files) == 1 and is_response(first):
        response = _between(FrequencyResponse.from_csv(first), request.band)
    elif len(files) == 1 and is_table(first):
        response = _between(_table(first, request), request.band)
    else:
        response = _logs(files, request)
    if request.make and rest is None and request.make.endswith(".toml"):
        study = load_study(request.make, runs=False)
        rest, plant, hardware = study.model, study.plant, study.hardware
    elif request.make and rest is None:
        make = make_named(request.make)
        rest, plant, hardware = _designed(request, make), make.plant_name, Hardware(vendor=make.vendor)
    folder.mkdir(parents=True, exist_ok=True)
    names = tuple(s.name for s in files) or ("a response",)
    if rest is None:
        response.to_csv(folder / "frequency.csv")
        return LoggedResponse(sources=names, response=response, answer=None, folder=folder)
    at = next(iter(rest.plant.equilibria))
    response = _of_coordinates(response, rest.plant)
    unsized = () if response.drive.all() else _dry_friction(rest)
    answer = explain(_without(unsized, rest), at, response, seed=request.seed, tell=tell)
    if unsized:
        answer = replace(answer, fit=_unsized(answer.fit, unsized))
    write_response_fit(answer, folder, plant, "Frequency response", ", ".join(names), hardware)
    return LoggedResponse(sources=names, response=response, answer=answer, folder=folder)


def _between(response: FrequencyResponse, band: tuple[float, float] | None) -> FrequencyResponse:
    low, high = band or (0.0, np.inf)
    return response.only((response.omega >= low) & (response.omega <= high))


def _table(path: Path, request: LogRequest) -> FrequencyResponse:
    """Response of somebody else's table, in rad or m where it is in counts."""
    response = response_of_table(path, request.signals)
    counts = np.array([request.counts.get(n, 1.0) for n in response.outputs])
    return replace(
        response, response=response.response / counts, variance=response.variance / counts**2, hold=request.hold or 0.0
    )


def _of_coordinates(response: FrequencyResponse, plant: type[Plant]) -> FrequencyResponse:
    """The response, its output named for the coordinate of a plant that has but one."""
    names = [c.name for c in plant.coordinates]
    if len(names) == len(response.outputs) == 1:
        return replace(response, outputs=tuple(names))
    for name in response.outputs:
        if name not in names:
            raise BadInput(
                f"'{name}' is no coordinate of {plant.__name__} ({', '.join(names)}); say whose response it is: "
                f"--signal {names[-1]}=COLUMN."
            )
    return response


def _dry_friction(rig: GreyBox) -> tuple[str, ...]:
    """Friction that is sought and that a response shows only beside the size of the motion."""
    nonlinear = nonlinear_friction(rig.plant)
    return tuple(n for n, p in rig.parameters.items() if n in nonlinear and p.estimate)


def _without(names: Sequence[str], rig: GreyBox) -> GreyBox:
    left = {n: replace(rig.parameters[n], value=0.0, estimate=False) for n in names}
    return replace(rig, parameters={**rig.parameters, **left})


def _unsized(fit: Fit, names: Sequence[str]) -> Fit:
    """The fit with the reservation that dry friction passed for viscous friction in it."""
    reservation = (
        f"Not to be relied on: the size of the command is not stated, so dry friction ({', '.join(names)}) was not "
        "sought and passes for viscous friction; leave it out of the study if the rig has none."
    )
    return replace(fit, verdict=f"{reservation} {fit.verdict}", trusted=False)


def _designed(request: LogRequest, make: Make) -> GreyBox:
    """Numbers of a make: nominal where not specified, known within a tolerance where a bench usually measures them."""
    values = make.rig.plant.parameters()
    for name in request.known:
        if name not in (*values, "actuator.gain", "actuator.delay", "actuator.lag"):
            raise BadInput(f"'{request.make}' has no number '{name}'; {nearest(name, values)}")
    known = {n: values[n] for n in make.bench} | {n: v for n, (v, _) in request.known.items() if n in values}
    tolerance = dict(make.bench) | {n: u / v if v else 0.0 for n, (v, u) in request.known.items()}
    rest = model_of(make, known, tolerance)
    changed = {
        n: replace(rest.parameters[n], value=v, uncertainty=u, estimate=False)
        for n, (v, u) in request.known.items() if n not in values
    }  # fmt: skip
    return replace(rest, parameters={**rest.parameters, **changed})


def _study(path: Path, data: Path | None) -> tuple[GreyBox, str, list[Record], list[float], Hardware]:
    study = load_study(path, data=data)
    runs = [r for r in study.runs if r.role == "fit"]
    if not runs or any(r.measured != runs[0].measured for r in runs):
        raise BadInput(f"{path} needs fitted runs that measure the same coordinates.")
    records: list[Record] = []
    for run in runs:
        columns = {"u": run.u[:, 0], **{n: run.y[:, j] for j, n in enumerate(run.measured)}}
        units = {c.name: c.unit for c in study.model.plant.coordinates if c.name in run.measured}
        records.append(Record(t=run.t, signals=columns, units=units, inputs=("u",), outputs=run.measured))
    return study.model, study.plant, records, list(runs[0].quanta), study.hardware


def _logs(sources: Sequence[Path], request: LogRequest) -> FrequencyResponse:
    from upright.readers import read

    records = [read(path) for path in sources]
    first = records[0]
    command = _column(first, request.command or (first.inputs[0] if len(first.inputs) == 1 else ""))
    if not command:
        raise BadInput(
            f"A response needs the column that drives; the log holds the columns {', '.join(first.names)}; say which "
            "one drives with --command."
        )
    signals = {n: _column(first, c) for n, c in request.signals.items()}
    signals = signals or {n: n for n in first.outputs or [n for n in first.names if n != command]}
    for name in request.counts:
        if name not in signals:
            raise BadInput(f"--counts names '{name}', which is no output; {nearest(name, signals)}")
    scaled = [_scaled(r, command, signals, request) for r in records]
    resolution = [smallest_step(scaled[0][n]) for n in signals]
    return response_of(scaled, command=command, outputs=list(signals), kind=request.kind, hold=request.hold,
                       resolution=resolution, band=request.band)  # fmt: skip


def _column(record: Record, name: str) -> str:
    """A column by its name, or by its name without the unit that stands in brackets behind it."""
    bare = [n for n in record.names if re.sub(r"\s*[\[(][^\[(]*[\])]$", "", n) == name]
    return bare[0] if name not in record.names and len(bare) == 1 else name


def _scaled(record: Record, command: str, signals: Mapping[str, str], request: LogRequest) -> Record:
    columns = {command: record[command]}
    si_units = {command: record.units.get(command, "")}
    for name, column in signals.items():
        unit = record.units.get(column, "")
        si = next((s for s in ("rad", "m") if unit and units.known(unit) and units.same_dimension(unit, s)), "")
        if name in request.counts:
            columns[name], si_units[name] = (
                record[column] / request.counts[name],
                "m" if name.startswith("x") else "rad",
            )
        elif si and unit != "counts":
            columns[name], si_units[name] = record[column] * units.scale(unit), si
        elif request.make and unit == "counts":
            raise BadInput(
                f"Column '{column}' is in counts, and the fit needs rad or m: say how many make one, as in --counts "
                f"{name}=2546.5 (negative when it counts the other way)."
            )
        else:
            columns[name], si_units[name] = record[column], unit
    return Record(t=record.t, signals=columns, units=si_units, inputs=(command,), outputs=tuple(signals),
                  provenance=record.provenance)  # fmt: skip
