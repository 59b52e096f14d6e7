"""A study file (TOML) read into a rig, its runs and the rungs of its ladder, in SI.

Every complaint is one sentence with file, line, what was expected and the nearest valid name.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from upright.errors import BadInput, nearest
from upright.identification import Rig, Run
from upright.identification.ladder.rungs import Rung
from upright.identification.model.rig import NOISE
from upright.identification.model.runs import PER_RUN
from upright.identification.problem.simulated import with_noise
from upright.physics import Plant
from upright.physics.actuator import ACTUATOR
from upright.records import Record
from upright.study.keys import names
from upright.study.rig import read_plant, read_rig
from upright.study.runs import read_runs, sensor_nuisances
from upright.study.sensors import drive_unit
from upright.study.text import Section, StudyText

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
    rig : Rig
    runs : tuple of Run
    title, source : str
        Heading and origin of the data, for the report; may be empty.
    sha256 : str
        Of the study's text.
    ladder : tuple of Rung
        Rungs that the study declares.
    """

    path: Path
    plant: str
    rig: Rig
    runs: tuple[Run, ...]
    title: str = ""
    source: str = ""
    sha256: str = ""
    ladder: tuple[Rung, ...] = ()

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
        runs = tuple(replace(r, role="predict") if r.label in labels else r for r in self.runs)
        if labels and all(r.role == "predict" for r in runs):
            raise BadInput(f"holding out {', '.join(labels)} leaves no run to fit; hold out fewer.")
        return replace(self, runs=runs)


def load_study(path: PathLike, *, data: PathLike | None = None, fixed: Mapping[str, float] | None = None) -> Study:
    """Rig and runs that a study file describes.

    Parameters
    ----------
    path : path-like
        TOML file; see `docs/study.md`.
    data : path-like, optional
        Folder that the runs' files are relative to; the study's own when omitted.
    fixed : mapping of str to float, optional
        Parameters [SI] of a model fitted before, ``actuator.*`` included: nothing is then estimated.

    Raises
    ------
    BadInput
        With file and line, when the study or a log cannot be used as it is.
    """
    path = Path(path)
    text = StudyText(path)
    study = text.root()
    study.check(names(""))
    plant = read_plant(study)
    rig = read_rig(study, plant, drive_unit(study), fixed)
    folder = Path(data) if data is not None else path.parent
    logs: dict[tuple[str, str, str], Record] = {}
    runs = read_runs(study, plant, lambda run: _log(run, folder, logs))
    rig = with_noise(rig, runs)
    if fixed is not None:
        levels = {n: p for n, p in rig.parameters.items() if n.startswith(NOISE)}
        known = {n: replace(p, value=fixed.get(n, p.value), estimate=False) for n, p in levels.items()}
        rig = replace(rig, parameters={**rig.parameters, **known})
    return Study(
        path=path,
        plant=study.section("rig").text_of("plant", "furuta"),
        rig=rig,
        runs=runs,
        title=study.text_of("title", "My rig") if "title" in study else "",
        source=study.text_of("source", "https://...") if "source" in study else "",
        ladder=read_ladder(study, plant),
        sha256=hashlib.sha256(text.text.encode()).hexdigest(),
    )


def _log(run: Section, folder: Path, logs: dict[tuple[str, str, str], Record]) -> Record:
    """Record of the file a run names, read once."""
    from upright.readers import read

    name = run.text_of("file", "logs/run_01.csv")
    reader = run.text_of("reader", "csv") if "reader" in run else ""
    time = run.text_of("time", "t") if "time" in run else ""
    key = (name, reader, time)
    if key not in logs:
        file = folder / name
        if not file.is_file():
            raise run.error("file", f"the log {file} does not exist; {_instead(file, folder)}")
        with run.text.at(run.place("reader" if reader else "file")):
            record = read(file, reader=reader or None)
        with run.text.at(run.place("time")):
            logs[key] = record.replace(t=record[time]) if time else record
    return logs[key]


def _instead(file: Path, folder: Path) -> str:
    """Where the file may be instead."""
    from difflib import get_close_matches

    here = sorted(p.name for p in file.parent.iterdir() if p.is_file()) if file.parent.is_dir() else []
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
    rungs: list[Rung] = []
    for i, values in enumerate(entries):
        rung = Section(study.text, ("ladder", i), values)
        rung.check(names("ladder"))
        rungs.append(
            Rung(
                name=rung.text_of("name", "Coulomb friction"),
                adds=rung.names("adds", terms),
                drops=rung.names("drops", terms),
                unknown=rung.names("unknown", nuisances),
            )
        )
    return tuple(rungs)
