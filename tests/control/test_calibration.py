"""Are the figures of the calibration benchmark the ones that carry these names?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.regulation import calibration


def test_murphy_s_parts_make_up_the_brier_score():
    """brier = reliability - resolution + uncertainty, exactly where all chances of a bin are one (Murphy 1973)."""
    rng = np.random.default_rng(5)
    chances = rng.choice([0.05, 0.35, 0.55, 0.95], 300)
    found = calibration(chances, rng.random(300) < chances**2)
    assert found.brier == pytest.approx(found.reliability - found.resolution + found.uncertainty, abs=1e-12)
    assert found.skill == pytest.approx((found.resolution - found.reliability) / found.uncertainty)


@pytest.mark.parametrize("came", [True, False])
def test_chances_of_twins_that_all_end_alike_have_no_skill_to_speak_of(came):
    """The uncertainty of the outcomes is zero, and skill is a share of it; the Brier score is still a number."""
    found = calibration(np.array([0.8, 0.6]), np.array([came, came]))
    assert found.uncertainty == 0.0
    assert found.skill is None
    assert found.brier == pytest.approx((0.04 + 0.16) / 2 if came else (0.64 + 0.36) / 2)


def test_spiegelhalter_s_z_is_standard_normal_for_right_chances_and_not_for_bold_ones():
    rng = np.random.default_rng(6)
    z: list[float] = []
    for _ in range(400):
        chances = rng.random(200)
        z.append(calibration(chances, rng.random(200) < chances).z)
    # of 400 draws, mean and standard deviation are known to 1/20 and 1/28; three of each are allowed
    assert abs(np.mean(z)) < 3 / 20
    told = np.full(100, 0.5)
    assert calibration(told, np.arange(100) < 60).z_of_all == pytest.approx(2.0)  # 10 more than 50, of sd 5
    assert np.std(z) == pytest.approx(1.0, abs=3 / math.sqrt(800))
    truth = rng.uniform(0.3, 0.7, 500)
    bold = np.where(truth > 0.5, 0.95, 0.05)
    assert calibration(bold, rng.random(500) < truth).z > 5
