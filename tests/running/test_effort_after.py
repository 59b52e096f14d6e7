"""Is a run whose command was busy at rest told of as one, by what its log says?"""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from upright.gains import feedback, filtered, place
from upright.laws import as_values
from upright.rig.makes import make_rig
from upright.running.chapter import run_chapter
from upright.running.run import RunRequest, run_rig

RIG = make_rig("furuta")


def law_with_a_ripple(volts):
    """A law that holds the rig, and adds a command that changes its sign from sample to sample."""
    model = RIG.linear("inverted")
    sampled = model.to_sampled(RIG.period, RIG.delay / RIG.period)
    K = place(model.A, model.B, [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]).K
    law = feedback(filtered(sampled, 0.5), K, float(K[0, 0]))
    n = len(law.A)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[n, n] = law.A, -1.0
    return replace(
        law, A=A, B=np.vstack([law.B, np.zeros((1, law.B.shape[1]))]), C=np.hstack([law.C, [[volts]]]),
        initial=np.append(np.zeros(n), 1.0), begin=np.vstack([law.begin, np.zeros((1, law.begin.shape[1]))]),
    )  # fmt: skip


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    (folder / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\n', encoding="utf-8")
    return folder


def ran(bench, tmp_path, volts, **more):
    path = tmp_path / "law.json"
    path.write_text(json.dumps({"as_run": as_values(law_with_a_ripple(volts))}), encoding="utf-8")
    wish = {"rig": bench / "RIG.toml", "law": path, "seconds": 1.0, "check": False} | more
    return run_rig(RunRequest(**wish), tmp_path)


@pytest.mark.parametrize(("volts", "quiet"), [(0.25, True), (1.5, False)])
def test_a_ripple_beyond_a_tenth_of_the_limit_is_excessive_and_never_green(bench, tmp_path, volts, quiet):
    """A square wave of `volts` at half the sampling rate: its rms is its amplitude, 5 and 30 % of 5 V. In a sample
    it moves the arm by less than 86 rad/s^2/V x 1.5 V x T^2 = 1e-4 rad, a quarter of a count."""
    done = ran(bench, tmp_path, volts)
    assert done.sound  # it ran to its end
    assert done.effort.rms == pytest.approx(volts / 5, rel=0.05)
    assert done.effort.command.period == pytest.approx(2 * RIG.period)
    assert done.quiet is quiet
    told = run_chapter(done)
    assert told.verdict.split("Stabilised ")[1].startswith("for 1 s" if quiet else "with excessive effort for 1 s")
    assert told.numbers["effort"]["quiet"] is quiet
    if not quiet:
        assert not told.sound
        assert "upright design" in told.steps[1].command


def test_a_run_at_its_limit_for_more_than_five_milliseconds_saturates(bench, tmp_path):
    """By the log's own commands, on a drive of less and less."""
    done = ran(bench, tmp_path, 0.0, tilt=0.05, seconds=3.0)
    u = np.abs(done.log.columns["u_applied"])
    assert not done.saturates
    assert done.way_back.share == pytest.approx(u.max() / 5)
    for limit in (0.99 * u.max(), 0.5 * u.max()):
        weak = replace(done, end=replace(done.end, held=replace(done.end.held, command=limit)))
        full = np.sum(u >= limit - RIG.converter / 2)
        assert weak.way_back.saturated == pytest.approx(full / len(u))
        assert weak.saturates is bool(full * RIG.period > 5e-3)
    assert weak.saturates
    assert "Stabilised with saturation for 3 s" in weak.verdict
    facts = dict(run_chapter(weak).parts[0].content[0].pairs)
    assert "V, at the limit for" in facts["largest command"]


def test_what_follows_a_moving_reference_or_is_stopped_or_has_no_law_rests_nowhere(bench, tmp_path):
    done = ran(bench, tmp_path, 1.5)
    assert replace(done, end=replace(done.end, stopped="Somebody pressed stop.")).effort is None
    signal = run_rig(RunRequest(rig=bench / "RIG.toml", excite="sine 0.5 1.2", seconds=0.5), tmp_path)
    assert signal.effort is None
    assert signal.quiet
    assert ran(bench, tmp_path, 1.5, reference="sine 0.1 2.5").effort is None
    assert ran(bench, tmp_path, 1.5, reference="step 0.1").effort.rms == pytest.approx(0.3, rel=0.05)


def test_a_limit_of_the_supervisor_counts_where_it_is_below_that_of_the_drive(bench, tmp_path):
    done = ran(bench, tmp_path, 0.25)
    tight = replace(done, end=replace(done.end, held=replace(done.end.held, command=1.0)))
    assert tight.limit == 1.0
    assert tight.effort.rms == pytest.approx(5 * done.effort.rms)
    assert not tight.quiet
    assert math.isclose(done.limit, 5.0)
