"""Does a damaged log give a valid record or one sentence, and never anything else?

A few hundred mutations run every time. ``UPRIGHT_FUZZ=10000`` runs that many, and copies of the real logs are
mutated too when ``UPRIGHT_REAL_DATA`` names them.
"""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.readers.logs import FOLDER, SYNTHETIC
from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source

TRIALS = int(os.environ.get("UPRIGHT_FUZZ", "400"))
HEAD = 24_000  # bytes; damage looks the same in the first rows of a large log
STRANGE = (b"nan", b"inf", b"1e999", b"-", b"", b"\x00", b"\xff\xfe", b"1e300", b"--3", b"9" * 400, b"0x1F", b"1_0")
SIGNS = b'0123456789.,;[]\t\n\r eE+-#%\x00\xff"/'


def originals() -> list[tuple[str, bytes]]:
    found = [(name, make()) for name, make in SYNTHETIC.items()]
    if FOLDER:
        suffixes = {".csv", ".txt", ".mat"}
        paths = sorted(p for p in Path(FOLDER).rglob("*") if p.suffix in suffixes and "README" not in p.name)
        found += [(path.name, head(path)) for path in paths]
    return found


def head(path: Path) -> bytes:
    """Beginning of a log that is a whole log in itself: complete rows, or shorter vectors under the same names."""
    data = path.read_bytes()
    if path.suffix == ".mat":
        return shortened(data)
    if len(data) <= HEAD:
        return data
    cut = data[: data.rindex(b"\n", 0, HEAD) + 1]
    return cut.rstrip(b";\r\n") + b"]\r\n" if b"\n[" in cut else cut


def shortened(data: bytes) -> bytes:
    """MATLAB file with shorter vectors, not compressed, so that damage reaches the numbers behind zlib's checksum."""
    from scipy.io import loadmat, savemat

    content = {k: v for k, v in loadmat(io.BytesIO(data)).items() if not k.startswith("__")}
    if any(v.dtype == object or "signals" in (v.dtype.names or ()) for v in content.values()):
        return data[:HEAD]
    file = io.BytesIO()
    savemat(file, {k: v if v.dtype.names else np.ravel(v)[:500] for k, v in content.items()})
    return file.getvalue()


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """Copy with one to three kinds of damage."""
    out = bytearray(data)
    for _ in range(int(rng.choice((1, 1, 2, 3)))):
        at = int(rng.integers(0, max(len(out), 1)))
        span = int(rng.integers(1, 60))
        match int(rng.integers(0, 9)):
            case 0:
                del out[at:]
            case 1:
                del out[at : at + span]
            case 2:
                out[at : at + 1] = bytes([int(rng.integers(0, 256))])
            case 3:
                out[at:at] = STRANGE[int(rng.integers(0, len(STRANGE)))]
            case 4:
                other = int(rng.integers(0, max(len(out), 1)))
                out[at:at] = out[other : other + span]
            case 5:
                out[at : at + 1] = SIGNS[(k := int(rng.integers(0, len(SIGNS)))) : k + 1]
            case 6:
                lines = bytes(out).split(b"\n")
                i, j = rng.integers(0, len(lines), 2).tolist()
                lines[i], lines[j] = lines[j], lines[i]
                out = bytearray(b"\n".join(lines))
            case 7:
                lines = bytes(out).split(b"\n")
                i = int(rng.integers(0, len(lines)))
                cells = lines[i].split(b",") if b"," in lines[i] else lines[i].split(b"\t")
                cells[int(rng.integers(0, len(cells)))] = STRANGE[int(rng.integers(0, len(STRANGE)))]
                lines[i] = b",".join(cells)
                out = bytearray(b"\n".join(lines))
            case _:
                out[at : at + span] = rng.bytes(span)
    return bytes(out)


def judge(name: str, data: bytes) -> bool:
    """Whether content is a valid record; False when it is refused with a sentence, and nothing else may happen."""
    if not data.strip():
        return False
    try:
        record = read_source(Source(file=name, data=data))
    except BadInput as error:
        sentence = str(error)
    else:
        sentence = ""
    if sentence:
        assert sentence.endswith((".", "?")), sentence
        assert "\n" not in sentence
        return False
    assert len(record) >= 2
    assert (np.diff(record.t) > 0).all()
    assert all(np.isfinite(record[column]).all() and record[column].size == len(record) for column in record.names)
    return True


@pytest.mark.parametrize("name", SYNTHETIC)
def test_an_undamaged_log_is_read(name: str) -> None:
    assert judge(name, SYNTHETIC[name]())


def test_a_damaged_log_is_a_valid_record_or_one_sentence() -> None:
    logs = originals()
    rng = np.random.default_rng(2)
    read = sum(judge(name, mutate(data, rng)) for name, data in (logs[i % len(logs)] for i in range(TRIALS)))
    # Some damage is harmless (a changed digit) and some is not; both must occur, or nothing was tried.
    assert 0.02 * TRIALS < read < 0.9 * TRIALS
    print(f"{TRIALS} mutations of {len(logs)} logs: {read} read, {TRIALS - read} refused")


@settings(deadline=None, max_examples=150)
@given(st.sampled_from(sorted(SYNTHETIC)), st.data())
def test_any_cut_and_any_splice_is_a_valid_record_or_one_sentence(name: str, data: st.DataObject) -> None:
    content = SYNTHETIC[name]()
    cut = data.draw(st.integers(0, len(content)))
    splice = data.draw(
        st.binary(max_size=30) | st.text(alphabet="0123456789.,;[]\t\n eE-", max_size=30).map(str.encode)
    )
    judge(name, content[:cut] + splice + content[data.draw(st.integers(cut, len(content))) :])


@settings(deadline=None)
@given(st.binary(max_size=400), st.sampled_from(["log.csv", "log.mat", "log.txt"]))
def test_any_bytes_are_a_valid_record_or_one_sentence(data: bytes, name: str) -> None:
    judge(name, data)


@settings(deadline=None)
@given(st.binary(max_size=300))
def test_any_bytes_after_a_matlab_header_are_a_valid_record_or_one_sentence(data: bytes) -> None:
    judge("log.mat", SYNTHETIC["plain.mat"]()[:128] + data)


@settings(deadline=None)
@given(st.text(alphabet='01.,;\t\n -e#[]tx"', max_size=200))
def test_any_table_like_text_is_a_valid_record_or_one_sentence(text: str) -> None:
    judge("log.csv", text.encode())
