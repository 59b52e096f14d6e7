"""Is damage named in one sentence, with the line and the column where it is?"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import pytest

from tests.readers import logs
from upright.errors import BadInput
from upright.readers import read, read_source
from upright.readers.source import Source


def source(data: bytes) -> Source:
    return Source(file="log.csv", data=data)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"", "the file is empty"),
        (b" \r\n \n", "the file is empty"),
        (b"t,x\n0,1\n1,two\n", "line 3, column 2 \\(x\\).*'two'"),
        (b"t,x,note\n0,1,\n1,2,\n2,3,\n", "column 3 \\(note\\).*empty in every row; delete"),
        (b"t,x\n0,1\n1,\n2,3\n", "line 3, column 2 \\(x\\).*empty cell"),
        (b"t,x\n0,1\n1,nan\n", "line 3, column 2 \\(x\\).*'nan'"),
        (b"t,x\n0,1\n1,1e999\n", "line 3, column 2 \\(x\\).*too large"),
        (b"t,x\n0,1\n1,1e200\n", "line 3, column 2 \\(x\\).*too large"),
        (b"t,x\n0,1\n\n2,3\n1,3\n", "line 5, column 1 \\(t\\).*1 s after 2 s"),
        (b"t,x\n0,1\n1,2\n2", "line 4.*the last row is torn"),
        (b"t,x\n0.00,1.00\n1.00,2.00\n2.00,2.50\n3.00,2.5", "line 5, column 2 \\(x\\).*the last row is torn"),
        (b"t,x,y\n0,1\n1,2\n", "line 1.*a name for each of the 2 columns below, got 3"),
        (b"t,x,x\n0,1,2\n1,2,3\n", "line 1, column 3 \\(x\\).*got this one twice"),
        (b"a,b\n3,1\n2,2\n", "line 1.*a time column named 't'"),
        (b"Sample,x\n1,1\n2,2\n", "only the sample index"),
        (b"t,x\n", "there are no rows of numbers"),
        (b"t,x\n0,1\n", "at least 2 samples"),
        (b"t,x\n0,1\n1,\x002\n", "line 3, column 3.*byte 0x00"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "binary format"),
        (b"MATLAB 7.3 MAT-file" + b" " * 493 + b"\x89HDF\r\n\x1a\n", "version 7.3 \\(HDF5\\).*'-v7'"),
        (b"MATLAB 5.0 MAT-file", "damaged or older"),
        (logs.mat_vectors(61)[:-9], "cut short or damaged"),
        (logs.ecp_export().replace(b"]", b";"), "line 62.*expected ']'"),
        (logs.ecp_export()[:2000], "cut short|torn"),
        (logs.ecp_export().replace(b";", b" ", 1), "line 3.*expected ';'"),
        (logs.ros_bag().replace(b",0.050000000", b",", 1), "line 7, column 4 .*this cell is empty"),
        (
            logs.ros_bag().replace(b"1707681595.549459725", b"1E661466613"),
            "line 3, column 3 .*stamp.*expected a time stamp in s",
        ),
        (logs.ros_bag()[:-8], "torn"),
    ],
)
def test_damage_is_named_in_one_sentence_with_its_place(data: bytes, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "damaged"
    path.write_bytes(data)
    with pytest.raises(BadInput, match=sentence) as caught:
        read(path)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_answered_with_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "swing.csv").write_bytes(logs.named_csv())
    with pytest.raises(BadInput, match=r"did you mean 'swing\.csv'"):
        read(tmp_path / "swnig.csv")
    with pytest.raises(BadInput, match="is a folder"):
        read(tmp_path)


def test_a_last_number_that_may_be_cut_is_noted(tmp_path: Path) -> None:
    record = read_source(source(b"t,x\n0,1\n1,25\n2,3"))
    assert any("no line end" in note for note in record.provenance.notes)


def element(kind: int, data: bytes) -> bytes:
    """One element of a MATLAB version 5 file."""
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def start(code: int, *dims: int) -> bytes:
    """What a variable begins with: its class, its dimensions, no name."""
    return element(6, struct.pack("<II", code, 0)) + element(5, struct.pack(f"<{len(dims)}i", *dims)) + element(1, b"a")


def matlab(*elements: bytes) -> bytes:
    return logs.mat_vectors()[:128] + b"".join(elements)


def packed(*pieces: bytes, repeat: int = 1) -> bytes:
    """Compressed element of `pieces`, the last of them repeated; made piece by piece, so that the test stays small."""
    machine = zlib.compressobj(1)
    *first, last = pieces
    data = b"".join([machine.compress(b"".join(first)), *(machine.compress(last) for _ in range(repeat))])
    data += machine.flush()
    return struct.pack("<II", 15, len(data)) + data


def nested(depth: int) -> bytes:
    """Cells in cells, the outermost first; 5000 of them end the interpreter where SciPy reads them."""
    size, parts = 0, []
    for _ in range(depth):
        size += 8 + len(start(1, 1, 1))
        parts.append(struct.pack("<II", 14, size - 8) + start(1, 1, 1))
    return b"".join(reversed(parts))


NAMES = element(5, struct.pack("<i", 8)) + element(1, b"gain\0\0\0\0" * 20)
HUGE = struct.pack("<II", 9, 0xFFFFFFF0)  # tag of 4 GB of numbers


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (matlab(packed(nested(100_000))), "nested too deeply"),
        (matlab(element(14, start(1, 1 << 30, 1))), "1073741824 parts announced, 0 found"),
        (matlab(element(14, start(2, 1 << 30, 1) + NAMES)), "21474836480 parts announced, 0 found"),
        (matlab(element(14, start(6, 1 << 30, 1) + HUGE)), "an element of 4294967280 bytes where 0 are left"),
        (matlab(element(14, start(6, 1 << 30, 1) + element(9, bytes(80)))), "1073741824 numbers announced, 10 found"),
        (matlab(element(14, start(4, 1 << 30, 1) + element(16, b""))), "got only parameters"),
        (matlab(element(14, start(6, 2, 1))), "a part of a variable is missing"),
    ],
    ids=["nested", "cells", "fields", "tag", "numbers", "text", "no data"],
)
def test_a_matlab_file_that_promises_more_than_it_holds_is_refused_at_once(data: bytes, sentence: str) -> None:
    import tracemalloc

    tracemalloc.start()
    with pytest.raises(BadInput, match=sentence):
        read_source(source(data))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "begin", "piece"),
    [
        (3_000_000_000, start(6, 1, 1), bytes(1 << 20)),
        (48_000_048, start(1, 6_000_000, 1), struct.pack("<II", 14, 0) * 10_000),
    ],
    ids=["numbers", "empty cells"],
)
def test_a_matlab_file_that_unpacks_to_more_than_any_log_is_refused(size: int, begin: bytes, piece: bytes) -> None:
    """A few megabytes unpack to gigabytes, or to millions of objects."""
    data = matlab(packed(struct.pack("<II", 14, size) + begin, piece, repeat=600))
    assert len(data) < 4e6
    with pytest.raises(BadInput, match=r"unpacks to more than \d+ MB"):
        read_source(source(data))


def test_a_log_of_a_few_kilobytes_cannot_unpack_to_what_fills_a_memory() -> None:
    """Zeros in bytes pack a thousand times, and as numbers, beside their time, take sixteen times more again."""
    import tracemalloc

    n = 54 << 20
    zeros = element(6, struct.pack("<II", 9, 0)) + element(5, struct.pack("<2i", n, 1)) + element(1, b"theta")
    tag = struct.pack("<II", 14, len(zeros) + 8 + n) + zeros + struct.pack("<II", 2, n)
    step = element(14, start(6, 1, 1).replace(b"a", b"h") + element(9, struct.pack("<d", 0.01)))
    data = matlab(step, packed(tag, bytes(1 << 20), repeat=54))
    assert len(data) < 300_000
    tracemalloc.start()
    most = 32 + 100 * len(data) // 2**20  # MB that any file may, and a hundred times its own size
    in_mb = f"{len(data) / 2**20:.3g}"
    with pytest.raises(BadInput, match=rf"unpacks to more than {most} MB, more than any log of a rig in {in_mb} MB"):
        read_source(source(data))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 150e6
