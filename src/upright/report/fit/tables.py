"""Tables of a fit: numbers with unit and interval, scores of the runs, poles."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace

from upright.identification.inference.assumptions import resting
from upright.identification.ladder.cross_validation import CrossValidation
from upright.identification.model.fit import Assumption, Estimate, Fit, Pole, RunScore
from upright.identification.model.grey_box import Parameter
from upright.physics.actuator import ACTUATOR
from upright.quantities import figures
from upright.report.page import KeyNumber, Symbol, Table
from upright.report.symbols import number, percent, plain, unit, with_error

_ESTIMATE = ("value", "std. error", "95 % interval", "unit", "status", "name and meaning")
_SAME_POWER = re.compile(r"^(\S+?)(·10\S+) to (\S+)\2$")
_OF_THE_RIG = "Parameters of the rig; standard errors allow for autocorrelated residuals"


def parameter_table(
    fit: Fit, *, truth: Mapping[str, float] | None = None, beside: tuple[str, Mapping[str, str]] | None = None,
    caption: str = _OF_THE_RIG,
) -> Table:  # fmt: skip
    """Estimated parameters, then those that were given and are not zero.

    Parameters
    ----------
    truth : mapping of str to float, optional
        What only a twin can tell, for two columns more.
    beside : (str, mapping of str to str), optional
        Heading and cells of one column more.
    """
    about = fit.model.parameters
    ranges = {a.name: f"{number(a.range[0], 2)} to {number(a.range[1], 2)}" for a in fit.assumptions if _moves(a)}
    described = {n: _estimate(n, e, about.get(n)) for n, e in fit.estimates.items() if e.status != "known"}
    described |= {
        n: (number(p.value), _sure(p), ranges.get(n, ""), unit(p.unit), _source(p), _called(n, p))
        for n, p in about.items()
        if not p.estimate
        and n not in described
        and (p.assumed or p.value != (ACTUATOR[n].default if n in ACTUATOR else 0.0))
    }  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for name, (value, error, around, *rest) in described.items():
        true, place = ((), ()) if truth is None else _true(fit.estimates.get(name), truth.get(name))
        other = () if beside is None else (beside[1].get(name, ""),)
        rows.append((Symbol(name), *true, value, error, around, *place, *other, *rest))
    extra = ((), ()) if truth is None else (("truth",), ("truth is",))
    headings = ("symbol", *extra[0], *_ESTIMATE[:3], *extra[1], *(beside[:1] if beside else ()), *_ESTIMATE[3:])
    numbers = tuple(i for i, h in enumerate(headings) if h in ("truth", *_ESTIMATE[:3], *(beside or ())[:1]))
    return Table(
        caption=caption, headings=headings, rows=tuple(rows), numbers=numbers, badge=headings.index("status")
    )  # fmt: skip


def _moves(a: Assumption) -> bool:
    """Whether an estimate rests on an assumed number, whose range then counts."""
    return bool(resting(a)) and math.isfinite(a.range[1] - a.range[0])


def _source(p: Parameter) -> str:
    return "assumed" if p.assumed else "given"


def _sure(p: Parameter) -> str:
    """How sure a number is that was given."""
    return number(p.uncertainty, 2) if p.uncertainty else "–" if p.assumed else "exact"


def _true(e: Estimate | None, true: float | None) -> tuple[tuple[str], tuple[str]]:
    """The true value and where it lies; nothing where nobody knows it, or nothing was estimated."""
    if true is None:
        return ("",), ("",)
    if e is None or e.status == "known":
        return (number(true),), ("",)
    return (number(true, figures(e.value, e.stderr)),), ("inside" if within(e, true) else "outside",)


def within(e: Estimate, true: float) -> bool:
    """Whether the 95 % interval holds the truth."""
    return e.interval[0] <= true <= e.interval[1]


def ratio_table(fit: Fit) -> Table:
    """What the data tell whatever the assumed numbers are: ratios to them, and lumped values."""
    rows = [(n, e) for a in fit.assumptions for n, e in a.ratios.items()]
    return Table(
        caption="Combinations that do not depend on assumed numbers; per gain in units of the command, s and counts",
        headings=("quantity", *_ESTIMATE[:-1]), numbers=(1, 2, 3), badge=5,
        rows=tuple((plain(n), *_estimate(n, e, None)[:-1]) for n, e in rows),
    )  # fmt: skip


def run_table(fit: Fit) -> Table:
    """What was estimated for groups of runs, then run by run."""
    homes = {f"group {group}": own for group, own in fit.groups.items()} | dict(fit.per_run)
    rows = tuple((run, Symbol(n), *_estimate(n, e, None)[:-1]) for run, own in homes.items() for n, e in own.items())
    return Table(
        caption="Initial states, offsets and factors of groups of runs and of single runs",
        headings=("run", "symbol", *_ESTIMATE[:-1]), rows=rows, numbers=(2, 3, 4), badge=6,
        folded=f"What differs from run to run ({len(rows)})",
    )  # fmt: skip


def _estimate(name: str, e: Estimate, about: Parameter | None) -> tuple[str, ...]:
    beforehand = ", known beforehand" if about and about.uncertainty else ""
    value, error = with_error(e.value, e.stderr)
    error = f"{error} (given it)" if e.given and error else error  # the assumed number, were it right
    return value, error, interval(e), unit(e.unit), f"{e.qualified}{_narrow(e)}", _called(name, about) + beforehand


def _narrow(e: Estimate) -> str:
    """How narrow a number is that is well determined: half its interval, in percent of it."""
    return f" (±{100 * e.half:.2g} %)" if e.status == "well determined" and e.half < 1 else ""


def _called(name: str, about: Parameter | None) -> str:
    return f"{name}, {about.meaning}" if about and about.meaning else name


def finding(what: str, e: Estimate, true: float | None = None, *, meaning: str | None = None) -> KeyNumber:
    """An estimate for the first screen; with its unit where `meaning` says what it is, and not `what` with its unit."""
    d = figures(e.value, e.stderr)
    return KeyNumber(
        what=what, value=number(e.value, d), unit="" if meaning is None else unit(e.unit),
        interval=_SAME_POWER.sub(r"\1 to \3\2", interval(e)), truth="" if true is None else number(true, d),
        meaning=meaning or "",
        half=e.half if math.isfinite(e.half) else None,
    )  # fmt: skip


def plain_estimate(e: Estimate, true: float | None = None) -> dict[str, object]:
    """An estimate as plain values, beside the truth of a twin."""
    plain: dict[str, object] = {"value": e.value, "stderr": e.stderr, "interval": e.interval}
    return plain if true is None else plain | {"truth": true, "inside": within(e, true)}


def interval(e: Estimate) -> str:
    """95 % interval of an estimate, in as many figures as the estimate has."""
    digits = 2 if e.given else figures(e.value, e.stderr)
    return f"{number(e.interval[0], digits)} to {number(e.interval[1], digits)}"


def score_table(runs: Mapping[str, RunScore]) -> Table:
    """Fit percent of every signal of every run, fitted runs first; free runs and predictions ahead in columns apart."""
    windowed = any(score.naive for score in runs.values())
    boxed = any(score.black_box for score in runs.values())
    banded = any(score.band for score in runs.values())
    limited = any(score.ceiling for score in runs.values())
    apart = len({score.horizon is None for score in runs.values()}) == 2
    rows: list[tuple[str, ...]] = []
    for label, score in sorted(runs.items(), key=lambda item: item[1].role != "fit"):
        role = "fitted" if score.role == "fit" else "predicted"
        others = {h: percents for h, percents in score.ahead.items() if h != score.horizon}
        further = [(h, f"{h:g} s ahead", percents) for h, percents in others.items()]
        for horizon, how, percents in ((score.horizon, _compared(score), score.fit_percent), *further):
            for name, value in percents.items():
                first = percents is score.fit_percent  # of several horizons that which is judged alone is compared
                columns = [of for of, some in ((score.naive, windowed), (score.black_box, boxed)) if some]
                columns += [score.inside] if banded else []
                beside = [percent(of[name]) if first and name in of else "" for of in columns]
                allowed = score.ceiling.get(horizon or 0.0, {})
                beside += [percent(allowed[name]) if name in allowed else ""] if limited else []
                fits = (percent(value),) if not apart else (percent(value), "")[:: 1 if horizon is None else -1]
                rows.append((label, role, plain(name), *fits, *beside, how))
    fit = ("fit, free run", "fit, ahead") if apart else ("fit",)
    return Table(
        caption="Fit percent, 100 (1 − |y − ŷ| / |y − mean y|), of every signal",
        headings=(
            "run", "role", "signal", *fit, *(("held speed",) if windowed else ()), *(("black box",) if boxed else ()),
            *(("in 90 % band",) if banded else ()), *(("start state allows",) if limited else ()), "simulated",
        ),
        rows=tuple(rows), numbers=tuple(range(3, 3 + len(fit) + windowed + boxed + banded + limited)),
    )  # fmt: skip


def _compared(score: RunScore) -> str:
    """What of the run was compared, how it was simulated, and what a prediction took from the run itself."""
    text = "from the first sample" if score.horizon is None else f"restarted every {score.horizon:g} s"
    text = f"{score.horizon:g} s ahead" if score.ahead else text
    text += f"; scored from {score.score_from:g} s on" if score.score_from > 0 else ""
    return f"{text}; its own {', '.join(score.adapted)}" if score.adapted else text


def cross_table(crossed: CrossValidation) -> Table:
    """Every run and signal, fitted among all and predicted by a fit of the others."""
    rows = tuple(
        (
            label, plain(signal), percent(value),
            percent(crossed.predicted[label].fit_percent[signal]) if label in crossed.predicted else "",
            ", ".join(crossed.blind.get(label, ())),
        )
        for label, score in crossed.fitted.items() for signal, value in score.fit_percent.items()
    )  # fmt: skip
    return Table(
        caption="Every run fitted among all, and predicted by a fit of the others: fit percent",
        headings=("run", "signal", "fitted", "predicted", "what the others cannot see"), rows=rows, numbers=(2, 3),
    )  # fmt: skip


def pole_table(fit: Fit) -> Table:
    """Poles at every equilibrium with their 95 % intervals, and the frequency of each swing."""
    rows: list[tuple[str, ...]] = []
    for at, poles in fit.poles.items():
        for pole in poles:
            value, around = with_error(pole.real.value, pole.real.stderr)[0], interval(pole.real)
            if pole.imag.value > 0:
                value += f" ± {with_error(pole.imag.value, pole.imag.stderr)[0]} i"
                around += f"; ± ({interval(pole.imag)}) i"
            if pole.real.rests_on:
                around = pole.real.status
            rows.append((at, value, around, "" if pole.real.rests_on else _swing(pole)))
    return Table(
        caption="Poles [1/s]; of a conjugate pair real and imaginary part",
        headings=("equilibrium", "pole", "95 % interval", "swings at (95 % interval)"), rows=tuple(rows), numbers=(1,),
    )  # fmt: skip


def _swing(pole: Pole) -> str:
    """Damped frequency of a pair of poles with its interval; nothing for a real one."""
    if not pole.imag.value > 0:
        return ""
    turn, e = 2 * math.pi, pole.imag
    low, high = e.interval
    if low <= 0 < e.stderr:
        return f"not determined; below {number(high / turn, 2)} Hz"
    hertz = replace(e, value=e.value / turn, stderr=e.stderr / turn, interval=(low / turn, high / turn))
    return f"{with_error(hertz.value, hertz.stderr)[0]} Hz ({interval(hertz)})"
