"""Does the estimator find NIST's certified values? 14 nonlinear problems, each from both certified starts.

Digits are those that agree with the certified value in the worst parameter: ``-log10(|b - c|/|c|)``. NIST Statistical
Reference Datasets, nonlinear regression (public domain).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Line, of_each

CERTIFIED = Path(__file__).parents[1] / "tests" / "identification" / "search" / "nist_strd.json"


def problems() -> list[dict[str, Any]]:
    """Every problem: name, model, data, starts, certified values and standard deviations."""
    return json.loads(CERTIFIED.read_text(encoding="utf-8"))["datasets"]


def model(problem: dict[str, Any]) -> Callable[[np.ndarray], np.ndarray]:
    """The certified formula as a function of its numbers b1, b2, ..."""
    code = compile(problem["model"], problem["name"], "eval")
    known = {"exp": np.exp, "cos": np.cos, "sin": np.sin, "pi": np.pi, "x": np.array(problem["x"])}
    return lambda b: eval(code, {"__builtins__": {}, **known, **{f"b{i + 1}": v for i, v in enumerate(b)}})


def digits(found: np.ndarray, certified: list[float]) -> float:
    """Decimal digits that agree, in the worst number; at most 11, which is what is printed."""
    c = np.array(certified)
    return float(np.min(-np.log10(np.maximum(np.abs(found - c) / np.abs(c), 1e-11))))


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """One line per problem and start."""
    from upright.identification.search.curve import fit_curve

    progress("14 problems from both starts")
    lines: list[Line] = []
    for problem in problems():
        for start in ("start1", "start2"):
            (fit,), seconds = of_each(lambda p, s=start: fit_curve(model(p), p["y"], p[s]), [problem])
            parameters = digits(fit.values, problem["certified"])
            errors = digits(fit.stderr, problem["certified_sd"])
            note = f"digits: parameters {parameters:.1f}, standard errors {errors:.1f}; {fit.evaluations} evaluations"
            missed = "" if min(parameters, errors) >= 6 else " MISSED 6"
            name = f"{problem['name']}, {start}"
            lines.append(Line(contender=name, seconds=seconds, error=10**-parameters, note=note + missed))
    return lines
