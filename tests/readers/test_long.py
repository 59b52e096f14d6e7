"""Is a log of many rows read exactly, and in memory that its numbers account for?"""

import os
import tracemalloc

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import inspect, read_source
from upright.readers.source import Source

ROWS = 700_000  # 9 MB, more than two blocks of the reader


@pytest.fixture(scope="module")
def text():
    return "t,x,u\n" + "".join(f"{k / 1000:.3f},{k % 977},{k % 7}\n" for k in range(ROWS))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_every_number_of_a_long_log_is_the_one_written(text, end):
    record = read_source(Source(file="long.csv", data=text.replace("\n", end).encode()))
    k = np.arange(ROWS)
    assert np.array_equal(record.t, k / 1000)
    assert np.array_equal(record["x"], k % 977)
    assert np.array_equal(record["u"], k % 7)


@pytest.mark.parametrize("row", [3, *(pytest.param(row, marks=pytest.mark.slow) for row in (400_000, ROWS - 1))])
def test_a_torn_row_of_a_long_log_is_found_in_its_line(text, row):
    lines = text.split("\n")
    lines[row + 1] = lines[row + 1].rpartition(",")[0]
    with pytest.raises(BadInput, match=f"line {row + 2}: expected 3 numbers, got 2"):
        read_source(Source(file="long.csv", data="\n".join(lines).encode()))


@pytest.mark.slow
def test_a_row_costs_no_more_memory_than_its_text_and_its_numbers(text):
    """Beside the file: its text once, two tables of float64 while blocks are joined, and a block in wide characters.

    Lines as strings of their own would take another 70 bytes each, 49 MB here.
    """
    source = Source(file="long.csv", data=text.encode())
    tracemalloc.start()
    inspect(read_source(source))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < len(text) + 2 * 3 * 8 * ROWS + 20e6


def test_a_column_that_nobody_can_write_to_is_not_copied():
    from upright.records import Record

    t = np.arange(10.0)
    free = Record(t=t, signals={"x": t})
    t[:] = 0  # a view would follow
    assert free["x"][3] == 3.0
    frozen = np.arange(10.0)
    frozen.flags.writeable = False
    assert Record(t=frozen, signals={}).t is frozen
    part = np.arange(20.0)
    view = part[:10]
    view.flags.writeable = False  # yet whoever holds `part` can write
    assert not np.shares_memory(Record(t=view, signals={}).t, part)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "wait4"), reason="memory of one process is told by POSIX")
@pytest.mark.parametrize("command", ["show", "doctor"])
def test_a_command_takes_memory_by_the_row(tmp_path, command):
    """100 bytes for each row: 1 GB at 10^7 rows. Both logs load the same libraries."""
    from benchmarks.long import measured, write_log

    few, many = 100_000, 3_000_000
    out = ["-o", str(tmp_path / ("page.html" if command == "doctor" else "pictures"))]
    _, least = measured(command, str(write_log(tmp_path / "few.csv", few)), *out)
    _, most = measured(command, str(write_log(tmp_path / "many.csv", many)), *out)
    assert (most - least) * 2**20 < 100 * (many - few)
