"""A study file (TOML) read into a rig, its runs and the rungs of its ladder, in SI.

Every complaint is one sentence with file, line, what was expected and the nearest valid name.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput, nearest
from upright.identification import GreyBox, Run
from upright.identification.ladder.rungs import Rung
from upright.identification.model.grey_box import NOISE
from upright.identification.model.runs import FOR_GROUPS, PER_RUN, SPREADS
from upright.identification.problem.simulated import with_noise
from upright.physics import Plant
from upright.physics.actuator import ACTUATOR
from upright.records import Array, Record
from upright.rig import Hardware, Rig
from upright.study.clock import check_clock, counts_rows, with_time_unit
from upright.study.coordinates import Sensors
from upright.study.description import read_hardware, rig_with_guesses
from upright.study.keys import names
from upright.study.loop import Scene, read_loop, state_units
from upright.study.rig import known_values, read_plant, read_rig
from upright.study.sensors import Grid, drive_unit, read_drives, read_sensors, with_derived
from upright.study.text import Section, StudyText, as_written, in_si

PathLike = str | os.PathLike[str]


@dataclass(frozen=True, kw_only=True)
class Study:
    """A rig, its runs, and where they are written.

    Attributes
    ----------
    path : Path
        The study file.
    plant : str
        Plant as the study names it.
    title, source : str
        Heading and origin of the data, for the report; may be empty.
    sha256 : str
        Of the study's text.
    ladder : tuple of Rung
        Rungs that the study declares.
    hardware : Hardware
        Drive, encoders, servo and travel, as far as the study says.
    """

    path: Path
    plant: str
    model: GreyBox
    runs: tuple[Run, ...]
    title: str = ""
    source: str = ""
    sha256: str = ""
    ladder: tuple[Rung, ...] = ()
    hardware: Hardware = field(default_factory=Hardware)

    @property
    def rig(self) -> Rig:
        """The rig with the numbers of the study, its guesses counting as numbers."""
        return rig_with_guesses(self.model, self.plant, self.hardware)

    @property
    def provenance(self) -> dict[str, object]:
        """Where its numbers come from, for a page."""
        return {
            "study": self.path.name,
            "sha256 of the study": self.sha256,
            "data": self.source or "not stated",
            "runs": {run.label: run.source for run in self.runs},
        }

    def hold_out(self, *labels: str) -> Study:
        """The same study with some of its fitted runs predicted instead.

        Raises
        ------
        BadInput
            When a label names no run, or no run is left to fit.
        """
        for label in labels:
            if label not in {r.label for r in self.runs}:
                raise BadInput(f"no run is called '{label}'; {nearest(label, [r.label for r in self.runs])}")
        runs = tuple(replace(r, role="predict", refit=False) if r.label in labels else r for r in self.runs)
        if labels and all(r.role == "predict" for r in runs):
            raise BadInput(f"holding out {', '.join(labels)} leaves no run to fit; hold out fewer.")
        return replace(self, runs=runs)


def load_study(
    path: PathLike, *, data: PathLike | None = None, fixed: Mapping[str, float] | None = None,
    text: str | None = None, records: Mapping[str, Record] | None = None, plant: type[Plant] | None = None,
    runs: bool = True,
) -> Study:  # fmt: skip
    """Rig and runs that a study file describes.

    Parameters
    ----------
    path : path-like
        TOML file; see `docs/reference/study.md`.
    data : path-like, optional
        Folder that the runs' files are relative to; the study's own when omitted.
    fixed : mapping of str to float, optional
        Parameters [SI] of a model fitted before, ``actuator.*`` included: nothing is then estimated.
    text : str, optional
        The study itself, when it is in no file; `path` then only names it.
    records : mapping of file name to Record, optional
        Logs that are read already.
    plant : type of Plant, optional
        In the place of the one that the study names.
    runs : bool
        False for the rig alone: no log is read.

    Raises
    ------
    BadInput
        With file and line, when the study or a log cannot be used as it is.
    """
    path = Path(path)
    words = StudyText(path, text)
    study = words.root()
    study.check(names(""))
    plant = plant or read_plant(study)
    rig = read_rig(study, plant, drive_unit(study), fixed)
    folder = Path(data) if data is not None else path.parent
    logs = {(name, "", "", ""): with_derived(record, study) for name, record in (records or {}).items()}
    read = read_runs(study, plant, lambda run: _log(run, folder, logs, study)) if runs else ()
    hardware = read_hardware(study, plant, rig, [log.provenance.rig or "" for log in logs.values()])
    rig = with_noise(rig, read)
    if fixed is not None:
        levels = {n: p for n, p in rig.parameters.items() if n.startswith(NOISE)}
        known = {n: replace(p, value=fixed.get(n, p.value), estimate=False) for n, p in levels.items()}
        rig = replace(rig, parameters={**rig.parameters, **known})
    return Study(
        path=path,
        plant=study.section("rig").text_of("plant", "furuta"),
        model=rig,
        runs=read,
        title=study.text_of("title", "My rig") if "title" in study else "",
        source=study.text_of("source", "https://...") if "source" in study else "",
        ladder=read_ladder(study, plant),
        hardware=hardware,
        sha256=hashlib.sha256(words.text.encode()).hexdigest(),
    )


def _log(run: Section, folder: Path, logs: dict[tuple[str, ...], Record], study: Section) -> Record:
    """Record of the file a run names, read once."""
    from upright.readers import read

    name = run.text_of("file", "logs/run_01.csv")
    reader = run.text_of("reader", "csv") if "reader" in run else ""
    time = run.text_of("time", "t") if "time" in run else ""
    unit = run.text_of("time_unit", "ms") if "time_unit" in run else ""
    key = (name, reader, time, unit)
    if key not in logs:
        file = folder / name
        if not os.path.exists(file):  # Path.exists raises for a name that is too long
            raise run.error("file", f"the log {str(file)[-200:]} does not exist; {_instead(file, folder)}")
        with run.at("reader" if reader else "file"):
            record = read(file, reader=reader or None, counted=counts_rows(unit))
        with run.at("time_unit" if unit else "time"):
            record = with_time_unit(record.replace(t=record[time]) if time else record, unit)
        logs[key] = with_derived(record, study)
    return logs[key]


def _instead(file: Path, folder: Path) -> str:
    """Where the file may be instead."""
    from difflib import get_close_matches

    here = sorted(p.name for p in file.parent.iterdir() if p.is_file()) if os.path.isdir(file.parent) else []
    close = get_close_matches(file.name, here, n=1, cutoff=0.6)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"files are looked for in {folder}, and --data DIR names another folder"


def read_ladder(study: Section, plant: type[Plant]) -> tuple[Rung, ...]:
    """Rungs of a study, none when it has no [[ladder]]."""
    entries: Any = study.values.get("ladder", [])
    if not isinstance(entries, list):
        raise study.error("ladder", 'a ladder is a list of rungs: [[ladder]], then name = "Coulomb" below it')
    terms = (*plant.names(), *ACTUATOR)
    nuisances = (*PER_RUN, *sensor_nuisances(plant))
    sensors = read_sensors(study, Section(study.text, (), {}), plant).values()
    summed = {c for sensor, _ in sensors for c in sensor.of}
    rungs: list[Rung] = []
    for i, values in enumerate(entries):
        rung = Section(study.text, ("ladder", i), values)
        rung.check(names("ladder"))
        unknown = rung.names("unknown", nuisances)
        for kind, _, of in (name.partition(".") for name in unknown):
            if of in summed:
                raise rung.error("unknown", _not_alone(kind, of))
        rungs.append(
            Rung(
                name=rung.text_of("name", "Coulomb friction"),
                adds=rung.names("adds", terms),
                drops=rung.names("drops", terms),
                unknown=unknown,
            )
        )
    return tuple(rungs)


Log = Callable[[Section], Record]
_HORIZONS = 50  # each is a residual of its own for every sample of the run
_EPOCH = 1e6  # a time that starts beyond this many seconds counts from some epoch, so windows count from its start


def read_runs(study: Section, plant: type[Plant], log: Log) -> tuple[Run, ...]:
    """All runs of a study; `log` reads the file a run names."""
    entries: Any = study.values.get("runs")
    if not isinstance(entries, list) or not entries:
        raise study.error("runs", 'a study needs at least one run: [[runs]], then file = "log.csv" below it')
    shared = study.section("defaults")
    shared.check(names("defaults"))
    runs: list[Run] = []
    labels: dict[str, int] = {}
    for i, values in enumerate(entries):
        own = Section(study.text, ("runs", i), values)
        own.check(names("runs"))
        label = own.text_of("label", "swing 1") if "label" in own else Path(own.text_of("file", "log.csv")).stem
        if label in labels:
            key = "label" if "label" in own else "file"
            other = study.text.line(("runs", labels[label]))
            raise own.error(
                key, f"the label '{label}' is taken by the run on line {other}; give each run its own label"
            )
        labels[label] = i
        runs.append(read_run(study, own.over(shared), label, plant, log))
    return tuple(runs)


def read_run(study: Section, run: Section, label: str, plant: type[Plant], log: Log) -> Run:
    """One run."""
    record = log(run)
    if record.t[0] > _EPOCH:
        record = record.replace(t=record.t - record.t[0])
    with run.at("file"):
        check_clock(record)
    hash_of = record.provenance.sha256
    notes = [f"{Path(record.provenance.file or '').name}{f' (sha256 {hash_of[:12]})' if hash_of else ''}"]
    whole = float(record.t[0]), float(record.t[-1])
    if "window" in run:
        start, stop = _window(run, record)
        with run.at("window"):
            record = record.window(start, stop)
        notes.append(f"{start:g} to {stop:g} s")
    period = run.positive("period", "s", 1.0) if "period" in run else study.section("rig").number("period", "s", 0.0)
    with run.at("window" if "window" in run else "file"):
        grid = Grid.of(record.t, period)
    coordinates = {c.name: c for c in plant.coordinates}
    locked = _locked(run, plant)
    held_names = run.names("held", coordinates)
    readings: dict[str, Array] = {}
    quanta: dict[str, float] = {}
    sensors = read_sensors(study, run, plant)
    plant_sensors = Sensors(by_coordinate=sensors, locked=locked)
    _check_sums(run, plant_sensors, plant)
    wanted = run.names("measured", coordinates, tuple(n for n in sensors if n not in locked and n not in held_names))
    for name in (*wanted, *held_names):
        if name not in sensors:
            key = "measured" if name in wanted else "held"
            raise run.error(key, f'{name} has no sensor; add [sensors.{name}] with column = "..."')
        if name in locked:
            raise run.error("locked", f"{name} is locked in this run, so it is neither held nor measured")
        values, quanta[name], noticed = plant_sensors.read(record, name)
        readings[name] = grid.outputs(values)
        notes += noticed
    measured = tuple(n for n in coordinates if n in wanted and n not in held_names)
    if not measured:
        raise run.error(
            "measured" if "measured" in run else "file", _nothing_measured(plant, sensors, locked, held_names)
        )
    u = np.zeros((grid.t.size, len(plant.inputs)))
    drives = read_drives(study, run, plant)
    for k, drive in enumerate(drives):
        with run.text.at(drive.place):
            u[:, k] = grid.commands(drive.read(record))
    loop = None
    if "loop" in run:
        scene = Scene(
            plant=plant, record=record, grid=grid, coordinates=plant_sensors, drive=drives[0], unit=drive_unit(study),
            command=str(study.section("drive").values.get("column", "")),
        )  # fmt: skip
        loop = read_loop(run, scene)
    notes += [*grid.description(), *record.provenance.notes, *([loop.note] if loop and loop.note else [])]
    role: Any = run.choice("role", ("fit", "predict"), "fit")
    return Run(
        label=label,
        role=role,
        refit=run.flag("refit"),
        t=grid.t,
        u=u,
        y=np.column_stack([readings[n] for n in measured]),
        measured=measured,
        resolution=tuple(quanta[n] for n in measured),
        held={**locked, **{n: readings[n] for n in held_names}},
        known=known_values(run.section("known"), plant),
        unknown=run.names("unknown", (*PER_RUN, *sensor_nuisances(plant)), ("initial",)),
        shared={key: own.text_of(last, "28 Jan") for key, own, last in _nuisances(run, "shared", plant)},
        spread={key: own.positive(last, "1", 1.0) for key, own, last in _nuisances(run, "spread", plant)},
        initial=_states(run, plant),
        horizon=_horizon(run, grid),
        restart=_restart(run),
        score_from=_score_from(run, grid),
        loop=loop,
        repeats=run.text_of("repeats", "step 0.5 V") if "repeats" in run else None,
        source="; ".join(filter(None, notes)),
        record=whole,
    )


def _nothing_measured(plant: type[Plant], sensors: object, locked: object, held: object) -> str:
    if not sensors:
        name = plant.coordinates[0].name
        return f'nothing is measured: the study needs a table such as [sensors.{name}] with column = "..."'
    return "nothing is left to compare: every coordinate with a sensor is locked or held in this run"


def _window(run: Section, record: Record) -> tuple[float, float]:
    """First and last time of a run, inside the record."""
    value: Any = run.values["window"]
    first, last = float(record.t[0]), float(record.t[-1])
    if not isinstance(value, list) or len(value) != 2:
        raise run.error(
            "window", f"window must be two times in s, such as window = [1.0, 9.0], got {as_written(value)}"
        )
    with run.at("window"):
        start = first if value[0] == "start" else in_si(value[0], "s", "window")
        stop = last if value[1] == "end" else in_si(value[1], "s", "window")
        slack = record.period
        if not start < stop:
            raise BadInput(
                f"the window must start before it ends, got {start:g} to {stop:g} s; give start and end in s"
            )
        if start < first - slack or stop > last + slack:
            rest = start if first <= start < last else first
            raise BadInput(
                f"the window {start:g} to {stop:g} s must lie inside the record, from {first:g} to {last:g} s;"
                f' for the rest of it write window = [{rest:g}, "end"]'
            )
    return start, stop


def _locked(run: Section, plant: type[Plant]) -> dict[str, float]:
    coordinates = {c.name: c.unit for c in plant.coordinates}
    if isinstance(run.values.get("locked"), list | str):
        return dict.fromkeys(run.names("locked", coordinates), 0.0)
    section = run.section("locked")
    section.check(coordinates, f"coordinate of {plant.__name__} called")
    return {name: section.number(name, coordinates[name]) for name in section.values}


def sensor_nuisances(plant: type[Plant]) -> tuple[str, ...]:
    """Names of what sensors may leave unknown."""
    return tuple(f"{kind}.{c.name}" for kind in ("offset", "scale") for c in plant.coordinates)


def _nuisances(run: Section, key: str, plant: type[Plant]) -> list[tuple[str, Section, str]]:
    """Entries of a table by the name of a nuisance: name, table and key; ``scale.x`` may stand in quotes or not."""
    valid = (*FOR_GROUPS, *sensor_nuisances(plant))
    if key == "spread":
        valid = tuple(n for n in valid if n.partition(".")[0] in SPREADS)
    table = run.section(key)
    out: list[tuple[str, Section, str]] = []
    for name, value in table.values.items():
        inner = table.section(name) if isinstance(value, dict) else table
        entries = [(f"{name}.{last}", last) for last in inner.values] if inner is not table else [(name, name)]
        for whole, last in entries:
            if whole not in valid:
                raise inner.error(last, f"{key} has no '{whole}'; {nearest(whole, valid)}")
            out.append((whole, inner, last))
    return out


def _check_sums(run: Section, sensors: Sensors, plant: type[Plant]) -> None:
    """Refuse a zero or a scale of one sensor that several coordinates are read from."""
    listed = {"unknown": run.names("unknown", (*PER_RUN, *sensor_nuisances(plant)))}
    listed["shared"] = tuple(name for name, _, _ in _nuisances(run, "shared", plant))
    for key, wanted in listed.items():
        for kind, _, of in (name.partition(".") for name in wanted):
            if of and not sensors.one_sensor(kind, of):
                raise run.error(key, _not_alone(kind, of))


def _not_alone(kind: str, of: str) -> str:
    instead = "ask for offset, one of each coordinate" if kind == "offset" else "state the plant in what is measured"
    return f"{kind}.{of} is of one sensor, and a sensor here measures a sum with {of} in it; {instead}"


def _states(run: Section, plant: type[Plant]) -> dict[str, float]:
    section, states = run.section("initial"), state_units(plant)
    section.check(states, f"state of {plant.__name__} called")
    return {name: section.number(name, states[name]) for name in section.values}


def _horizon(run: Section, grid: Grid) -> float | tuple[float, ...] | None:
    value: Any = run.values.get("horizon", "free")
    if value == "free":
        return None
    listed: list[Any] = value if isinstance(value, list) else [value]
    with run.at("horizon"):
        horizons = [in_si(v, "s", "horizon") for v in listed]
    if len(horizons) > _HORIZONS:
        raise run.error(
            "horizon", f"horizon lists {len(horizons)} times, and {_HORIZONS} are the most; take a few of them"
        )
    step, length = grid.t[1] - grid.t[0], grid.t[-1] - grid.t[0]
    for horizon in horizons:
        if not horizon >= 1.5 * step and not (_restart(run) == "kalman" and horizon >= step):
            raise run.error(
                "horizon", f"a horizon of {horizon:g} s is less than two samples of {step:g} s; take a longer one"
            )
    if not horizons:
        raise run.error("horizon", 'horizon must be a time such as "0.5 s" or a list of times, got []')
    if isinstance(value, list):
        return tuple(horizons)
    return None if horizons[0] >= length else horizons[0]


def _restart(run: Section) -> Any:
    usual = "kalman" if isinstance(run.values.get("horizon"), list) else "smooth"
    return run.choice("restart", ("smooth", "kalman"), usual)


def _score_from(run: Section, grid: Grid) -> float:
    start, length = run.number("score_from", "s", 0.0), float(grid.t[-1] - grid.t[0])
    if not 0 <= start < length:
        raise run.error(
            "score_from", f"score_from must lie inside the run, 0 to {length:g} s after its start, got {start:g} s"
        )
    return start
