"""Does the trend of a memory have the interval that it says?"""

import numpy as np
import pytest

from benchmarks.bench_soak import trend


def test_the_interval_of_a_trend_holds_the_true_slope_95_times_in_100():
    generator = np.random.default_rng(5)
    t = np.linspace(0.0, 0.25, 400)
    slopes = [trend(t, 80.0 + 3.0 * t + generator.normal(0, 0.5, t.size)) for _ in range(1000)]
    held = sum(abs(slope - 3.0) <= half for slope, half in slopes)
    assert 930 <= held <= 970  # a binomial's three standard deviations are 21 of 950


def test_a_memory_that_grows_steadily_is_known_to_grow():
    t = np.linspace(0.0, 0.25, 400)
    slope, half = trend(t, 80.0 + 12.0 * t)
    assert (slope, half) == (pytest.approx(12.0), pytest.approx(0.0, abs=1e-6))
