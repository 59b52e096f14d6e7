"""Experiment 1a as a chapter: swings, the line through their frequencies, stiffness and bare inertia."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from upright.experiments.stand.known import Known
from upright.experiments.stand.stand import APPLIED
from upright.experiments.weighing_1a.figures import decrement_figure, extremes_figure, line_figure
from upright.experiments.weighing_1a.run import Campaign, Weighing
from upright.identification.loadings import Loaded, Loadings
from upright.quantities import figures
from upright.records import Record
from upright.report.fit.tables import finding, interval, plain_estimate
from upright.report.page import Chapter, KeyNumber, Part, Picture, Points, Step, Symbol, Table
from upright.report.symbols import number, typed, unit, with_error
from upright.rig.makes import BODIES, Make

QUESTION = (
    "How stiff is the spring, and how heavy is the bare body? A step makes the body swing; known inertias are added "
    "and each time the frequency falls. 1/ω² is a line over the added inertia: its slope is 1/k, and it starts at the "
    "bare inertia over k."
)
MOST_PANELS = 6


def chapter(result: Weighing) -> Chapter:
    """Experiment 1a on a rig, beside the truth of a twin."""
    campaign = result.campaign
    loadings, body = campaign.loadings, BODIES[campaign.kind]
    page = loading_chapter(
        loadings, kind=campaign.kind, title="Stiffness and inertia from added loads", logs=campaign.logs,
        signals={label: record.outputs[0] for label, record in campaign.logs.items()}, left_out=campaign.left_out,
        truth=campaign.truth or None, steps=_steps(result),
    )  # fmt: skip
    if result.make is not None:
        return _later_chapter(result, result.make, page)
    named = (("k", loadings.k, "stiffness"), (body.bare, loadings.bare, "inertia"), ("c", loadings.damping, "damping"))
    findings = tuple(
        finding(Symbol(f"{n} [{unit(_unit(campaign.kind, what))}]"), e, campaign.truth.get(n)) for n, e, what in named
    )
    weighed = {body.inertia: {**plain_estimate(loadings.bare), "unit": body.unit}}
    handed_on = {k.name: {"value": k.value, "stderr": k.stderr} for k in result.known}
    numbers = {**page.numbers, "parameters": weighed, "handed_on": handed_on}
    return replace(page, key="1a", best="line", findings=findings, numbers=numbers)


def _later_chapter(result: Weighing, make: Make, weighed: Chapter) -> Chapter:
    """The chapter of a twin's body, with the rig that is built on it for the later experiments."""
    campaign = result.campaign
    loadings, true = campaign.loadings, campaign.truth
    digits = {k.name: figures(k.value, k.stderr) for k in result.known}
    units = {k.name: unit(type(result.rig.plant).quantity(k.name).unit) for k in result.known}
    handed = Table(
        caption="What the later experiments take from here",
        headings=("symbol", "truth of the twin", "value", "std. error", "unit"),
        rows=tuple(
            (Symbol(k.name), number(_truth(result, k), digits[k.name]), *with_error(k.value, k.stderr), units[k.name])
            for k in result.known
        ),
        numbers=(1, 2, 3),
    )  # fmt: skip
    steps = (
        f"{len(campaign.logs)} steps of the command, masses of 500 g added one by one, each loading twice; dry "
        "friction, encoder counts and converter steps are as on the rig."
    )
    named = (("k", loadings.k), (BODIES[campaign.kind].bare, loadings.bare), ("c", loadings.damping))
    handed_on = {k.name: {"value": k.value, "stderr": k.stderr, "truth": _truth(result, k)} for k in result.known}
    return replace(
        weighed,
        key="1a",
        detail=" ".join(_sentence(result, k) for k in result.known),
        parts=(
            Part("The body", (make.mounted.bare, steps)),
            *weighed.parts,
            Part("What is handed on", (make.mounted.later, handed)),
        ),
        findings=tuple(
            KeyNumber(
                what=Symbol(f"{k.name} [{units[k.name]}]"),
                value=number(k.value, digits[k.name]),
                interval=f"{number(k.value - 1.96 * k.stderr, digits[k.name])} to "
                f"{number(k.value + 1.96 * k.stderr, digits[k.name])}",
                truth=number(_truth(result, k), digits[k.name]),
            )
            for k in result.known
        ),
        numbers={
            **{name: plain_estimate(w, true.get(name)) for name, w in named},
            "handed_on": handed_on,
            "swings": len(loadings.swings),
        },
    )


def _truth(result: Weighing, k: Known) -> float:
    return result.rig.plant.parameters()[k.name]


def _sentence(result: Weighing, k: Known) -> str:
    off = abs(k.value / _truth(result, k) - 1)
    inside = abs(k.value - _truth(result, k)) <= 1.96 * k.stderr
    return f"{k.name} lies {100 * off:.2g} % from the twin's, {'inside' if inside else 'outside'} its 95 % interval."


def _steps(result: Weighing) -> tuple[Step, ...]:
    campaign, body = result.campaign, BODIES[result.campaign.kind]
    if result.make is not None:
        first = [label for label in campaign.files if label.endswith("run 1")]
        files = " ".join(typed(result.folder / campaign.files[label]) for label in first)
        added = added_options(campaign, first)
        return (
            Step(
                "Weigh the body again from one log of each loading, as you would your own.",
                f"upright loadings {files} {added} -o {typed(result.folder / 'again')}",
            ),
            Step("See which masses are most informative.", f"upright plan-inertias --rig {campaign.kind}"),
        )
    files = " ".join(typed(result.folder / file) for file in campaign.files.values())
    added = added_options(campaign, campaign.files)
    added += f' --tolerance "{100 * result.tolerance:g} %"' if result.tolerance else ""
    column = next(iter(campaign.logs.values())).outputs[0]
    return (
        Step("Weigh it again from one log of each loading, as you would from logs of your own.",
             f"upright loadings {files} {added} --signal {column} --command {APPLIED}"),
        Step(f"Write {body.inertia} into the study of what is built on this body, what is mounted on it added."),
    )  # fmt: skip


def added_options(campaign: Campaign, labels: Iterable[str]) -> str:
    """Loadings of some logs as the command line takes them."""
    return " ".join(f'--added "{campaign.added[n]:.6g} {BODIES[campaign.kind].unit}"' for n in labels)


def loading_chapter(
    loadings: Loadings, *, kind: str, title: str, logs: Mapping[str, Record], signals: Mapping[str, str],
    left_out: Sequence[str] = (), truth: Mapping[str, float] | None = None, steps: Sequence[Step] = (),
) -> Chapter:  # fmt: skip
    """What the loadings say; `truth` is what a twin knows, `logs` and `signals` go by the label of the log."""
    recursion = (
        "Dry friction takes the same length δ = f/k off the centre in every half swing and leaves the period alone; "
        "viscous friction takes the same share. Both follow from the heights of successive extremes."
    )
    lost = (Part("Left out", (Points(tuple(left_out)),)),) if left_out else ()
    line = Picture(
        name="line", draw=lambda: line_figure(loadings, _unit(kind, "inertia")),
        caption="1/ω² over the added inertia. The slope is 1/k, the line meets zero at minus the bare inertia. "
        "Bars: 95 % intervals of single swings.",
        description=f"{len(loadings.swings)} points about a line; {loadings.verdict}",
    )  # fmt: skip
    named = (("k", loadings.k), ("bare", loadings.bare), ("damping", loadings.damping))
    return Chapter(
        title=title,
        verdict=loadings.verdict,
        sound=loadings.verdict.startswith("A line"),
        question=QUESTION,
        parts=(
            Part(
                "Data: the swings",
                (recursion, _swing_table(loadings, kind), *_swing_pictures(loadings, logs, signals)),
                aside=True,
            ),
            *lost,
            Part("Fit: the line", (_estimate_table(loadings, kind, truth or {}), line)),
        ),
        steps=tuple(steps),
        numbers={
            **{name: plain_estimate(w) for name, w in named},
            "kind": kind,
            "verdict": loadings.verdict,
            "truth": truth,
            "left_out": left_out,
            "swings": [
                {"label": s.label, "added": s.added, "omega_n": s.decay.omega_n, "stderr": s.decay.omega_error,
                 "sigma": s.decay.sigma, "delta": s.decay.delta} for s in loadings.swings
            ],
        },
    )  # fmt: skip


def _estimate_table(loadings: Loadings, kind: str, truth: Mapping[str, float]) -> Table:
    """What was found, beside the truth where a twin tells it."""
    named = (
        ("k", "stiffness", loadings.k, "stiffness"),
        (BODIES[kind].bare, "inertia of the bare body", loadings.bare, "inertia"),
        ("c", "viscous friction", loadings.damping, "damping"),
    )
    rows = tuple(
        (
            Symbol(name), *((number(truth[name], figures(w.value, w.stderr)),) if truth else ()),
            *with_error(w.value, w.stderr), interval(w), unit(_unit(kind, what)), meaning,
        )
        for name, meaning, w, what in named
    )  # fmt: skip
    repeat = "" if np.isnan(loadings.repeat) else f"; repeats of one loading agree to {50 * loadings.repeat:.2g} %"
    return Table(
        caption=f"From {len(loadings.swings)} swings" + (f"{repeat} of the frequency" if repeat else ""),
        headings=(
            "symbol", *(("truth of the twin",) if truth else ()), "value", "std. error", "95 % interval", "unit",
            "meaning",
        ),
        rows=rows, numbers=(1, 2, 3, 4) if truth else (1, 2, 3),
    )  # fmt: skip


def _swing_table(loadings: Loadings, kind: str) -> Table:
    rows = tuple(
        (
            s.label, number(s.added), str(s.decay.t.size), number(s.decay.omega_n, 5),
            number(s.decay.omega_error, 2), number(s.decay.decrement, 3), number(s.decay.zeta, 3),
            f"{number(s.decay.delta, 3)} ± {number(s.decay.delta_error, 2)}",
        )
        for s in loadings.swings
    )  # fmt: skip
    return Table(
        caption="Every swing; δ in the unit of the log",
        headings=(
            "swing", f"added [{unit(_unit(kind, 'inertia'))}]", "extremes", "ω [rad/s]", "std. error",
            "log. decrement", "damping ratio", "δ",
        ),
        rows=rows, numbers=tuple(range(1, 8)),
    )  # fmt: skip


def _swing_pictures(loadings: Loadings, logs: Mapping[str, Record], signals: Mapping[str, str]) -> list[Picture]:
    """One swing of each loading, and their decrements."""
    first: dict[float, Loaded] = {}
    for s in loadings.swings:
        first.setdefault(s.added, s)
    shown = [first[a] for a in sorted(first)][:MOST_PANELS]
    labels = [s.label.rsplit(", step ", 1)[0] for s in shown]
    with_logs = [(s, logs[n], signals[n]) for s, n in zip(shown, labels, strict=True) if n in logs]
    pictures = [
        Picture(
            name="decrements", draw=lambda: decrement_figure(shown),
            caption="Height of the extremes above the centre. A straight thin line is what the viscous part alone "
            "would leave; dry friction bends the decrement downwards.",
            description="Logarithmic decay of the heights, one curve per loading.",
        )
    ]  # fmt: skip
    if not with_logs:
        return pictures
    swings = Picture(
        name="swings", draw=lambda: extremes_figure(with_logs),
        caption="One swing of each loading. Rings: extremes, from the exact shape about each; crosses: the "
        "recursion of a spring with viscous and dry friction. Grey: where dry friction can hold the body.",
        description=f"{len(with_logs)} decaying swings with their extremes marked.",
    )  # fmt: skip
    return [swings, *pictures]


def _unit(kind: str, what: str) -> str:
    body = BODIES[kind]
    return body.rig.plant.quantity({"inertia": body.inertia, "stiffness": "k_1", "damping": "c_1"}[what]).unit
