"""Is a counter that passes its end counted on, and nothing else?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.readers import read_source
from upright.readers.source import Source
from upright.readers.wrapped import unwrapped

T = 0.002 * np.arange(4000)
TURNS = np.round(16000 / (2 * np.pi) * (30 * T + 4 * np.sin(3 * T)))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("bits", "form"), [(16, np.int16), (16, np.uint16), (8, np.int8), (8, np.uint8), (32, np.int32), (32, np.uint32)]
)
def test_a_counter_of_so_many_bits_is_counted_on_from_its_first_reading(bits, form, sign):
    """As the processor itself counts in more bits, in steps of at most a tenth of the range."""
    swiftest = np.abs(np.diff(TURNS)).max()
    counts = sign * np.round(TURNS * 0.1 * 2.0**bits / swiftest)
    logged = counts.astype(np.int64).astype(form).astype(float)
    values, told, times = unwrapped(logged)
    assert told == bits
    lowest = float(np.iinfo(form).min)
    assert times == int((np.diff((counts - lowest) // 2.0**bits) != 0).sum())
    np.testing.assert_array_equal(values - values[0], counts - counts[0])


@pytest.mark.parametrize(
    "values",
    [
        np.where(np.sin(7 * T) > 0, 32767.0, -32768.0),  # bangs from end to end
        32767.0 * np.sin(7 * T),  # no whole numbers
        np.round(30000 * np.sin(3 * T)),  # stays short of the ends
        np.random.default_rng(1).integers(-32768, 32768, T.size).astype(float),  # jumps by any amount
        np.round(40000 * np.sin(3 * T)),  # more bits than 16
        np.zeros(T.size),
    ],
    ids=["bang-bang", "fractions", "short", "noise", "wider", "nothing"],
)
def test_what_is_no_such_counter_stays_as_it_is(values):
    same, bits, times = unwrapped(values)
    np.testing.assert_array_equal(same, values)
    assert bits == times == 0


def test_the_record_says_which_column_was_counted_on_and_how_often():
    wrapped = (TURNS + 32768) % 65536 - 32768
    rows = "\n".join(f"{t:.3f},{c:.0f},{np.cos(t):.4f}" for t, c in zip(T, wrapped, strict=True))
    record = read_source(Source(file="log.csv", data=f"time,enc,theta\n{rows}\n".encode()))
    np.testing.assert_array_equal(record["enc"], TURNS)
    passed = int((np.diff((TURNS + 32768) // 65536) != 0).sum())
    assert f"'enc' is a counter of 16 bits and passed its end {passed} times; it is counted on here." in (
        record.provenance.notes
    )
