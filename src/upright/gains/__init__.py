"""Which gain does the rig need, and what is it worth? A linear model goes in, wherever its numbers came from."""

from upright.gains.loop import feedback, margins, place_sampled
from upright.gains.lqr import dlqr, locus, lqr, weight_for_effort
from upright.gains.margins import Margins
from upright.gains.placement import Placement, place, prefilter
from upright.gains.velocity import Estimator, difference, filtered, kalman, placed_observer, process_noise, read_off

__all__ = [
    "Estimator",
    "Margins",
    "Placement",
    "difference",
    "dlqr",
    "feedback",
    "filtered",
    "kalman",
    "locus",
    "lqr",
    "margins",
    "place",
    "place_sampled",
    "placed_observer",
    "prefilter",
    "process_noise",
    "read_off",
    "weight_for_effort",
]
