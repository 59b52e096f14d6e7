"""A fit made by hand: nothing here was estimated, so that every number on the page is known beforehand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.identification import Estimate, Fit, GreyBox, Parameter, RunScore
from upright.physics import Furuta


def make_swing(role="fit", *, n=2000, horizon=None, seconds=10.0, seed=0):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, seconds, n)
    theta = 1.5 * np.exp(-0.15 * t) * np.cos(7.3 * t)
    psi = 0.4 * np.exp(-0.2 * t) * np.sin(7.3 * t) - 0.02 * t
    clean = np.column_stack([psi, theta])
    y = clean + rng.normal(0, 0.01, clean.shape)
    off = np.linalg.norm(y - clean, axis=0) / np.linalg.norm(y - y.mean(0), axis=0)
    return RunScore(
        role=role,
        fit_percent={"psi": 100 * (1 - off[0]), "theta": 100 * (1 - off[1])},
        horizon=horizon,
        t=t,
        y=y,
        simulated=clean,
        measured=("psi", "theta"),
    )


def make_fit():
    names = ("J_d", "J_p", "b_1", "b_2", "b_1c", "b_2c")
    values = (6.3e-3, 1.1e-3, 3.2e-4, 1.4e-5, 2.5e-3, 3.1e-4)
    parameters = {
        "m_p": Parameter(name="m_p", value=0.1, unit="kg", meaning="mass of the pendulum", uncertainty=1e-3),
        "l_cg": Parameter(name="l_cg", value=0.15, unit="m", meaning="hinge to centre of gravity"),
        "r": Parameter(name="r", value=0.16, unit="m", meaning="arm"),
        "g": Parameter(name="g", value=9.81, unit="m/s^2", meaning="gravity"),
        **{
            n: Parameter(
                name=n, value=v, unit=Furuta.quantity(n).unit, meaning=Furuta.quantity(n).meaning, estimate=True
            )
            for n, v in zip(names, values, strict=True)
        },
    }
    estimates = {
        n: Estimate(
            value=v, stderr=0.02 * v, interval=(0.96 * v, 1.04 * v), unit=parameters[n].unit, status="well determined"
        )
        for n, v in zip(names, values, strict=True)
    }
    estimates["b_2"] = Estimate(
        value=1.4e-5, stderr=9e-5, interval=(0.0, math.inf), unit="N m s/rad", status="poorly determined"
    )
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    correlation = np.eye(6)
    correlation[2, 4] = correlation[4, 2] = -0.94
    correlation[0, 1] = correlation[1, 0] = 0.31
    initial = {
        "theta": Estimate(value=1.5, stderr=0.002, interval=(1.496, 1.504), unit="rad", status="well determined")
    }
    return Fit(
        model=GreyBox(plant=Furuta, parameters=parameters),
        estimates=estimates,
        per_run={"release": initial},
        runs={
            "release": make_swing(),
            "tail": make_swing("predict", seed=1),
            "windows": make_swing("predict", horizon=0.5, seed=2),
        },
        verdict="Both angles follow the data to within two percent.",
        trusted=True,
        method="simplex, then Levenberg-Marquardt",
        evaluations=321,
        seconds=1.23,
        cost=0.456,
        names=names,
        correlation=correlation,
        singular_values=np.array([1.0, 0.3, 0.05, 2e-2, 1e-3, 2e-13]),
        directions=basis,
        unseen=("Mass, inertia and friction can all be scaled together; give one of them as known, for instance J_d.",),
        warnings=("The base may be out of level.",),
        history=(("start", 12.0, 1), ("simplex", 0.9, 200), ("least squares", 0.456, 120)),
    )


@pytest.fixture
def fit():
    return make_fit()


@pytest.fixture
def changed(fit):
    return lambda **what: replace(fit, **what)


@pytest.fixture
def swing():
    return make_swing
