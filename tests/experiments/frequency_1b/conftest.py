"""Experiment 1b on a pendulum on a cart, as short as its page allows."""

from __future__ import annotations

import numpy as np
import pytest

from upright.experiments.frequency_1b.run import FrequencyRun
from upright.experiments.frequency_1b.sweeps import stepped_sine
from upright.experiments.stand.known import bench_values, model_of
from upright.identification.frequency.answer import explain
from upright.identification.frequency.response import FrequencyResponse
from upright.rig.makes import MAKES, make_rig


@pytest.fixture(scope="session")
def hurried():
    """Three sines of eight seconds each: too short for the two slow ones, which swing on."""
    return stepped_sine(make_rig("linear"), MAKES["linear"], count=3, seconds=8.0)


@pytest.fixture(scope="session")
def done(hurried, tmp_path_factory):
    """The pendulum's own linear model at eight frequencies, explained, as if the hurried sines had told it."""
    rig, make = make_rig("linear"), MAKES["linear"]
    model = rig.linear("hanging")
    omega = np.geomspace(*make.band, 8)
    answer = np.array([(model.C @ np.linalg.solve(1j * w * np.eye(4) - model.A, model.B))[:, 0] for w in omega])
    data = FrequencyResponse(
        omega=omega, response=answer, outputs=("x", "theta"), units=("m", "rad", "V"),
        variance=1e-6 * np.abs(answer) ** 2, dry=4 / (np.pi * np.abs(answer) * omega[:, None]),
    )  # fmt: skip
    explained = explain(model_of(make, bench_values(rig, make), make.bench), "hanging", data)
    return FrequencyRun(
        rig=rig, make=make, sweep=hurried, answer=explained, folder=tmp_path_factory.mktemp("told"), kind="sines",
        seconds=1.0,
    )  # fmt: skip
