"""lmfit's own report reads our fits."""

from __future__ import annotations

import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification import to_lmfit
from upright.identification.estimate import identify
from upright.physics import Pendulum


def test_parameters_cross_the_border() -> None:
    from lmfit import fit_report

    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3}), [noisy(swing(), 1e-3, seed=1)])
    parameters = to_lmfit(fit)
    assert not parameters["m_p"].vary
    assert parameters["b_2"].min == 0.0
    for name, e in fit.estimates.items():
        assert parameters[name].value == pytest.approx(e.value)
        assert parameters[name].stderr == pytest.approx(e.stderr)
    assert parameters["b_2"].correl["b_2c"] == pytest.approx(parameters["b_2c"].correl["b_2"])
    assert "b_2c" in fit_report(parameters)
