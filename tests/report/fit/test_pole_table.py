"""Does the table of poles tell a frequency that is positive, or that there is none?"""

import math

from upright.identification.model.fit import Estimate, Pole
from upright.report.fit.tables import pole_table


def swings_at(fit, hertz, low, high, stderr):
    turn = 2 * math.pi
    imag = Estimate(value=turn * hertz, stderr=turn * stderr, interval=(turn * low, turn * high), unit="rad/s")
    damped = Estimate.within(-0.5, 0.01, 0.02, "1/s")
    return pole_table(fit(poles={"hanging": (Pole(real=damped, imag=imag),)})).rows[0][-1]


def test_a_frequency_is_told_with_its_interval(changed):
    assert swings_at(changed, 1.8, 1.7, 1.91, 0.05) == "1.800 Hz (1.700 to 1.910)"


def test_a_frequency_that_may_be_none_is_not_determined(changed):
    assert swings_at(changed, 1.8, 0.0, 6.6, 2.4) == "not determined; below 6.6 Hz"
