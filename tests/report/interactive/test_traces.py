"""Are traces for a page samples of the run itself, its extremes among them, within the room there is?"""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from upright.report.interactive.script import script
from upright.report.interactive.traces import MOST, TracePanel, extreme_rows, traces


def values(packed):
    """What was packed, undone by hand."""
    levels = np.frombuffer(base64.b64decode(packed["levels"]), dtype="<i2").astype(float)
    return np.where(levels == -32768, np.nan, packed["middle"] + packed["scale"] * levels)


def times(run):
    if "t" in run:
        return np.frombuffer(base64.b64decode(run["t"]), dtype="<f8")
    rows = np.cumsum(np.frombuffer(base64.b64decode(run["ahead"]), dtype="<u2").astype(int))
    return run["start"] + run["step"] * rows


def test_a_spike_of_one_sample_among_a_million_is_kept():
    y = np.sin(np.arange(1_000_000) * 1e-3)
    y[345_678], y[765_432] = 7.0, -9.0
    rows = extreme_rows([y], y.size, 2000)
    assert {345_678, 765_432, 0, 999_999} <= set(rows.tolist())
    assert rows.size <= 2000
    assert np.all(np.diff(rows) > 0)


@pytest.mark.parametrize("samples", [2, 3, 199, 2001, 10_007])
def test_every_stretch_keeps_its_least_and_greatest(samples):
    rng = np.random.default_rng(samples)
    a, b = rng.normal(size=(2, samples))
    rows = extreme_rows([a, b], samples, 200)
    wide = -(-samples // max(1, 198 // 4)) if samples > 200 else 1
    for first in range(0, samples, wide):
        inside = rows[(rows >= first) & (rows < first + wide)]
        for y in (a, b):
            part = y[first : first + wide]
            assert (y[inside].min(), y[inside].max()) == (part.min(), part.max())


@pytest.mark.parametrize("uniform", [True, False])
def test_what_is_packed_is_the_run_to_sixteen_bits_of_each_line(uniform):
    rng = np.random.default_rng(1)
    t = 3.0 + 1e-3 * np.arange(900) if uniform else 3.0 + np.sort(rng.uniform(0, 1, 900))
    y = 2.0 * np.cos(5 * t)
    model = y - 1e-6 * rng.normal(size=t.size)  # a residual a millionth of the signal
    y[17] = np.nan
    run = json.loads(traces(t, [TracePanel(name="θ", unit="rad", measured=y, models={"model": model})], name="run"))
    panel = run["panels"][0]
    assert times(run) == pytest.approx(t, abs=1e-12)
    half = np.nanmax(np.abs(y)) / 32767 / 2
    np.testing.assert_allclose(values(panel["measured"]), y, atol=half * 1.001)
    left = values(panel["models"][0]["values"])
    np.testing.assert_allclose(left, y - model, atol=np.nanmax(np.abs(y - model)) / 32767)
    assert np.isnan(left[17])


def test_a_band_without_bound_is_still_seen_where_it_is_narrow():
    """One of 1e5 rad at the end took all 16 bits, and looked like none where it was half a degree."""
    t = 1e-3 * np.arange(900)
    y = np.sin(5 * t)
    band = 0.01 * np.exp(18 * t)
    panel = TracePanel(name="θ", unit="rad", measured=y, models={"model": y + 0.1}, bands={"model": band})
    shown = values(json.loads(traces(t, [panel], name="run"))["panels"][0]["models"][0]["band"])
    np.testing.assert_allclose(shown[band < 1], band[band < 1], rtol=0.05)
    assert np.all(y + 0.1 + shown[-1] > y.max())


def test_a_million_samples_take_the_room_they_are_given():
    t = np.arange(1_000_000) * 1e-3
    panels = [TracePanel(name=n, unit="rad", measured=np.sin(t * (k + 1)), models={"model": np.sin(t * (k + 1)) + 1e-3})
              for k, n in enumerate("ab")]  # fmt: skip
    for room in (20_000, 40_000):
        text = traces(t, panels, name="long", room=room)
        assert 0.4 * room < len(text) < 1.1 * room + 1500
    assert json.loads(traces(t, panels, name="long", room=10**9))["of"] == 1_000_000
    assert times(json.loads(traces(t, panels, name="long", room=10**9))).size <= MOST


def test_a_name_cannot_end_the_script_that_it_stands_in():
    text = traces(np.arange(3.0), [TracePanel(name="</script><script>", unit="", measured=np.ones(3))], name="<!--")
    assert "<" not in text
    assert json.loads(text)["panels"][0]["name"] == "</script><script>"


def test_script_and_library_stay_below_seventy_kilobytes_and_name_their_licence():
    assert len(script()) < 70_000
    assert "MIT License" in script()
    assert "http" not in script()
    assert "eval(" not in script()
    assert "new Function" not in script()
