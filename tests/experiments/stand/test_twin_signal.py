"""Does a twin's drive rest before the signal that it is given, as a board's does?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upright.experiments.stand.twin import TwinStand
from upright.rig.makes import make_rig


def test_a_signal_that_begins_at_once_moves_a_twin_as_it_does_one_sample_later(tmp_path):
    """Shifting the signal in time shifts the motion; the drive has a delay and a lag, which begin at rest."""
    rig = make_rig("linear", 1)
    rig = rig.replace(delay=2 * rig.period, lag=1.5 * rig.period, offset=0.0)
    stand = TwinStand(rig=replace(rig, mounting=None))
    signal = np.full(200, 0.5)
    at_once = stand.run(signal, tmp_path, "at_once")
    later = stand.run(np.concatenate([[0.0], signal]), tmp_path, "later")
    for name in at_once.outputs:
        step = np.ptp(later[name]) / 1000  # counts are rounded; the drive's pre-charge moved it by 2 %
        np.testing.assert_allclose(at_once[name], later[name][1:], atol=step)
