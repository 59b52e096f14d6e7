"""Experiment 1a as a chapter: the numbers that its words in `chapter.md` print, and what other programs read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from upright.experiments.stand.known import Known
from upright.experiments.stand.stand import APPLIED
from upright.experiments.weighing_1a.figures import decrement_figure, extremes_figure, line_figure
from upright.experiments.weighing_1a.run import Campaign, Weighing
from upright.identification.loadings import Loaded, Loadings
from upright.quantities import figures
from upright.records import Record
from upright.report.fit.tables import finding, interval, plain_estimate
from upright.report.page import Chapter, KeyNumber, Step, Symbol
from upright.report.prose import chapter_of
from upright.report.symbols import number, typed, unit, with_error
from upright.rig.makes import BODIES, Mounted

MOST_PANELS = 6


@dataclass(frozen=True, kw_only=True)
class HandedOn:
    """What a later experiment takes from here, beside the true value of the twin."""

    name: str
    value: float
    stderr: float
    truth: float
    unit: str

    @property
    def digits(self) -> int:
        """How many of its figures mean something."""
        return figures(self.value, self.stderr)

    @property
    def off(self) -> float:
        """Error relative to the true value [%]."""
        return 100 * abs(self.value / self.truth - 1)

    @property
    def inside(self) -> bool:
        """Whether the 95 % interval holds the true value."""
        return abs(self.value - self.truth) <= 1.96 * self.stderr

    @property
    def finding(self) -> KeyNumber:
        """As the cover shows it."""
        low, high = (number(self.value + s * 1.96 * self.stderr, self.digits) for s in (-1, 1))
        return KeyNumber(
            what=Symbol(f"{self.name} [{self.unit}]"), value=number(self.value, self.digits),
            interval=f"{low} to {high}", truth=number(self.truth, self.digits),
        )  # fmt: skip


def chapter(result: Weighing) -> Chapter:
    """Experiment 1a on a rig, beside the truth of a twin."""
    campaign, true = result.campaign, result.campaign.truth
    loadings, body = campaign.loadings, BODIES[campaign.kind]
    later = () if result.make is None else tuple(_handed_on(result, k) for k in result.known)
    page = loading_chapter(
        loadings, kind=campaign.kind, title="Stiffness and inertia from added loads", logs=campaign.logs,
        signals={label: record.outputs[0] for label, record in campaign.logs.items()}, left_out=campaign.left_out,
        truth=true or None, steps=_steps(result), later=later,
        mounted=None if result.make is None else result.make.mounted,
    )  # fmt: skip
    named = (("k", loadings.k, "stiffness"), (body.bare, loadings.bare, "inertia"), ("c", loadings.damping, "damping"))
    if result.make is not None:
        numbers = {
            **{name: plain_estimate(w, true.get(name)) for name, w, _ in named},
            "handed_on": {k.name: {"value": k.value, "stderr": k.stderr, "truth": k.truth} for k in later},
            "swings": len(loadings.swings),
        }
        return replace(page, key="1a", findings=tuple(k.finding for k in later), numbers=numbers)
    findings = tuple(
        finding(Symbol(f"{n} [{unit(_unit(campaign.kind, what))}]"), e, true.get(n)) for n, e, what in named
    )
    weighed = {body.inertia: {**plain_estimate(loadings.bare), "unit": body.unit}}
    handed_on = {k.name: {"value": k.value, "stderr": k.stderr} for k in result.known}
    numbers = {**page.numbers, "parameters": weighed, "handed_on": handed_on}
    return replace(page, key="1a", best="line", findings=findings, numbers=numbers)


def _handed_on(result: Weighing, known: Known) -> HandedOn:
    plant = result.rig.plant
    return HandedOn(
        name=known.name, value=known.value, stderr=known.stderr, truth=plant.parameters()[known.name],
        unit=unit(type(plant).quantity(known.name).unit),
    )  # fmt: skip


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
    later: Sequence[HandedOn] = (), mounted: Mounted | None = None,
) -> Chapter:  # fmt: skip
    """What the loadings say; `truth` is what a twin knows, `logs` and `signals` go by the label of the log.

    `later` and `mounted` are for the body of a rig that later experiments are made on.
    """
    shown = _one_of_each(loadings)
    labels = [s.label.rsplit(", step ", 1)[0] for s in shown]
    logged = [(s, logs[n], signals[n]) for s, n in zip(shown, labels, strict=True) if n in logs]
    units = {what: unit(_unit(kind, what)) for what in ("stiffness", "inertia", "damping")}
    draw: dict[str, Callable[[], Any]] = {
        "swings": lambda: extremes_figure(logged),
        "decrements": lambda: decrement_figure(shown),
        "line": lambda: line_figure(loadings, _unit(kind, "inertia")),
    }
    page = chapter_of(
        __name__, title=title, loadings=loadings, truth=truth, left_out=left_out, later=later, mounted=mounted,
        logs=len(logs), logged=len(logged), units=units, repeat=loadings.repeat, interval=interval, digits=figures,
        with_error=with_error, figures=draw,
        named=(
            ("k", "stiffness", loadings.k, units["stiffness"]),
            (BODIES[kind].bare, "inertia of the bare body", loadings.bare, units["inertia"]),
            ("c", "viscous friction", loadings.damping, units["damping"]),
        ),
    )  # fmt: skip
    estimates = {"k": loadings.k, "bare": loadings.bare, "damping": loadings.damping}
    numbers = {
        **{name: plain_estimate(e) for name, e in estimates.items()},
        "kind": kind,
        "verdict": loadings.verdict,
        "truth": truth,
        "left_out": left_out,
        "swings": [
            {"label": s.label, "added": s.added, "omega_n": s.decay.omega_n, "stderr": s.decay.omega_error,
             "sigma": s.decay.sigma, "delta": s.decay.delta} for s in loadings.swings
        ],
    }  # fmt: skip
    return replace(page, sound=loadings.verdict.startswith("A line"), steps=tuple(steps), numbers=numbers)


def _one_of_each(loadings: Loadings) -> list[Loaded]:
    """The first swing of each loading, the lightest first."""
    first: dict[float, Loaded] = {}
    for s in loadings.swings:
        first.setdefault(s.added, s)
    return [first[a] for a in sorted(first)][:MOST_PANELS]


def _unit(kind: str, what: str) -> str:
    body = BODIES[kind]
    return body.rig.plant.quantity({"inertia": body.inertia, "stiffness": "k_1", "damping": "c_1"}[what]).unit
