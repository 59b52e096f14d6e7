"""Are arrays that NumPy saved the log that they were, whatever a damaged file says of itself?"""

from __future__ import annotations

import io
from contextlib import suppress

import numpy as np
import pytest
from numpy.lib import format as npy

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.formats.arrays import READER
from upright.readers.source import Source

T = np.arange(50) * 0.01
THETA, PSI = np.cos(6 * T), np.sin(6 * T)


def source(save, *arrays, **named) -> Source:
    stream = io.BytesIO()
    save(stream, *arrays, **named)
    return Source(file="log.npz", data=stream.getvalue())


SAVED = {
    "by name": source(np.savez, t=T, theta=THETA, psi=PSI, mass=0.2, rig="Furuta"),
    "compressed": source(np.savez_compressed, theta=THETA, psi=PSI, time_ms=1e3 * T),
    "whole numbers": source(np.savez, t_us=np.round(1e6 * T).astype("i8"), theta=THETA, psi=PSI.astype("f8")),
    "stamps": source(np.savez, time=np.datetime64("2026-11-28T12:00:00.5") + np.round(1e6 * T).astype("m8[us]"),
                     theta=THETA, psi=PSI),
    "records": source(np.save, np.rec.fromarrays([T, THETA, PSI], names="t,theta,psi")),
    "a period": source(np.savez, theta=THETA, psi=PSI, dt=0.01),
}  # fmt: skip


@pytest.mark.parametrize("way", SAVED)
def test_what_was_saved_is_read(way):
    log = read_source(SAVED[way])
    assert log.provenance.reader == "numpy"
    np.testing.assert_allclose(log.t, T, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(log["theta"], THETA)
    np.testing.assert_array_equal(log["psi"], PSI)


def test_settings_become_notes():
    assert {"mass = 0.2.", "rig = 'Furuta'."} <= set(read_source(SAVED["by name"]).provenance.notes)


def test_the_first_column_of_a_table_is_the_time():
    log = read_source(source(np.save, np.column_stack([T, THETA, PSI])))
    np.testing.assert_array_equal(log.t, T)
    np.testing.assert_array_equal(log[log.names[0]], THETA)


def test_objects_are_refused_and_never_unpickled():
    class Harm:
        def __reduce__(self):
            return (pytest.fail, ("it was unpickled",))

    with pytest.raises(BadInput, match="Python objects"):
        read_source(source(np.savez, t=T, theta=np.array([Harm()], dtype=object)))


def test_an_array_that_its_header_makes_larger_than_the_file_is_refused_before_it_is_allocated():
    stream = io.BytesIO()
    npy.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (5 * 10**12,)})
    with pytest.raises(BadInput, match="bytes for an array of 5000000000000"):
        read_source(Source(file="log.npy", data=stream.getvalue() + T.tobytes()))


def test_a_bomb_is_refused():
    with pytest.raises(BadInput, match="more than any log holds"):
        read_source(source(np.savez_compressed, t=np.zeros(8 << 20)))


@pytest.mark.parametrize("way", ["by name", "compressed", "records"])
def test_a_damaged_file_is_read_or_refused_in_a_sentence(way):
    rng, data = np.random.default_rng(5), SAVED[way].data
    for _ in range(150):
        spoiled = bytearray(data[: rng.integers(1, len(data))] if rng.random() < 0.3 else data)
        for at in rng.integers(0, len(spoiled), 3):
            spoiled[at] = rng.integers(0, 256)
        content = Source(file="log.npz", data=bytes(spoiled))
        with suppress(BadInput):
            read_source(content)


def test_other_archives_are_none_of_numpy():
    assert not READER.recognises(Source(file="a.xlsx", data=b"PK\x03\x04" + b"[Content_Types].xml" * 90))
