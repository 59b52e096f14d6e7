"""What was measured, when, in which units, and where did it come from?

A `Record` is what one layer hands the next: readers make it, the estimator
reads it, reports draw it. It is checked when built, so nobody checks again.
It travels to pandas, xarray, python-control, MATLAB, CSV or Parquet and back; what the other format has no place for
(units, roles, provenance) rides along as one line of JSON. Each library is imported when it is wanted.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.files import LARGEST as LARGEST_FILE
from upright.files import read_text, regular, whole_file
from upright.records.columns import stated_unit, take_time
from upright.shown import Shown, views

Array = NDArray[np.float64]
PathLike = str | os.PathLike[str]

# No laboratory instrument writes a number this large, and its square would overflow in a fit.
LARGEST = 1e30
SHORTEST = 1e-12  # s; a step of time below that is none: its inverse overflows, and no clock has it
CSV_MARK = "# upright record"
_FORMS = ("control", "csv", "mat", "pandas", "parquet", "xarray")
SIMULATED_NOTE = "This log was simulated; no rig was touched."
STRICT_NOTE = "Strict build: every operation was rounded by itself, so that every processor gives the same samples."
KEY = "upright"  # name of the JSON in attrs, schema metadata and MAT files


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Where a record came from; None where it is not known.

    `window` is (first, last) time in s of the part kept; `notes` are sentences about what the reader did or found, in
    order.
    """

    file: str | None = None
    sha256: str | None = None
    reader: str | None = None
    rig: str | None = None
    window: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    @property
    def simulated(self) -> bool:
        """Whether no rig moved."""
        return SIMULATED_NOTE in self.notes

    def note(self, *sentences: str) -> Provenance:
        """Same provenance with sentences added."""
        return replace(self, notes=(*self.notes, *sentences))


def of_twin(rig: str, seed: int) -> Provenance:
    """Provenance of a simulated log, which says so wherever it goes."""
    return Provenance(reader="twin", rig=f"digital twin of {rig}, seed {seed}", notes=(SIMULATED_NOTE,))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Record(Shown):
    """Signals sampled at the same instants.

    Parameters
    ----------
    t : (N,) array
        Time [s], strictly increasing, N >= 2.
    signals : mapping of name to (N,) array
        Every column by its name in the log; finite. The time column itself is `t`.
    units : mapping of name to str, optional
        Unit as the log states it (``"counts"``, ``"V"``, ``"rad"``); ``"1"`` for a pure number,
        ``""`` when the log does not say.
    inputs, outputs : tuple of str, optional
        Names of the signals that drive and that are measured; empty while unknown.
    provenance : Provenance, optional
    plant : Plant, optional
        What moved, with its numbers, where it is in memory; no file keeps it.

    Raises
    ------
    BadInput
        When time does not increase, a value is not finite or beyond 1e30, lengths differ, or a name is unknown.
    """

    t: Array
    signals: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    provenance: Provenance = field(default_factory=Provenance)
    plant: Any = None

    def __post_init__(self) -> None:
        t = _column("time", self.t)
        if t.size < 2:
            raise BadInput(f"A record needs at least 2 samples, got {t.size}; is the log cut short?")
        step = np.diff(t)
        if not (step > 0).all():
            i = int(np.argmax(step <= 0))
            raise BadInput(
                f"Time must increase from sample to sample, but sample {i + 2} is at {t[i + 1]:.9g} s after"
                f" {t[i]:.9g} s; sort the rows or read each run on its own."
            )
        if step.min() < SHORTEST:
            i = int(np.argmin(step))
            raise BadInput(
                f"Time must advance by {SHORTEST:g} s or more from sample to sample, but sample {i + 2} comes"
                f" {step[i]:.3g} s after the one before; is the time in another unit, or no time at all?"
            )
        signals = {str(name): _column(f"column '{name}'", values) for name, values in self.signals.items()}
        for name, values in signals.items():
            if values.size != t.size:
                raise BadInput(
                    f"Column '{name}' needs {t.size} samples, one per time, got {values.size};"
                    " give every column the same time base."
                )
        for name in self.units:
            self._known(name, signals, "units")
        for role, names in (("inputs", self.inputs), ("outputs", self.outputs)):
            for name in names:
                self._known(name, signals, role)
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "signals", signals)
        object.__setattr__(self, "units", {name: str(self.units.get(name, "")) for name in signals})
        object.__setattr__(self, "inputs", tuple(self.inputs))
        object.__setattr__(self, "outputs", tuple(self.outputs))

    @staticmethod
    def _known(name: str, signals: Mapping[str, Array], where: str) -> None:
        if name not in signals:
            raise BadInput(f"The record has no column '{name}', named under {where}: {nearest(name, signals)}")

    def __dir__(self) -> list[str]:
        forms = [f"{way}_{form}" for way in ("from", "to") for form in _FORMS]
        return [
            "inputs", "names", "outputs", "period", "play", "plot", "provenance", "replace", "signals", "t", "u",
            "units", "window", "y", *forms,
        ]  # fmt: skip

    def __len__(self) -> int:
        return self.t.size

    def __iter__(self) -> Iterator[str]:
        """Names of all columns, as a data frame gives them: ``"theta" in log``."""
        return iter(self.signals)

    def __getitem__(self, name: str) -> Array:
        """Samples (N,) of one column, in the unit of the log.

        Raises
        ------
        BadInput
            When there is no such column, with its nearest name.
        """
        if name not in self.signals:
            raise BadInput(
                f"{self.provenance.file or 'the log'} has no column '{name}'; {nearest(name, self.signals)}"
                f" (it holds {', '.join(self.signals)})"
            )
        return self.signals[name]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns, in the order of the log."""
        return tuple(self.signals)

    @property
    def period(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.t)))

    @property
    def u(self) -> Array:
        """Inputs (N, n_inputs) in the units of the log."""
        return self._stack(self.inputs)

    @property
    def y(self) -> Array:
        """Outputs (N, n_outputs) in the units of the log."""
        return self._stack(self.outputs)

    def _stack(self, names: tuple[str, ...]) -> Array:
        out = np.empty((self.t.size, len(names)))
        for j, name in enumerate(names):
            out[:, j] = self.signals[name]
        return out

    def window(self, start: float, stop: float) -> Record:
        """Part with start <= t <= stop [s]; times stay as they are."""
        lo, hi = np.searchsorted(self.t, (start, np.nextafter(stop, np.inf)))
        if hi - lo < 2:
            raise BadInput(
                f"The window {start:g} to {stop:g} s holds {max(hi - lo, 0)} samples and needs at least 2;"
                f" this record runs from {self.t[0]:g} to {self.t[-1]:g} s."
            )
        return replace(
            self,
            t=self.t[lo:hi],
            signals={name: values[lo:hi] for name, values in self.signals.items()},
            provenance=replace(self.provenance, window=(float(start), float(stop))),
        )

    def animate(self, *, plant: Any = None, speed: float = 1.0, frames: int = 25) -> Any:
        """Moving drawing of a rig whose coordinates are columns; see `upright.views.animation.animate`."""
        return views().animate(self, plant=plant, speed=speed, frames=frames)

    def play(self, rig: Any = None, *, out: PathLike | None = None) -> Any:
        """The rig as it moved, drawn to scale in a page with play, pause and a slider of time.

        Parameters
        ----------
        rig : Plant, Rig, fit or path, optional
            What moved; the plant that `simulate` moved when omitted.
        out : path, optional
            Where the page is written, a file ending in .html; nowhere when omitted, and a notebook shows it.

        Raises
        ------
        BadInput
            When the plant is not known or has no drawing, or no column is one of its coordinates.
        """
        return views().moving_page(self, rig, out)

    def replace(self, **changes: Any) -> Record:
        """Record with some fields changed, checked again."""
        return replace(self, **changes)

    def describe(self) -> str:
        """Units, roles and provenance as one line of JSON."""
        return json.dumps(
            {
                "units": dict(self.units),
                "inputs": self.inputs,
                "outputs": self.outputs,
                "provenance": asdict(self.provenance),
            }
        )

    @classmethod
    def rebuild(
        cls, t: Any, signals: Mapping[str, Any], description: str, stated: Mapping[str, str] | None = None
    ) -> Self:
        """Record of columns and the JSON of `describe`; units `stated` elsewhere go before those of the description."""
        try:
            about = json.loads(description) if description else {}
            source: dict[str, Any] = dict(about.get("provenance", {}))
            ends = source.pop("window", None) or None
            notes = tuple(str(v) for v in source.pop("notes", ()))
            units: dict[str, str] = {str(k): str(v) for k, v in dict(about.get("units", {})).items() if k in signals}
            units |= {k: v for k, v in (stated or {}).items() if v}
            # columns may have been dropped since the description was written
            inputs = tuple(str(name) for name in about.get("inputs", ()) if name in signals)
            outputs = tuple(str(name) for name in about.get("outputs", ()) if name in signals)
            window = None if ends is None else (float(ends[0]), float(ends[1]))
            texts = {k: str(v) for k, v in source.items() if v}  # before 1.0 "" was written for what is not known
            provenance = Provenance(**texts, window=window, notes=notes)
        except (ValueError, TypeError, AttributeError, IndexError, KeyError, RecursionError) as error:
            raise BadInput(
                f"The description of the record must be the JSON this package wrote, got {description[:60]!r}"
                f" ({error}); write the file again or remove the description."
            ) from None
        return cls(t=t, signals=signals, units=units, inputs=inputs, outputs=outputs, provenance=provenance)

    def to_pandas(self) -> Any:
        """Data frame indexed by time [s]."""
        import pandas as pd

        frame = pd.DataFrame(dict(self.signals), index=pd.Index(self.t, name="t"))
        frame.attrs[KEY] = self.describe()
        return frame

    @classmethod
    def from_pandas(cls, frame: Any, *, time: str | None = None) -> Self:
        """Record of a data frame.

        Parameters
        ----------
        frame : pandas.DataFrame
        time : str, optional
            Column that holds the time, in s unless its name states a unit, as ``"time [ms]"`` does. When omitted: the
            index that was made the time; where the index only numbers the rows, the one column called like a time.

        Raises
        ------
        BadInput
            When no column, or more than one, can be the time, or the frame does not make a record.
        """
        about = str(frame.attrs.get(KEY, ""))
        t, rest = take_time(frame, time)
        signals = {str(name): rest.iloc[:, j].to_numpy() for j, name in enumerate(rest.columns)}
        if len(signals) < len(rest.columns):
            raise BadInput("Every column of the data frame needs a name of its own, got duplicates; rename them.")
        stated = {} if about else {name: stated_unit(name) for name in signals}
        return cls.rebuild(t, signals, about, stated)

    def to_xarray(self) -> Any:
        """Dataset with coordinate t [s]."""
        import xarray as xr

        data = {name: ("t", values, {"units": self.units[name]}) for name, values in self.signals.items()}
        return xr.Dataset(data, coords={"t": ("t", self.t, {"units": "s"})}, attrs={KEY: self.describe()})

    @classmethod
    def from_xarray(cls, dataset: Any) -> Self:
        """Record of a dataset with coordinate t [s]."""
        if "t" not in dataset.coords:
            raise BadInput(
                f"The dataset needs a coordinate 't' in s, got {sorted(map(str, dataset.coords))};"
                " rename the time coordinate to 't'."
            )
        signals = {str(name): dataset[name].to_numpy() for name in dataset.data_vars}
        stated = {str(name): str(dataset[name].attrs.get("units", "")) for name in dataset.data_vars}
        return cls.rebuild(dataset["t"].to_numpy(), signals, str(dataset.attrs.get(KEY, "")), stated)

    def to_control(self) -> Any:
        """Response with the record's inputs and outputs."""
        import control

        if not self.outputs:
            raise BadInput(
                "A time response needs at least one output, and this record names none;"
                f" choose from: {', '.join(self.signals)}."
            )
        return control.TimeResponseData(
            self.t,
            np.array([self.signals[name] for name in self.outputs]),
            inputs=np.array([self.signals[name] for name in self.inputs]) if self.inputs else None,
            output_labels=list(self.outputs),
            input_labels=list(self.inputs) or None,
            issiso=len(self.outputs) == 1 and len(self.inputs) == 1,
            title=self.provenance.file or None,
        )

    @classmethod
    def from_control(cls, response: Any) -> Self:
        """Record of a response with one trace."""
        if response.ntraces > 1:
            raise BadInput(
                f"A record holds one run, the response has {response.ntraces} traces;"
                " simulate with one input signal at a time (control.forced_response)."
            )
        n = response.time.size
        outputs: list[str] = [str(label) for label in response.output_labels]
        signals: dict[str, Array] = dict(zip(outputs, np.reshape(response.y, (len(outputs), n)), strict=True))
        inputs: list[str] = [str(label) for label in response.input_labels or ()]
        if inputs and response.u is not None:
            signals = dict(zip(inputs, np.reshape(response.u, (len(inputs), n)), strict=True)) | signals
        else:
            inputs = []
        return cls(t=response.time, signals=signals, inputs=tuple(inputs), outputs=tuple(outputs))

    def to_csv(self, path: PathLike) -> None:
        """Text with full precision under two comment lines."""
        with whole_file(path) as half, open(half, "w", encoding="utf-8", newline="") as file:
            file.write(f"{CSV_MARK} 1\n# {self.describe()}\n")
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(("t", *self.signals))
            table = np.column_stack((self.t, *self.signals.values()))
            writer.writerows([repr(value) for value in row] for row in table.tolist())

    @classmethod
    def from_csv(cls, path: PathLike) -> Self:
        """Record of text written by `to_csv`."""
        try:
            file = io.StringIO(read_text(path, most=LARGEST_FILE))
            mark, about = file.readline(), file.readline()
            names = next(csv.reader([file.readline()]), [])
            table = np.loadtxt(file, delimiter=",", ndmin=2, comments=None)
        except BadInput:
            raise
        except (OSError, ValueError) as error:
            raise BadInput(f"'{path}' must be a CSV file written by upright, but cannot be read: {error}.") from None
        if not mark.startswith(CSV_MARK) or len(names) != table.shape[1]:
            raise BadInput(f"'{path}' must begin with '{CSV_MARK}'; for other logs use upright.readers.read.")
        return cls.rebuild(table[:, 0], dict(zip(names[1:], table.T[1:], strict=True)), about[2:].strip())

    def to_mat(self, path: PathLike) -> None:
        """MATLAB version 5; names need not be valid MATLAB identifiers."""
        from scipy.io import savemat

        def cells(items: tuple[str, ...]) -> Any:
            return np.array(items, dtype=object).reshape(1, len(items))

        savemat(
            path,
            {
                "t": self.t[:, None],
                "signals": np.column_stack((*self.signals.values(), np.empty((self.t.size, 0)))),
                "names": cells(tuple(self.signals)),
                "units": cells(tuple(self.units.values())),
                KEY: self.describe(),
            },
            do_compression=True,
        )

    @classmethod
    def from_mat(cls, path: PathLike) -> Self:
        """Record of a file written by `to_mat`."""
        from scipy.io import loadmat

        if not Path(path).exists():
            raise BadInput(f"'{path}' must be a MATLAB file written by upright, but there is no such file.")
        try:
            regular(path)
            content = loadmat(path)
            names = [str(cell.item()) if cell.size else "" for cell in content["names"].ravel()]
            table: Any = content["signals"]
            signals = dict(zip(names, table.T, strict=True))
            return cls.rebuild(content["t"].ravel(), signals, str(content[KEY].item()))
        except KeyError as error:
            raise BadInput(
                f"'{path}' lacks the variable {error}; for other MATLAB logs use upright.readers.read."
            ) from None
        except (ValueError, TypeError, OSError, RuntimeError) as error:  # scipy's word on v7.3 files is a RuntimeError
            if isinstance(error, BadInput):
                raise
            raise BadInput(f"'{path}' must be a MATLAB file written by upright, but cannot be read: {error}.") from None

    def to_parquet(self, path: PathLike) -> None:
        """Columns t and signals."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        if "t" in self.signals:
            raise BadInput("A signal named 't' would hide the time column in a Parquet file; rename it.")
        table: Any = pa.table({"t": self.t, **self.signals})
        pq.write_table(table.replace_schema_metadata({KEY: self.describe()}), str(path))

    @classmethod
    def from_parquet(cls, path: PathLike) -> Self:
        """Record of the columns of a Parquet file."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            regular(path)
            table: Any = pq.read_table(str(path))
        except (OSError, pa.ArrowException) as error:
            raise BadInput(f"'{path}' must be a Parquet file, but cannot be read: {error}.") from None
        if "t" not in table.column_names:
            raise BadInput(
                f"'{path}' needs a column 't' in s, got {', '.join(table.column_names)}; rename the time column."
            )
        columns = {name: table[name].to_numpy() for name in table.column_names}
        return cls.rebuild(columns.pop("t"), columns, (table.schema.metadata or {}).get(KEY.encode(), b"").decode())


def _column(what: str, values: Any) -> Array:
    """Read-only float64 copy, one-dimensional and finite; what nobody can write to is taken as it is."""
    try:
        out = values if _is_frozen(values) else np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise BadInput(f"{what} must be numbers, got something else ({error}); convert it first.") from None
    if out.ndim != 1:
        raise BadInput(f"{what} must be one-dimensional, got shape {out.shape}; give each column its own name.")
    if out.size and not -LARGEST <= out.min() <= out.max() <= LARGEST:  # catches nan and inf as well
        i = int(np.argmax(~(np.abs(out) <= LARGEST)))
        raise BadInput(
            f"{what} must be finite and below {LARGEST:g}, got {out[i]:g} at sample {i + 1};"
            " remove the sample or fill it in."
        )
    out.flags.writeable = False
    return out


def _is_frozen(values: Any) -> bool:
    """Whether an array of float64 can be changed by nobody, not even through the array that it is a part of."""
    owner = values
    while isinstance(owner, np.ndarray) and not owner.flags.writeable:
        if owner.base is None:
            return values.dtype == np.float64 and values.flags.contiguous
        owner = owner.base
    return False
