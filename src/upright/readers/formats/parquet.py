"""Record of a Parquet or a Feather file: columns as data frames keep them, read as the same table in a text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime
from io import BytesIO
from typing import Any

from upright.errors import BadInput
from upright.readers.formats.delimited import of_columns
from upright.readers.reader import Reader
from upright.readers.source import Source
from upright.records import Record
from upright.records.columns import time_scale
from upright.records.record import KEY

_INDEX = "__index_level_"
_PARQUET, _FEATHER = b"PAR1", b"ARROW1"


def read(source: Source) -> Record:
    """Record of all columns; one that upright wrote is the same record again."""
    table = _table(source)
    about = (table.schema.metadata or {}).get(KEY.encode(), b"").decode()
    if about and "t" in table.column_names:
        columns = {name: table[name].to_numpy() for name in table.column_names}
        return Record.rebuild(columns.pop("t"), columns, about)
    names: list[str] = list(table.column_names)
    if len(set(names)) < len(names):
        raise source.bad(f"expected a name of its own for each column, got {', '.join(names)}; rename them")
    if any(time_scale(name) for name in names):
        names = [name for name in names if not name.startswith(_INDEX)]
    names.sort(key=lambda name: not name.startswith(_INDEX))  # the index of a frame may be its time
    record = of_columns(source, {name: _cells(source, name, table[name]) for name in names})
    return replace(record, provenance=source.provenance("parquet", *record.provenance.notes))


def _table(source: Source) -> Any:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise source.bad(
            "Parquet and Feather files need pyarrow; pip install 'upright[data]', or export the log as CSV"
        ) from None
    try:
        if source.data.startswith(_PARQUET):
            file = pq.ParquetFile(BytesIO(source.data))
            _bounded(source, file.metadata.num_rows * max(file.metadata.num_columns, 1))
            return file.read()
        batches = pa.ipc.open_file(BytesIO(source.data))
        return pa.Table.from_batches(list(_counted(source, batches)), batches.schema)
    except (OSError, ValueError, KeyError, pa.ArrowException) as error:
        if isinstance(error, BadInput):
            raise
        raise source.bad(f"the file is damaged ({str(error).strip().splitlines()[0]}); save it again") from None


def _counted(source: Source, batches: Any) -> Iterable[Any]:
    numbers = 0
    for i in range(batches.num_record_batches):
        batch = batches.get_batch(i)
        numbers += batch.num_rows * batch.num_columns
        _bounded(source, numbers)
        yield batch


def _bounded(source: Source, numbers: int) -> None:
    if 8 * numbers > source.most_unpacked << 20:
        raise source.bad("it would unpack to more than any log holds; export the log as CSV")


def _cells(source: Source, name: str, column: Any) -> list[str]:
    """A column as text: numbers to the last bit, stamps as ISO 8601 has them."""
    import pyarrow as pa

    if pa.types.is_timestamp(column.type):  # Python's own hold microseconds
        column = column.cast(pa.timestamp("us", column.type.tz), safe=False)
    values = column.to_pylist()
    if None in values:
        raise source.bad(
            "expected a value in every row, got none; fill or drop the row", sample=values.index(None) + 1, name=name
        )
    if values and isinstance(values[0], datetime):
        return [value.isoformat(sep=" ", timespec="microseconds") for value in values]
    if not all(isinstance(value, float | int) for value in values):  # True is a number too
        raise source.bad(f"expected numbers in the column '{name}', got {values[0]!r}; drop it and save again")
    return [repr(float(value)) if isinstance(value, bool) else repr(value) for value in values]


READER = Reader(
    name="parquet",
    files="Parquet and Feather",
    recognises=lambda source: source.data.startswith((_PARQUET, _FEATHER)),
    read=read,
    order=17,
)
