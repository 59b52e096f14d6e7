"""Which numbers came out, in which unit, and how far can they be trusted?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from markupsafe import Markup

from upright.identification import Estimate, Fit, Parameter, RunScore
from upright.identification.ladder.cross_validation import CrossValidation
from upright.identification.model.fit import Pole
from upright.report.mathml import symbol
from upright.report.symbols import figures, measured, number, percent, plain, unit


@dataclass(frozen=True, kw_only=True)
class ParameterRow:
    """One line of the table of parameters, as text; `symbol` is markup."""

    name: str
    symbol: Markup
    meaning: str
    value: str
    stderr: str
    interval: str
    unit: str
    status: str
    run: str = ""


@dataclass(frozen=True, kw_only=True)
class ScoreRow:
    """One line of the table of runs: fit percent of one signal."""

    run: str
    role: str
    signal: str
    fit: str
    horizon: str
    naive: str = ""


@dataclass(frozen=True, kw_only=True)
class CrossRow:
    """One signal of one run, fitted among all and predicted by a fit of the others, as text."""

    run: str
    signal: str
    fitted: str
    predicted: str
    blind: str


def cross_rows(crossed: CrossValidation | None) -> list[CrossRow]:
    """Every run and signal of a cross-validation; nothing without one."""
    if crossed is None:
        return []
    return [
        CrossRow(
            run=label,
            signal=plain(signal),
            fitted=percent(value),
            predicted=percent(crossed.predicted[label].fit_percent[signal]) if label in crossed.predicted else "",
            blind=", ".join(crossed.blind.get(label, ())),
        )
        for label, score in crossed.fitted.items()
        for signal, value in score.fit_percent.items()
    ]


def parameter_rows(fit: Fit) -> list[ParameterRow]:
    """Estimated parameters, then those that were given and are not zero."""
    about = fit.rig.parameters
    rows = [_estimate(n, e, about.get(n)) for n, e in fit.estimates.items() if e.status != "known"]
    given = {n: p for n, p in about.items() if not p.estimate and n not in {r.name for r in rows}}
    return rows + [_given(n, p) for n, p in given.items() if p.value != _default(n)]


def _default(name: str) -> float:

    from upright.physics.actuator import ACTUATOR

    return ACTUATOR[name].default if name in ACTUATOR else 0.0


def without_rows(fit: Fit) -> list[ParameterRow]:
    """What rests on assumed numbers, stated without them."""
    return [_estimate(n, e, fit.rig.parameters.get(n)) for a in fit.assumptions for n, e in a.without.items()]


def run_rows(fit: Fit) -> list[ParameterRow]:
    """What was estimated for groups of runs, then run by run."""
    rows = [_estimate(n, e, None, f"group {group}") for group, own in fit.groups.items() for n, e in own.items()]
    return rows + [_estimate(n, e, None, run) for run, own in fit.per_run.items() for n, e in own.items()]


def _estimate(name: str, e: Estimate, about: Parameter | None, run: str = "") -> ParameterRow:
    value, stderr = measured(e.value, e.stderr)
    digits = figures(e.value, e.stderr)
    low, high = e.interval
    return ParameterRow(
        name=name,
        symbol=Markup(symbol(name)),
        meaning=about.meaning if about else "",
        value=value,
        stderr=stderr,
        interval=f"{number(low, digits)} to {number(high, digits)}",
        unit=unit(e.unit),
        status=e.status,
        run=run,
    )


def _given(name: str, p: Parameter) -> ParameterRow:
    return ParameterRow(
        name=name,
        symbol=Markup(symbol(name)),
        meaning=p.meaning,
        value=number(p.value),
        stderr=number(p.uncertainty, 2) if p.uncertainty else "exact",
        interval="",
        unit=unit(p.unit),
        status="given",
    )


def score_rows(fit: Fit) -> list[ScoreRow]:
    """Fit percent of every signal of every run, fitted runs first."""
    runs = sorted(fit.runs.items(), key=lambda item: item[1].role != "fit")
    rows: list[ScoreRow] = []
    for label, score in runs:
        role = "fitted" if score.role == "fit" else "predicted"
        for name, value in score.fit_percent.items():
            naive = percent(score.naive[name]) if name in score.naive else ""
            rows.append(
                ScoreRow(run=label, role=role, signal=plain(name), fit=percent(value), horizon=over(score), naive=naive)
            )
        for horizon, percents in list(score.ahead.items())[1:]:
            for name, value in percents.items():
                far = f"{horizon:g} s ahead"
                rows.append(
                    ScoreRow(run=label, role=role, signal=plain(name), fit=percent(value), horizon=far, naive="")
                )
    return rows


def pole_rows(fit: Fit, *, growing: bool = False) -> list[tuple[str, str, str, str]]:
    """Equilibrium, pole, its 95 % interval and the frequency of its swing, as text.

    `growing` for those alone by which the plant falls.
    """
    rows: list[tuple[str, str, str, str]] = []
    for at, found in fit.poles.items():
        for pole in found:
            value, interval = _measured(pole.real)
            if pole.imag.value > 0:
                parts = _measured(pole.imag)
                value, interval = f"{value} ± {parts[0]} i", f"{interval}; ± ({parts[1]}) i"
            if not growing or pole.real.value > 1e-6:
                rows.append((at, value, interval, _swing(pole)))
    return rows


def swings(fit: Fit) -> list[tuple[str, str]]:
    """Equilibrium and frequency of every swing that does not grow, as text."""
    return [
        (at, _swing(pole)) for at, found in fit.poles.items() for pole in found
        if pole.imag.value > 0 and pole.real.value <= 1e-6
    ]  # fmt: skip


def _swing(pole: Pole) -> str:
    """Damped frequency of a pair of poles with its interval; nothing for a real one."""
    if not pole.imag.value > 0:
        return ""
    turn = 2 * math.pi
    e = pole.imag
    low, high = e.interval
    hertz = replace(e, value=e.value / turn, stderr=e.stderr / turn, interval=(low / turn, high / turn))
    value, interval = _measured(hertz)
    return f"{value} Hz ({interval})"


def _measured(e: Estimate) -> tuple[str, str]:
    low, high = e.interval
    digits = figures(e.value, e.stderr)
    return measured(e.value, e.stderr)[0], f"{number(low, digits)} to {number(high, digits)}"


def over(score: RunScore) -> str:
    """What of the run was compared, how it was simulated, and what a prediction took from the run itself."""
    text = "from the first sample" if score.horizon is None else f"restarted every {score.horizon:g} s"
    text = f"{score.horizon:g} s ahead" if score.ahead else text
    text += f"; scored from {score.score_from:g} s on" if score.score_from > 0 else ""
    return f"{text}; its own {', '.join(score.adapted)}" if score.adapted else text


def provenance_rows(provenance: Mapping[str, object], above: str = "") -> list[tuple[str, str]]:
    """What is known about the origin, nested mappings written out: ``runs / decay / file``."""
    rows: list[tuple[str, str]] = []
    for key, value in provenance.items():
        name = f"{above} / {key}" if above else str(key)
        if isinstance(value, Mapping):
            rows += provenance_rows({str(k): v for k, v in value.items()}, name)
        elif isinstance(value, list | tuple | set | frozenset):
            rows.append((name, "; ".join(str(v) for v in value)))
        elif value is not None and value != "":
            rows.append((name, str(value)))
    return rows
