"""Do bands come back from a fit.json as they were written?"""

import numpy as np

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.estimate import identify
from upright.physics import Pendulum
from upright.study.load import Study
from upright.study.results import write_fit
from upright.study.stored_fit import read_fit


def test_bands_come_back_as_they_were_written(tmp_path):
    run = noisy(swing(seconds=4.0), 1e-3, seed=1)
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), [run])
    path = tmp_path / "fit.json"
    write_fit(fit, Study(path=path, plant="pendulum", model=fit.model, runs=(run,), title="", source=""), path)
    back = read_fit(path).bands
    assert back is not None
    assert fit.bands is not None
    assert (back.level, back.quantile, back.names) == (fit.bands.level, fit.bands.quantile, fit.bands.names)
    assert (back.spreads, back.reached) == (fit.bands.spreads, fit.bands.reached)
    np.testing.assert_array_equal(back.covariance, fit.bands.covariance)
