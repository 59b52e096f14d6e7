"""How does a record travel to pandas, xarray, python-control, MATLAB, CSV or Parquet, and back?

What the other format has no place for (units, roles, provenance) rides along as one line of JSON.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.records.record import Array, PathLike, Provenance, Record

CSV_MARK = "# upright record"
KEY = "upright"  # name of the JSON in attrs, schema metadata and MAT files


def describe(record: Record) -> str:
    """Units, roles and provenance as one line of JSON."""
    return json.dumps(
        {
            "units": dict(record.units),
            "inputs": record.inputs,
            "outputs": record.outputs,
            "provenance": asdict(record.provenance),
        }
    )


def rebuild(t: Any, signals: Mapping[str, Any], description: str) -> Record:
    """Record of columns and the JSON of `describe`; an empty description is fine."""
    try:
        about = json.loads(description) if description else {}
        origin = dict(about.get("provenance", {}))
        for key in ("window", "notes"):
            origin[key] = tuple(origin.get(key, ()))
        units: dict[str, str] = {str(k): str(v) for k, v in dict(about.get("units", {})).items()}
        inputs = tuple(str(name) for name in about.get("inputs", ()))
        outputs = tuple(str(name) for name in about.get("outputs", ()))
        provenance = Provenance(**origin)
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise BadInput(
            f"The description of the record must be the JSON this package wrote, got {description[:60]!r}"
            f" ({error}); write the file again or remove the description."
        ) from None
    return Record(t=t, signals=signals, units=units, inputs=inputs, outputs=outputs, provenance=provenance)


def to_pandas(record: Record) -> Any:
    """Data frame indexed by time [s]."""
    import pandas as pd

    frame = pd.DataFrame(dict(record.signals), index=pd.Index(record.t, name="t"))
    frame.attrs[KEY] = describe(record)
    return frame


def from_pandas(frame: Any) -> Record:
    """Record of a frame indexed by time [s]."""
    signals = {str(name): frame.iloc[:, j].to_numpy() for j, name in enumerate(frame.columns)}
    if len(signals) < len(frame.columns):
        raise BadInput("Every column of the data frame needs a name of its own, got duplicates; rename them.")
    return rebuild(frame.index.to_numpy(), signals, str(frame.attrs.get(KEY, "")))


def to_xarray(record: Record) -> Any:
    """Dataset with coordinate t [s]."""
    import xarray as xr

    data = {name: ("t", values, {"units": record.units[name]}) for name, values in record.signals.items()}
    return xr.Dataset(data, coords={"t": ("t", record.t, {"units": "s"})}, attrs={KEY: describe(record)})


def from_xarray(dataset: Any) -> Record:
    """Record of a dataset with coordinate t [s]."""
    if "t" not in dataset.coords:
        raise BadInput(
            f"The dataset needs a coordinate 't' in s, got {sorted(map(str, dataset.coords))};"
            " rename the time coordinate to 't'."
        )
    signals = {str(name): dataset[name].to_numpy() for name in dataset.data_vars}
    record = rebuild(dataset["t"].to_numpy(), signals, str(dataset.attrs.get(KEY, "")))
    stated = {str(name): str(dataset[name].attrs.get("units", "")) for name in dataset.data_vars}
    return record.replace(units={name: stated[name] or record.units[name] for name in signals})


def to_control(record: Record) -> Any:
    """Response with the record's inputs and outputs."""
    import control

    if not record.outputs:
        raise BadInput(
            "A time response needs at least one output, and this record names none;"
            f" choose from: {', '.join(record.names)}."
        )
    return control.TimeResponseData(
        record.t,
        record.y.T,
        inputs=record.u.T if record.inputs else None,
        output_labels=list(record.outputs),
        input_labels=list(record.inputs) or None,
        issiso=len(record.outputs) == 1 and len(record.inputs) == 1,
        title=record.provenance.file or None,
    )


def from_control(response: Any) -> Record:
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
    return Record(t=response.time, signals=signals, inputs=tuple(inputs), outputs=tuple(outputs))


def to_csv(record: Record, path: PathLike) -> None:
    """Text with full precision under two comment lines."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(f"{CSV_MARK} 1\n# {describe(record)}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("t", *record.names))
        table = np.column_stack((record.t, *record.signals.values()))
        writer.writerows([repr(value) for value in row] for row in table.tolist())


def from_csv(path: PathLike) -> Record:
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
    return rebuild(table[:, 0], dict(zip(names[1:], table.T[1:], strict=True)), about[2:].strip())


def to_mat(record: Record, path: PathLike) -> None:
    """MATLAB version 5; names need not be valid MATLAB identifiers."""
    from scipy.io import savemat

    def cells(items: tuple[str, ...]) -> Any:
        return np.array(items, dtype=object).reshape(1, len(items))

    savemat(
        path,
        {
            "t": record.t[:, None],
            "signals": np.column_stack((*record.signals.values(), np.empty((len(record), 0)))),
            "names": cells(record.names),
            "units": cells(tuple(record.units.values())),
            KEY: describe(record),
        },
        do_compression=True,
    )


def from_mat(path: PathLike) -> Record:
    """Record of a file written by `to_mat`."""
    from scipy.io import loadmat

    if not Path(path).is_file():
        raise BadInput(f"'{path}' must be a MATLAB file written by upright, but there is no such file.")
    try:
        content = loadmat(path)
        return from_mat_variables(content)
    except KeyError as error:
        raise BadInput(
            f"'{path}' lacks the variable {error}; for other MATLAB logs use upright.readers.read."
        ) from None
    except (ValueError, TypeError, OSError, RuntimeError) as error:  # scipy's word on v7.3 files is a RuntimeError
        if isinstance(error, BadInput):
            raise
        raise BadInput(f"'{path}' must be a MATLAB file written by upright, but cannot be read: {error}.") from None


def from_mat_variables(content: Mapping[str, Any]) -> Record:
    """Record of the variables `to_mat` writes."""
    names = [str(cell.item()) if cell.size else "" for cell in content["names"].ravel()]
    table = content["signals"]
    return rebuild(content["t"].ravel(), dict(zip(names, table.T, strict=True)), str(content[KEY].item()))


def to_parquet(record: Record, path: PathLike) -> None:
    """Columns t and signals."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if "t" in record.signals:
        raise BadInput("A signal named 't' would hide the time column in a Parquet file; rename it.")
    table: Any = pa.table({"t": record.t, **record.signals})
    pq.write_table(table.replace_schema_metadata({KEY: describe(record)}), str(path))


def from_parquet(path: PathLike) -> Record:
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
    return rebuild(columns.pop("t"), columns, (table.schema.metadata or {}).get(KEY.encode(), b"").decode())
