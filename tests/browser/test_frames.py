"""Are frames what the contract says, read by a second reader that was written from its words alone?"""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upright.browser.frames import frames, step_of
from upright.realtime.desk import ROW


def decoded(content):
    """First tick, counts by sample and encoder, commands, late ticks."""
    at = 0

    def take(kind, n=1):
        nonlocal at
        values = struct.unpack_from(f"<{n}{kind}", content, at)
        at += struct.calcsize(f"<{n}{kind}")
        return values

    (first,), (n,), (channels,), (late,) = take("I"), take("H"), take("B"), take("B")
    counts = []
    for _ in range(channels):
        (base,) = take("i")
        counts.append([base + d for d in take("h", n)])
    (scale,) = take("f")
    commands = [scale * d for d in take("h", n)]
    assert at == len(content)
    return first, list(zip(*counts, strict=True)), commands, late


def rows_of(ticks, counts, applied, late):
    rows = np.zeros(len(ticks), dtype=ROW)
    rows["tick"], rows["applied"], rows["late"] = ticks, applied, late
    rows["counts"][:, : len(counts[0])] = counts
    return rows


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.integers(1, 3), st.integers(-(2**31), 2**31 - 1), st.integers(-(2**17), 2**17),
            st.integers(-16384, 16384), st.integers(0, 400),
        ),
        min_size=1, max_size=40,
    )
)  # fmt: skip
def test_frames_hold_every_sample_whatever_jumps_and_whatever_is_missing(samples):
    """Command in converter steps, which come back as they are; counts of 32 bits, ticks with gaps."""
    ticks = np.cumsum([s[0] for s in samples])
    counts = [s[1:3] for s in samples]
    step = step_of(5.0, 10 / 32768)
    late = np.cumsum([s[4] for s in samples])
    rows = rows_of(ticks, counts, [s[3] * step for s in samples], late)
    seen, commands, missed = [], [], 0
    for content in frames(rows, 2, step, 0):
        first, some, applied, more = decoded(content)
        seen += [(first + k, *c) for k, c in enumerate(some)]
        commands += applied
        missed += more
        assert more <= 255
    assert seen == [(t, *c) for t, c in zip(ticks.tolist(), counts, strict=True)]
    assert commands == pytest.approx([s[3] * step for s in samples], rel=1e-6)
    assert missed <= late[-1]


def test_a_sample_of_two_encoders_takes_less_than_eight_bytes_at_40_frames_a_second():
    n = 25  # of 1 kHz
    rows = rows_of(range(1, n + 1), [(k, -k) for k in range(n)], np.zeros(n), np.zeros(n))
    assert len(b"".join(frames(rows, 2, 1e-3, 0))) / n < 8


@pytest.mark.parametrize(
    ("limit", "converter", "step"), [(5.0, 1e-3, 1e-3), (5.0, 0.0, 5 / 32767), (5.0, 1e-6, 5 / 32767)]
)
def test_a_step_is_the_converter_s_unless_the_limit_has_too_many(limit, converter, step):
    assert step_of(limit, converter) == pytest.approx(step)
    assert limit / step_of(limit, converter) <= 32767 * (1 + 1e-12)
