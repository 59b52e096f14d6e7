"""What its parameters are: fits of a plant to logs, and how sure that is. ::

    study = upright.study.load_study("study.toml")
    fit = identify(study.rig, study.runs)
    print(fit.verdict, fit.estimates["J_p"].interval)
    ahead = predict(fit, study.rig, other.runs)

The names are fetched when they are first used, so that a reader of fits does not wait for the solver.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upright.identification.estimate import METHODS, fit_percent, identify, predict
    from upright.identification.model.fit import Estimate, Fit, RunScore, to_lmfit
    from upright.identification.model.grey_box import GreyBox, Parameter
    from upright.identification.model.runs import Run
    from upright.identification.search.curve import CurveFit, fit_curve

__all__ = [
    "METHODS",
    "CurveFit",
    "Estimate",
    "Fit",
    "GreyBox",
    "Parameter",
    "Run",
    "RunScore",
    "fit_curve",
    "fit_percent",
    "identify",
    "predict",
    "to_lmfit",
]

_HOMES = {
    "estimate": ("METHODS", "fit_percent", "identify", "predict"),
    "model.fit": ("Estimate", "Fit", "RunScore", "to_lmfit"),
    "model.grey_box": ("GreyBox", "Parameter"),
    "model.runs": ("Run",),
    "search.curve": ("CurveFit", "fit_curve"),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
