"""How does a record travel to pandas, xarray, python-control, MATLAB, CSV or Parquet, and back?

What the other format has no place for (units, roles, provenance) rides along as one line of JSON.
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.records.columns import stated_unit, take_time
from upright.records.provenance import Provenance

Array = NDArray[np.float64]
PathLike = str | os.PathLike[str]

CSV_MARK = "# upright record"
KEY = "upright"  # name of the JSON in attrs, schema metadata and MAT files


class Exchange:
    """The ways of a record to other tools and back; each library is imported when it is wanted."""

    t: Array
    signals: Mapping[str, Array]
    units: Mapping[str, str]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    provenance: Provenance

    if TYPE_CHECKING:

        def __init__(self, **fields: Any) -> None: ...

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
            origin = dict(about.get("provenance", {}))
            for key in ("window", "notes"):
                origin[key] = tuple(origin.get(key, ()))
            units: dict[str, str] = {str(k): str(v) for k, v in dict(about.get("units", {})).items() if k in signals}
            units |= {k: v for k, v in (stated or {}).items() if v}
            # columns may have been dropped since the description was written
            inputs = tuple(str(name) for name in about.get("inputs", ()) if name in signals)
            outputs = tuple(str(name) for name in about.get("outputs", ()) if name in signals)
            provenance = Provenance(**origin)
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
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
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(f"{CSV_MARK} 1\n# {self.describe()}\n")
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(("t", *self.signals))
            table = np.column_stack((self.t, *self.signals.values()))
            writer.writerows([repr(value) for value in row] for row in table.tolist())

    @classmethod
    def from_csv(cls, path: PathLike) -> Self:
        """Record of text written by `to_csv`."""
        try:
            with open(path, encoding="utf-8", newline="") as file:
                mark, about = file.readline(), file.readline()
                names = next(csv.reader([file.readline()]), [])
                table = np.loadtxt(file, delimiter=",", ndmin=2, comments=None)
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

        if not Path(path).is_file():
            raise BadInput(f"'{path}' must be a MATLAB file written by upright, but there is no such file.")
        try:
            content = loadmat(path)
            return cls.from_mat_variables(content)
        except KeyError as error:
            raise BadInput(
                f"'{path}' lacks the variable {error}; for other MATLAB logs use upright.readers.read."
            ) from None
        except (ValueError, TypeError, OSError, RuntimeError) as error:  # scipy's word on v7.3 files is a RuntimeError
            if isinstance(error, BadInput):
                raise
            raise BadInput(f"'{path}' must be a MATLAB file written by upright, but cannot be read: {error}.") from None

    @classmethod
    def from_mat_variables(cls, content: Mapping[str, Any]) -> Self:
        """Record of the variables `to_mat` writes."""
        names = [str(cell.item()) if cell.size else "" for cell in content["names"].ravel()]
        table = content["signals"]
        return cls.rebuild(content["t"].ravel(), dict(zip(names, table.T, strict=True)), str(content[KEY].item()))

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
            table: Any = pq.read_table(str(path))
        except (OSError, pa.ArrowException) as error:
            raise BadInput(f"'{path}' must be a Parquet file, but cannot be read: {error}.") from None
        if "t" not in table.column_names:
            raise BadInput(
                f"'{path}' needs a column 't' in s, got {', '.join(table.column_names)}; rename the time column."
            )
        columns = {name: table[name].to_numpy() for name in table.column_names}
        return cls.rebuild(columns.pop("t"), columns, (table.schema.metadata or {}).get(KEY.encode(), b"").decode())
