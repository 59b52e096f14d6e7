"""Does the estimator find NIST's certified values? 14 nonlinear problems, each from both certified starts.

Digits are those that agree with the certified value in the worst parameter: ``-log10(|b - c|/|c|)``. NIST Statistical
Reference Datasets, nonlinear regression (public domain).
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Line

NAME = "nist"
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


def results() -> Iterator[tuple[str, str, float, float, int, float]]:
    """Name, start, digits of parameters and of standard errors, evaluations, seconds."""
    from upright.identification.search.curve import fit_curve

    for problem in problems():
        for start in ("start1", "start2"):
            began = time.process_time()
            fit = fit_curve(model(problem), problem["y"], problem[start])
            seconds = time.process_time() - began
            found = digits(fit.values, problem["certified"]), digits(fit.stderr, problem["certified_sd"])
            yield problem["name"], start, *found, fit.evaluations, seconds


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """One line per problem and start."""
    progress(f"{NAME}: 14 problems from both starts")
    return [
        Line(
            benchmark=NAME,
            contender=f"{name}, {start}",
            seconds=(seconds, seconds, seconds),
            error=10**-parameters,
            note=f"digits: parameters {parameters:.1f}, standard errors {errors:.1f}; {evaluations} evaluations"
            + ("" if min(parameters, errors) >= 6 else " MISSED 6"),
        )
        for name, start, parameters, errors, evaluations, seconds in results()
    ]
