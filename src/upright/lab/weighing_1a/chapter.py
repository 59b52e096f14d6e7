"""How is experiment 1a told on the rig of the other experiments?"""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from upright.identification import Estimate
from upright.lab.weighing_1a.page import QUESTION, loading_parts, sound, units_of
from upright.lab.weighing_1a.run import Known, Weighing
from upright.lab.weighing_1a.twin import truth
from upright.report.advice import Step
from upright.report.chapter import Chapter, Finding
from upright.report.mathml import symbol
from upright.report.sections import Part, Table
from upright.report.symbols import measured, number, typed, unit


def chapter(done: Weighing) -> Chapter:
    """Experiment 1a as a chapter."""
    on, found = done.campaign.on, done.campaign.found
    true = truth(on)
    column = next(iter(done.campaign.logs.values())).outputs[0]
    parts = loading_parts(
        found, kind=on.design.kind, logs=done.campaign.logs, signals=dict.fromkeys(done.campaign.logs, column),
        left_out=done.campaign.left_out, truth=true,
    )  # fmt: skip
    units = {k.name: unit(type(done.rig.plant).quantity(k.name).unit) for k in done.known}
    handed = Table(
        caption="What the later experiments take from here",
        headings=("symbol", "truth of the twin", "value", "std. error", "unit"),
        rows=tuple(
            (Markup(symbol(k.name)), number(_truth(done, k)), *measured(k.value, k.stderr), units[k.name])
            for k in done.known
        ),
        numbers=(1, 2, 3),
    )  # fmt: skip
    numbers: dict[str, Any] = {
        name: _numbers(w, true.get(name))
        for name, w in (("k", found.k), (_inertia(done), found.bare), ("c", found.damping))
    }
    numbers["handed_on"] = {
        k.name: {"value": k.value, "stderr": k.stderr, "truth": _truth(done, k)} for k in done.known
    }
    numbers["swings"] = len(found.swings)
    return Chapter(
        key="1a",
        title="Stiffness and inertia from added loads",
        question=QUESTION,
        verdict=found.verdict,
        detail=" ".join(_sentence(done, k) for k in done.known),
        sound=sound(found),
        parts=(
            Part(title="The body", sentences=(done.make.mounted.bare, *_limits(done))),
            *parts,
            Part(title="What is handed on", sentences=(done.make.mounted.later,), tables=(handed,)),
        ),
        steps=_steps(done),
        findings=tuple(
            Finding(
                what=f"{k.name} [{units[k.name]}]",
                value=number(k.value),
                interval=f"{number(k.value - 1.96 * k.stderr)} to {number(k.value + 1.96 * k.stderr)}",
                truth=number(_truth(done, k)),
            )
            for k in done.known
        ),
        numbers=numbers,
    )


def _inertia(done: Weighing) -> str:
    return done.make.oscillator.inertia.replace("1", "0")


def _limits(done: Weighing) -> tuple[str, ...]:
    return (
        f"{len(done.campaign.logs)} steps of the command, masses of 500 g added one by one, each loading twice; dry "
        "friction, encoder counts and converter steps are as on the rig.",
    )


def _truth(done: Weighing, k: Known) -> float:
    return done.rig.plant.parameters()[k.name]


def _sentence(done: Weighing, k: Known) -> str:
    off = abs(k.value / _truth(done, k) - 1)
    inside = abs(k.value - _truth(done, k)) <= 1.96 * k.stderr
    return f"{k.name} lies {100 * off:.2g} % from the twin's, {'inside' if inside else 'outside'} its 95 % interval."


def _numbers(w: Estimate, true: float | None) -> dict[str, Any]:
    out: dict[str, Any] = {"value": w.value, "stderr": w.stderr, "interval": list(w.interval)}
    if true is not None:
        out |= {"truth": true, "inside": w.interval[0] <= true <= w.interval[1]}
    return out


def _steps(done: Weighing) -> tuple[Step, ...]:
    unit_of = units_of(done.campaign.on.design.kind)["inertia"]
    first = {label: file for label, file in done.files.items() if label.endswith("run 1")}
    added = " ".join(f'--added "{done.campaign.added[label]:.6g} {unit_of}"' for label in first)
    files = " ".join(typed(done.folder / file) for file in first.values())
    return (
        Step(sentence="Weigh the body again from one log of each loading, as you would your own.",
             command=f"upright loadings {files} {added} -o {typed(done.folder / 'again')}"),
        Step(sentence="See which masses would have told most.",
             command=f"upright plan-inertias --rig {done.campaign.on.design.kind}"),
    )  # fmt: skip
