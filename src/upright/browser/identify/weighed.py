"""The first body of a rig, weighed by known masses: simulated loading by loading, with what follows from all so far."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from upright.errors import BadInput, NotIdentifiable
from upright.experiments.weighing_1a.loadings import weigh
from upright.experiments.weighing_1a.run import PIECES, LoadedRig, first_body, step_log
from upright.files import plain_values
from upright.identification.loadings import Loadings
from upright.identification.model.fit import Estimate
from upright.progress import Progress
from upright.records import Record
from upright.report.symbols import with_error
from upright.rigs.rigfile import RigFile
from upright.running.rig import model_and_truth

SHOTS = 2
"""Runs of each loading: how far they differ is what the line's errors say."""

Facts = dict[str, Any]


def weigh_body(file: RigFile, progress: Progress, show: Callable[[Facts], None]) -> str:
    """Weigh the body of a twin; what is shown after each loading, and at the end, as JSON.

    Its pendulum or second body is off and its masses are unbolted, which nobody's hand does in a loop: the loadings are
    simulated.

    Raises
    ------
    BadInput
        When the rig is no cart, no disk and no pendulum on one.
    """
    on = first_body(replace(model_and_truth(file)[1], seed=file.seed))
    logs, added, facts = dict[str, Record](), list[float](), Facts()
    for count in range(PIECES + 1):
        progress(f"{count} masses", count / (PIECES + 1))
        for shot in range(SHOTS):
            logs[f"{count} masses, run {shot + 1}"] = step_log(on, count, shot=shot)
            added.append(count * on.body.piece)
        facts = plain_values(_facts(on, logs, added))
        show(facts)
    if "line" not in facts:
        raise BadInput("too few of its swings could be read; friction holds it.")
    return json.dumps(facts)


def _facts(on: LoadedRig, logs: Mapping[str, Record], added: list[float]) -> Facts:
    body = on.body
    facts: Facts = {
        "kind": body.kind, "unit": body.unit, "bare": body.bare, "pieces": [n * body.piece for n in range(PIECES + 1)],
        "loadings": len(set(added)), "points": [], "numbers": [],
    }  # fmt: skip
    signals = {label: record.outputs[0] for label, record in logs.items()}
    try:
        loadings, _ = weigh(logs, added, signals, dict.fromkeys(logs, "u"), tolerance=body.tolerance, piece=body.piece)
    except (NotIdentifiable, BadInput):  # of one loading there is no line yet
        return facts
    facts["points"] = [
        {"added": s.added, "y": float(y), "error": float(error)}
        for s, y, error in zip(loadings.swings, loadings.y, loadings.y_error, strict=True)
    ]
    facts["line"] = {"k": loadings.k.value, "bare": loadings.bare.value}
    facts["numbers"], facts["verdict"] = _numbers(on, loadings), loadings.verdict
    return facts


def _numbers(on: LoadedRig, loadings: Loadings) -> list[dict[str, str]]:
    units = {"rectilinear": ("N/m", "kg", "N s/m"), "torsional": ("N m/rad", "kg m²", "N m s/rad")}[on.body.kind]
    rows: list[tuple[str, str, Estimate]] = [
        ("k", "stiffness of the spring", loadings.k),
        (on.body.bare, "inertia without added masses", loadings.bare),
        ("c", "viscous friction", loadings.damping),
    ]
    out: list[dict[str, str]] = []
    for (name, meaning, e), unit in zip(rows, units, strict=True):
        value, half = with_error(e.value, (e.interval[1] - e.interval[0]) / 2)
        out.append({"symbol": name, "meaning": meaning, "value": value, "half": half, "unit": unit})
    return out
