"""How does lmfit see this fit? Its `Parameters`, with names, bounds, values and errors as lmfit writes them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from upright.identification.model.model import Fit


def to_lmfit(fit: Fit) -> Any:
    """`lmfit.Parameters` of a fit: known numbers do not vary, estimated ones carry bounds, error and correlation.

    lmfit allows no dots in names: ``actuator.gain`` becomes ``actuator_gain``. A number the data cannot see has
    an infinite standard error, as here.
    """
    from lmfit import Parameters

    parameters = Parameters()
    names = {n: n.replace(".", "_") for n in {**fit.rig.parameters, **fit.estimates}}
    for name, key in names.items():
        known = fit.rig.parameters.get(name)
        e = fit.estimates.get(name)
        value = e.value if e is not None else known.value if known is not None else 0.0
        lower, upper = (known.lower, known.upper) if known is not None else (-math.inf, math.inf)
        if known is not None and name in fit.rig.plant.names():
            q = fit.rig.plant.quantity(name)
            lower, upper = max(lower, q.lower), min(upper, q.upper)
        parameters.add(key, value=value, vary=e is not None and e.status != "left out", min=lower, max=upper)
        if e is not None:
            parameters[key].stderr = e.stderr
    for i, name in enumerate(fit.names):
        row = np.asarray(fit.correlation[i])
        parameters[names[name]].correl = {names[n]: float(row[j]) for j, n in enumerate(fit.names) if j != i}
    return parameters
