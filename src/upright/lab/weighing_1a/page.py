"""How are swings and line of experiment 1a told?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from upright.identification.loadings import Loadings
from upright.lab.weighing_1a.figures import loading_pictures, units_of
from upright.records import Record
from upright.report.advice import Step
from upright.report.mathml import symbol
from upright.report.sections import Part, Table, write_sections
from upright.report.symbols import number, unit

QUESTION = (
    "How stiff is the spring, and how heavy is the bare body? A step makes the body swing; known inertias are added "
    "and each time the frequency falls. 1/ω² is a line over the added inertia: its slope is 1/k, and it starts at the "
    "bare inertia over k."
)


def rows(found: Loadings, kind: str) -> list[dict[str, str]]:
    """What was found, by the names of the report."""
    of = units_of(kind)
    named = (
        ("k", "stiffness", found.k, of["stiffness"]),
        ("J_0" if kind == "torsional" else "m_0", "inertia of the bare body", found.bare, of["inertia"]),
        ("c", "viscous friction", found.damping, of["damping"]),
    )
    return [
        {
            "name": name, "meaning": meaning, "value": number(w.value), "stderr": number(w.stderr, 2),
            "interval": f"{number(w.interval[0])} to {number(w.interval[1])}", "unit": unit(of_it),
        }
        for name, meaning, w, of_it in named
    ]  # fmt: skip


def found_table(found: Loadings, kind: str, truth: Mapping[str, float] | None = None) -> Table:
    """Table of what was found; `truth` is what only a twin can tell."""
    repeat = "" if np.isnan(found.repeat) else f"; repeats of one loading agree to {50 * found.repeat:.2g} %"
    true = ("truth of the twin",) if truth else ()
    return Table(
        caption=f"From {len(found.swings)} swings{repeat} of the frequency" if repeat else
        f"From {len(found.swings)} swings",
        headings=("symbol", *true, "value", "std. error", "95 % interval", "unit", "meaning"),
        rows=tuple(
            (
                Markup(symbol(r["name"])), *((number(truth[r["name"]]),) if truth else ()), r["value"], r["stderr"],
                r["interval"], r["unit"], r["meaning"],
            )
            for r in rows(found, kind)
        ),
        numbers=(1, 2, 3, 4) if truth else (1, 2, 3),
    )  # fmt: skip


def swing_table(found: Loadings, kind: str) -> Table:
    """Table of the swings."""
    return Table(
        caption="Every swing; δ in the unit of the log",
        headings=(
            "swing", f"added [{unit(units_of(kind)['inertia'])}]", "extremes", "ω [rad/s]", "std. error",
            "log. decrement", "damping ratio", "δ",
        ),
        rows=tuple(
            (
                s.label, number(s.added), str(s.decay.t.size), number(s.decay.omega_n, 5),
                number(s.decay.omega_error, 2), number(s.decay.decrement, 3), number(s.decay.zeta, 3),
                f"{number(s.decay.delta, 3)} ± {number(s.decay.delta_error, 2)}",
            )
            for s in found.swings
        ),
        numbers=tuple(range(1, 8)),
    )  # fmt: skip


def loading_parts(
    found: Loadings, *, kind: str, logs: Mapping[str, Record], signals: Mapping[str, str],
    left_out: Sequence[str] = (), truth: Mapping[str, float] | None = None,
) -> tuple[Part, ...]:  # fmt: skip
    """Data and fit of the loadings, to stand on a page of their own or under a roof."""
    line, *swings = loading_pictures(found, logs, signals, kind)
    recursion = (
        "Dry friction takes the same length δ = f/k off the centre in every half swing and leaves the period alone; "
        "viscous friction takes the same share. Both follow from the heights of successive extremes."
    )
    lost = (Part(title="Left out", sentences=tuple(left_out)),) if left_out else ()
    return (
        Part(title="Data: the swings", sentences=(recursion,), pictures=tuple(swings),
             tables=(swing_table(found, kind),)),
        *lost,
        Part(title="Fit: the line", tables=(found_table(found, kind, truth),), pictures=(line,)),
    )  # fmt: skip


def sound(found: Loadings) -> bool:
    """Whether the points lie on a line."""
    return found.verdict.startswith("A line")


def write_loadings(
    found: Loadings, folder: Path, *, kind: str, title: str, logs: Mapping[str, Record], signals: Mapping[str, str],
    left_out: Sequence[str] = (), truth: Mapping[str, float] | None = None, steps: Sequence[Step] = (),
) -> Path:  # fmt: skip
    """Write what the loadings say as one self-contained page, `folder`/report.html; `truth` is what a twin knows."""
    return write_sections(
        folder / "report.html", title=title, verdict="Stiffness and bare inertia.", detail=found.verdict,
        sound=sound(found), question=QUESTION, steps=steps,
        parts=loading_parts(found, kind=kind, logs=logs, signals=signals, left_out=left_out, truth=truth),
    )  # fmt: skip
