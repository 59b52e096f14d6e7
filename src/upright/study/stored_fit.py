"""A fit that was written before, read again: nothing impossible gets through, since anybody may have edited the file.

JSON has no infinity: ``null`` stands for "no bound" (a standard error nobody can state, an actuator without limit).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.basis import NOT_TRUSTED, RESERVED, TRUSTED, Basis
from upright.errors import BadInput, ImpossiblePhysics
from upright.files import read_text
from upright.identification.model.bands import Bands, SlowFriction, Spread
from upright.identification.model.fit import Estimate, Judgement
from upright.identification.model.grey_box import SUBSTEPS
from upright.physics import PLANTS, Plant, find
from upright.physics.actuator import ACTUATOR
from upright.rig import Rig
from upright.rig.drive import GAIN
from upright.rig.hardware import DRIVE_SIGN, Entry, Hardware, check_vendor
from upright.study.description import rig_of_numbers
from upright.trust import before_running

FORMAT = 1
LARGEST = 1e12
"""Beyond any number of a laboratory rig in SI units."""
SILENT = Basis(level=NOT_TRUSTED, sentence="This fit does not say whether it can be trusted.")


@dataclass(frozen=True, kw_only=True)
class StoredFit:
    """What is read of a `fit.json`: every parameter [SI], what groups share, the hardware, all content.

    `bands` are None in files that versions without them wrote. `basis` is the fit's own verdict, for what rests on it.
    `path` is that of the file, None of a fit in memory, whose plant is the `kind` itself.
    """

    plant: str
    values: Mapping[str, float]
    substeps: int
    verdict: str
    trusted: bool
    groups: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])
    hardware: Hardware = field(default_factory=Hardware)
    bands: Bands | None = None
    basis: Basis = SILENT
    content: Mapping[str, Any] = field(default_factory=dict[str, Any])
    path: Path | None = None
    in_memory: type[Plant] | None = None

    @property
    def kind(self) -> type[Plant]:
        """The plant that it is a fit of; one in a file of its own is announced before it runs."""
        if self.in_memory is not None:
            return self.in_memory
        if self.path is None:
            return find(self.plant)
        before_running(self.plant, self.path)
        return find(self.plant, self.path.parent)

    def fitted_run(self, source: str) -> str:
        """Label of a fitted run that shares samples with a run of this `source`; empty where none does."""
        log, start, stop = _stretch(source)
        origins: Any = (self.content.get("provenance") or {}).get("runs") or {}
        scores: Any = self.content.get("runs") or {}
        for label, origin in origins.items() if log else ():
            other, first, last = _stretch(str(origin))
            if other == log and first < stop and start < last and (scores.get(label) or {}).get("role") == "fit":
                return str(label)
        return ""

    def rig(self, *, seed: int = 0, draws: int = 200) -> Rig:
        """The rig as identified, and rigs drawn from the fit's covariance.

        Raises
        ------
        BadInput
            When a parameter of the plant is missing.
        """
        kind = self.kind
        names = set(kind.names())
        try:
            plant = kind(**{n: v for n, v in self.values.items() if n in names})
        except TypeError:
            raise BadInput(f"the fit does not hold every parameter of '{self.plant}'; identify again.") from None
        sources = {n: self.source(n) for n in self.values if n in names | {GAIN}}
        known = rig_of_numbers(plant, self.plant, self.values, self.unit(GAIN), self.hardware)
        return replace(known, basis=self.basis, sources=sources, draws=tuple(self._drawn(plant, seed, draws)))

    def _drawn(self, plant: Plant, seed: int, draws: int) -> list[tuple[Plant, float]]:
        """Sets of numbers as standard errors and correlations scatter them; impossible ones are left out."""
        names, covariance = self.covariance((*plant.names(), GAIN))
        if not covariance.any():
            return []
        size, axes = np.linalg.eigh(covariance)
        rng = np.random.default_rng([seed, 17])
        moves = rng.normal(size=(draws, len(names))) * np.sqrt(np.maximum(size, 0.0)) @ axes.T
        out: list[tuple[Plant, float]] = []
        gain, sign = self.values.get(GAIN, 1.0), self.hardware.value(DRIVE_SIGN, 1.0)
        for move in moves.tolist():
            change = dict(zip(names, move, strict=True))
            moved = sign * (gain + change.pop(GAIN, 0.0))
            try:
                out.append((plant.replace(**{n: getattr(plant, n) + d for n, d in change.items()}), moved))
            except ImpossiblePhysics:
                continue
        return out

    def unit(self, name: str) -> str:
        """Unit of a parameter, "" where the file does not tell."""
        entry = self.content["parameters"].get(name)
        return str(entry.get("unit") or "") if isinstance(entry, dict) else ""

    def source(self, name: str) -> str:
        """Where a parameter comes from: ``"identified"``, ``"assumed"`` or ``"known"``."""
        entry = self.content["parameters"].get(name)
        status = entry.get("status") if isinstance(entry, dict) else None
        estimated = name in self.content.get("estimated", ())
        return "identified" if estimated else "assumed" if status == "assumed" else "known"

    def estimate(self, name: str) -> Estimate:
        """A parameter with its interval, as far as the file tells; one without is exact."""
        entry: Any = self.content["parameters"].get(name)
        table: Mapping[str, Any] = entry if isinstance(entry, dict) else {}
        value, error = self.values[name], table.get("stderr", 0.0)
        low, high = table.get("interval") or (value, value)
        return Estimate(
            value=value, stderr=math.inf if error is None else float(error), unit=self.unit(name),
            interval=(-math.inf if low is None else float(low), math.inf if high is None else float(high)),
            status=str(table.get("status") or "known"),
        )  # fmt: skip

    @property
    def scores(self) -> dict[str, dict[str, float]]:
        """Fit percent by label and signal of the runs that were fitted, as far as the file tells."""
        runs: Any = self.content.get("runs")
        by_run = {} if not isinstance(runs, dict) else runs
        return {
            label: {s: float(p) for s, p in run["fit_percent"].items() if isinstance(p, int | float)}
            for label, run in by_run.items()
            if isinstance(run, dict) and run.get("role") == "fit" and isinstance(run.get("fit_percent"), dict)
        }

    def covariance(self, among: Collection[str]) -> tuple[list[str], NDArray[np.float64]]:
        """Those of the estimates that are `among` the names, and their covariance; zeros where the file has none."""
        estimated: list[str] = list(self.content.get("estimated", []))
        places = [i for i, n in enumerate(estimated) if n in among]
        names = [estimated[i] for i in places]
        entries = [self.content["parameters"].get(n) or {} for n in names]
        errors = np.array([float(e.get("stderr") or 0.0) if isinstance(e, dict) else 0.0 for e in entries])
        correlation = np.array([[float(v or 0.0) for v in row] for row in self.content.get("correlation") or []])
        if correlation.shape != (len(estimated), len(estimated)):
            correlation = np.zeros((len(estimated), len(estimated)))
        return names, correlation[np.ix_(places, places)] * np.outer(errors, errors)


def _stretch(source: str) -> tuple[str, float, float]:
    """The sha256 of a run's log, and which seconds of it the run is; "" for a log without one."""
    log, window = re.search(r"\(sha256 (\w+)\)", source), re.search(r"; ([-+.\de]+) to ([-+.\de]+) s(?:;|$)", source)
    seconds = (float(window[1]), float(window[2])) if window else (-math.inf, math.inf)
    return log[1] if log else "", *seconds


def read_fit(path: Path) -> StoredFit:
    """Model of a `fit.json`.

    Raises
    ------
    BadInput
        When the file is no JSON, was not written by `upright identify`, or holds what no rig can have.
    """
    text = ""
    try:
        text = read_text(path)
        content: Any = json.loads(text)
    except BadInput:
        raise
    except (UnicodeDecodeError, ValueError, RecursionError) as error:
        if isinstance(error, json.JSONDecodeError) and text.startswith("{"):
            raise BadInput(
                f"{path}, line {error.lineno}: the file is cut off or damaged there; identify again, or take its copy"
            ) from None
        raise BadInput(f"{path} is not a fit.json; the first argument is what `upright identify` wrote") from None
    wanted = ("plant", "parameters")
    if not isinstance(content, dict) or any(key not in content for key in wanted):
        raise BadInput(f"{path} lacks the keys {', '.join(wanted)} of a fit.json; write it with `upright identify`")
    if content.get("format") != FORMAT:
        raise BadInput(
            f"{path} has format {_shown(content.get('format'))}, this version reads {FORMAT}; identify again"
        )
    try:
        return replace(stored_fit(content), path=path)
    except (BadInput, ImpossiblePhysics) as error:
        raise BadInput(f"{path}: {str(error).rstrip('.')}; identify again, or put it right") from None


def stored_fit(content: dict[str, Any], in_memory: type[Plant] | None = None) -> StoredFit:
    """Model of what a `fit.json` holds, of a plant that may be in no file; see `read_fit`."""
    plant, verdict = (_text(content.get(key, ""), key) for key in ("plant", "verdict"))
    if not plant:
        raise BadInput("plant must be a name, got an empty one")
    entries = _table(content["parameters"], "parameters")
    values = {name: _value(name, entry) for name, entry in entries.items()}
    if not values:
        raise BadInput("it holds no parameters")
    _check_physics(plant, values, in_memory)
    substeps = content.get("substeps", 1)
    if isinstance(substeps, bool) or not isinstance(substeps, int) or not 1 <= substeps <= SUBSTEPS:
        raise BadInput(f"substeps must be a whole number from 1 to {SUBSTEPS}, got {_shown(substeps)}")
    trusted = content.get("trusted", False)
    if not isinstance(trusted, bool):
        raise BadInput(f"trusted must be true or false, got {_shown(trusted)}")
    _check_correlation(content, entries)
    groups = {
        label: {n: _value(f"groups.{label}.{n}", e) for n, e in _table(group, f"groups.{label}").items()}
        for label, group in _table(content.get("groups", {}), "groups").items()
    }
    return StoredFit(
        plant=plant, values=values, substeps=substeps, verdict=verdict, trusted=trusted, groups=groups, content=content,
        basis=_basis(content, verdict, trusted=trusted), hardware=_hardware(content, values),
        bands=None if content.get("bands") is None else _bands(content["bands"]), in_memory=in_memory,
    )  # fmt: skip


def basis_of(verdict: str, answers: Sequence[Judgement], *, trusted: bool) -> Basis:
    """A fit's own verdict for what rests on it: what speaks against it, else what was not tested or holds in part."""
    against = [a for a in answers if a.answer == "no"]
    if not trusted:
        reason = _worded(against[0]) if against else verdict or "do not rely on this model yet."
        return Basis(level=NOT_TRUSTED, sentence=f"The fit's own verdict: {reason}")
    loose = next((a for a in answers if a.rests_on), None)
    if loose is not None:
        return Basis(level=NOT_TRUSTED, sentence=f"The fit's own verdict: {_worded(loose)} Measure what it rests on.")
    less = [*against, *(a for a in answers if a.answer in ("in part", "not tested"))]
    if less:
        return Basis(level=RESERVED, sentence=f"The fit has reservations: {_worded(less[0])}")
    return Basis(level=TRUSTED, sentence=verdict or "The fit is trusted.")


def _worded(a: Judgement) -> str:
    """An answer with the first of its reasons."""
    return replace(a, advice="", reasons=a.reasons[:1]).text()


def _basis(content: Mapping[str, Any], verdict: str, *, trusted: bool) -> Basis:
    if "trusted" not in content or "verdict" not in content:
        return SILENT
    answers = [_answer(answer) for answer in _list(content.get("answers", []), "answers")]
    return basis_of(verdict, answers, trusted=trusted)


def _answer(entry: Any) -> Judgement:
    table = _table(entry, "answers")
    question, answer, headline = (_text(table.get(n), f"answers.{n}") for n in ("question", "answer", "headline"))
    reasons = [_text(reason, "answers.reasons") for reason in _list(table.get("reasons", []), "answers.reasons")]
    rests = [_text(name, "answers.rests_on") for name in _list(table.get("rests_on", []), "answers.rests_on")]
    return Judgement(
        question=question, answer=answer, headline=headline, reasons=tuple(reasons), rests_on=tuple(rests)
    )  # fmt: skip


def _hardware(content: Mapping[str, Any], values: Mapping[str, float]) -> Hardware:
    """What the file says of drive, encoders and servo; an older one has its drive among the parameters alone."""
    stored = _table(content.get("rig", {}), "rig")
    entries = _drive(content, values)
    for name, entry in _table(stored.get("entries", {}), "rig.entries").items():
        place = f"rig.entries.{name}"
        table = _table(entry, place)
        unit, source = _text(table.get("unit"), f"{place}.unit"), _text(table.get("source"), f"{place}.source")
        drive = f"actuator.{name}"
        if table.get("value") is None and drive in ACTUATOR:
            continue  # the drive is without it
        value = _number(table.get("value"), f"{place}.value")
        signed = name == DRIVE_SIGN or name.startswith(("sign.", "offset."))
        if drive not in ACTUATOR and not signed and not value > 0:
            raise BadInput(f"{place}.value must be above 0, got {value:g}")
        if drive in values and not math.isclose(value, values[drive], rel_tol=1e-9):
            raise BadInput(f"{place}.value is {value:g}, and parameters.{drive} is {values[drive]:g}")
        entries[name] = Entry(value=value, unit=unit, source=source)
    name, vendor = (_text(stored.get(key) or "", f"rig.{key}") or None for key in ("name", "vendor"))
    return Hardware(name=name, vendor=check_vendor(vendor), entries=entries)


def _drive(content: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Entry]:
    """Numbers of the drive that do something, as the fit's parameters tell them."""
    estimated, out = content.get("estimated", []), dict[str, Entry]()
    for name, number in ACTUATOR.items():
        if name in values and values[name] != number.default:
            entry = content["parameters"][name]
            table: Mapping[str, Any] = entry if isinstance(entry, dict) else {}
            known = "measured" if table.get("stderr") else "known"
            out[name.partition(".")[2]] = Entry(
                value=values[name],
                unit=str(table.get("unit") or ""),
                source="identified" if name in estimated else known,
            )
    return out


def _bands(entry: Any) -> Bands:
    """What the fit promises of predictions."""
    table = _table(entry, "bands")
    spreads = {
        signal: tuple(_spread(part, f"bands.spreads.{signal}") for part in _list(parts, f"bands.spreads.{signal}"))
        for signal, parts in _table(table.get("spreads"), "bands.spreads").items()
    }
    names = [_text(name, "bands.names") for name in _list(table.get("names"), "bands.names")]
    rows = [
        [_number(v, "bands.covariance", LARGEST**2) for v in _list(row, "bands.covariance")]
        for row in _list(table.get("covariance"), "bands.covariance")
    ]
    if [len(row) for row in rows] != [len(names)] * len(names):
        raise BadInput(f"bands.covariance must have {len(names)} rows of as many numbers, one for each of bands.names")
    covariance = np.array(rows).reshape(len(names), len(names))
    if names and np.linalg.eigvalsh(_scaled(covariance))[0] < -1e-6:
        raise BadInput("bands.covariance must be a covariance, so none of its variances may be negative")
    return Bands(
        quantile=_positive(table.get("quantile"), "bands.quantile"), level=_positive(table.get("level"), "bands.level"),
        spreads=spreads, names=tuple(names), covariance=covariance,
        logs=tuple(_text(log, "bands.logs") for log in _list(table.get("logs", []), "bands.logs")),
        reached={n: _number(v, f"bands.reached.{n}") for n, v in _table(table.get("reached"), "bands.reached").items()},
        slow=tuple(_slow(part, len(names)) for part in _list(table.get("slow", []), "bands.slow")),
    )  # fmt: skip


def _scaled(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    size = np.sqrt(np.abs(np.diag(covariance)))
    size[size == 0] = 1.0
    return covariance / np.outer(size, size)


def _slow(entry: Any, numbers: int) -> SlowFriction:
    table = _table(entry, "bands.slow")
    moves = [_number(v, "bands.slow.moves", LARGEST**2) for v in _list(table.get("moves"), "bands.slow.moves")]
    if len(moves) > numbers:
        raise BadInput(f"bands.slow.moves must have at most {numbers} numbers, one for each of bands.names")
    return SlowFriction(
        coulomb=_text(table.get("coulomb"), "bands.slow.coulomb"), moves=np.array(moves),
        speed=_positive(table.get("speed"), "bands.slow.speed"),
    )  # fmt: skip


def _spread(entry: Any, place: str) -> Spread:
    table = _table(entry, place)
    horizon, start, end = (_number(table.get(n), f"{place}.{n}") for n in ("horizon", "start", "end"))
    if horizon < 0 or not 0 < start <= end:
        raise BadInput(f"{place} must have a horizon of 0 or more and 0 < start <= end, got {_shown(entry)}")
    return Spread(horizon=horizon, start=start, end=end)


def _positive(value: Any, place: str) -> float:
    if not (number := _number(value, place)) > 0:
        raise BadInput(f"{place} must be above 0, got {number:g}")
    return number


def _list(value: Any, place: str) -> list[Any]:
    if not isinstance(value, list):
        raise BadInput(f"{place} must be a list, got {_shown(value)}")
    return value  # type: ignore[reportUnknownVariableType]


def _value(name: str, entry: Any) -> float:
    """Value of one number, plain or in a table beside its error and unit."""
    place = name if name.startswith("groups.") else f"parameters.{name}"
    table = _table(entry, place) if isinstance(entry, dict) else {"value": entry}
    error, unit = table.get("stderr"), table.get("unit")
    if error is not None and not _number(error, f"{place}.stderr") >= 0:
        raise BadInput(f"{place}.stderr must be 0 or more, got {error:g}")
    if unit is not None:
        _text(unit, f"{place}.unit")
    value = table.get("value")
    if value is None and name in ACTUATOR and math.isinf(ACTUATOR[name].default):
        return ACTUATOR[name].default
    return _number(value, f"{place}.value")


def _check_physics(plant: str, values: Mapping[str, float], in_memory: type[Plant] | None) -> None:
    """Refuse what the plant, where it is one of ours, and the drive cannot be; a user's plant checks itself."""
    for name, number in ACTUATOR.items():
        value = values.get(name, number.default)
        if number.never_negative and value < 0:
            raise BadInput(f"{name} ({number.meaning}) must be 0 or more, got {value:g}")
    if values.get("actuator.gain", 1.0) == 0:
        raise BadInput("actuator.gain must not be 0, since nothing would drive the rig then")
    kind = in_memory or (find(plant) if ".py:" not in plant else None)
    if kind is None:
        return
    for name in kind.names():
        if name in values:
            kind.quantity(name).check(name, values[name])
    if in_memory is None and plant in PLANTS and all(name in values for name in kind.names()):
        kind(**{name: values[name] for name in kind.names()})


def _check_correlation(content: Mapping[str, Any], entries: Mapping[str, Any]) -> None:
    """Refuse correlations that are none: of names that are not there, above 1, or in no square."""
    estimated, rows = content.get("estimated", []), content.get("correlation") or []
    if not isinstance(estimated, list) or not all(isinstance(n, str) and n in entries for n in estimated):
        raise BadInput(f"estimated must list names of the parameters, got {_shown(estimated)}")
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        raise BadInput(f"correlation must be a list of rows, got {_shown(rows)}")
    if rows and [len(row) for row in rows] != [len(estimated)] * len(estimated):
        raise BadInput(f"correlation must have {len(estimated)} rows of as many numbers, one for each of `estimated`")
    for row in rows:
        for value in row:
            if value is not None and not abs(_number(value, "correlation")) <= 1 + 1e-6:
                raise BadInput(f"correlation must lie between -1 and 1, got {value:g}")


def _table(value: Any, place: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise BadInput(f"{place} must be a table, got {_shown(value)}")
    return value


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str):
        raise BadInput(f"{place} must be text, got {_shown(value)}")
    return value


def _number(value: Any, place: str, largest: float = LARGEST) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= largest:
        raise BadInput(f"{place} must be a finite number of a plausible size, got {_shown(value)}")
    return float(value)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 40 else f"{text[:37]}..."
