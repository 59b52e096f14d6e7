"""Is what is known of a rig before it is identified off by its tolerance, and all else a guess?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.experiments.stand.known import bench_values, model_of
from upright.rig.makes import MAKES, make_rig


@pytest.mark.parametrize("key", MAKES)
def test_a_bench_errs_by_its_tolerance_from_rig_to_rig_and_not_on_the_rig_as_designed(key):
    """Normal, over 300 rigs: mean within 4/sqrt(300), scatter within 4/sqrt(600)."""
    make = MAKES[key]
    nominal = make_rig(key)
    assert bench_values(nominal, make) == {n: nominal.plant.parameters()[n] for n in make.bench}
    off = []
    for seed in range(1, 301):
        rig = make_rig(key, seed)
        true = rig.plant.parameters()
        off.append([(bench_values(rig, make)[n] / true[n] - 1) / s for n, s in make.bench.items() if s and true[n]])
    assert np.abs(np.mean(off, axis=0)).max() < 4 / np.sqrt(300)
    assert np.abs(np.std(off, axis=0) - 1).max() < 4 / np.sqrt(600)


@pytest.mark.parametrize("key", MAKES)
def test_a_fit_starts_from_the_design_and_takes_what_was_weighed_with_its_uncertainty(key):
    make = MAKES[key]
    design = make.rig.plant.parameters()
    name, other = make.sought[0], next(n for n in design if n not in make.sought)
    asked = model_of(make, {name: 0.5, other: 0.25}, {name: 0.02}).parameters
    assert (asked[name].value, asked[name].estimate, asked[name].uncertainty) == (0.5, False, pytest.approx(0.01))
    assert (asked[other].value, asked[other].uncertainty) == (0.25, 0.0)
    for n, value in design.items():
        if n not in (name, other):
            assert (asked[n].value, asked[n].estimate, asked[n].uncertainty) == (value, n in make.sought, 0.0)
        assert asked[n].lower == 0.0
    gain, delay, lag = (asked[f"actuator.{n}"] for n in ("gain", "delay", "lag"))
    assert (gain.value, gain.estimate, gain.unit) == (make.rig.gain, True, make.gain_unit)
    assert (delay.value, delay.estimate) == (make_rig(key).delay, False)  # what the computer does is known
    assert (lag.value, lag.estimate) == (1e-3, True)
