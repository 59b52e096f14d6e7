"""What else does the large free swing tell: blind directions, energy, drift, a rig out of level?"""

from __future__ import annotations

import math

from upright.identification.model.fit import Fit
from upright.lab.free_swing_4.drift import TILT
from upright.lab.free_swing_4.figures import drift_figure, energy_figure
from upright.lab.free_swing_4.run import FreeSwing
from upright.report.certainty import directions_figure
from upright.report.document import Picture, picture
from upright.report.figures import fit_figure
from upright.report.sections import Part, Table
from upright.report.symbols import number, percent

_TILTED = ("level_model", "tilt_model", "spring")


def blind_part(done: FreeSwing) -> list[Part]:
    """What the same swing cannot tell without a known inertia."""
    if "no_scale" not in done.answers:
        return []
    blind = done.answers["no_scale"].fit
    pictures: list[Picture] = []
    if blind.directions.size:
        caption = "Singular values when no inertia is known: the last one vanishes, and its row mixes every mass, "
        caption += "inertia and friction in equal measure. They can all be scaled together."
        pictures.append(
            picture(directions_figure(blind), "scale", caption=caption, description="; ".join(blind.unseen))
        )
    told = (
        "Multiply every mass, inertia and friction by the same factor and nothing moves differently: gravity pulls "
        "more, inertia resists more. A free swing sees ratios only. With no inertia given, the fit says:"
    )
    said = blind.unseen or (blind.verdict,)
    return [Part(title="What the data cannot see", sentences=(told, *said), pictures=tuple(pictures))]


def energy_part(done: FreeSwing) -> list[Part]:
    """Which friction took the energy of the release."""
    if not done.balance:
        return []
    b = done.balance
    ends = ", ".join(f"{name} {1e3 * e[-1]:.1f} mJ" for name, e in b.taken.items())
    shown = picture(
        energy_figure(b.t, b.stored, b.taken), "energy", description=f"At the end: {ends}.",
        caption="Where the energy of the release went, as the fitted model tells it.",
    )  # fmt: skip
    return [Part(title="Where the energy went", pictures=(shown,))]


def drift_part(done: FreeSwing) -> list[Part]:
    """Where disk or cart go, and what keeps them."""
    if not done.drifts:
        return []
    body, push, anchor = done.body, done.make.push, done.make.anchor
    factor, angle = (180 / math.pi, "°") if body == "disk" else (100.0, "cm")
    told = (
        f"Only friction acts about the axis of a level, free disk. Released at rest, its momentum about that axis "
        f"stays zero: the disk swings about a fixed line and creeps home as friction takes hold. A push of "
        f"{push:g} rad/s at the release gives it momentum; an axis {math.degrees(TILT):g}° out of level gives "
        f"gravity a lever, and the arm goes looking for its lowest place. A spring of {anchor:g} N m/rad, the "
        "remedy the paper proposes, gives it a home."
        if body == "disk"
        else "Only friction acts along a level rail. Released at rest, the momentum along it stays zero but for what "
        f"friction rubs away: the cart swings about a line that creeps. A push of {push:g} m/s at the release "
        f"carries it off, and dry friction keeps it there. A spring of {anchor:g} N/m gives it a home."
    )
    ends = ", ".join(f"{w.name} {factor * w.end:.1f} {angle}" for w in done.drifts)
    shown = picture(
        drift_figure(done.drifts, body), "drift", description=f"At the end: {ends}.",
        caption=f"Path of the {body} after the same release (thin) and the line about which it swings (bold).",
    )  # fmt: skip
    table = Table(
        caption=f"Drift of the {body} over 24 s after a release from horizontal",
        headings=("rig", f"slope [{angle}/s]", f"place at the end, from the release [{angle}]"),
        rows=tuple((w.name, number(factor * w.slope, 2), number(factor * w.end, 2)) for w in done.drifts),
        numbers=(1, 2),
    )
    return [Part(title=f"Why the {body} wanders", sentences=(told,), pictures=(shown,), tables=(table,))]


def level_part(done: FreeSwing) -> list[Part]:
    """Fits of the disk out of level."""
    answers = [done.answers[n] for n in _TILTED if n in done.answers]
    if not answers:
        return []
    rows: list[tuple[str, ...]] = []
    pictures: list[Picture] = []
    for a in answers:
        lean = a.fit.estimates.get("tilt_y")
        scores = [percent(_worst(a.fit, role, name)) for role in ("fit", "predict") for name in ("psi", "theta")]
        rows.append((a.question.title, *scores, f"{math.degrees(math.asin(lean.value)):.4f}°" if lean else ""))
        label, score = next((n, s) for n, s in a.fit.runs.items() if s.role == "fit")
        fits = ", ".join(f"{n} {percent(v)}" for n, v in score.fit_percent.items())
        drawing = fit_figure(score, a.fit.rig.plant, title=label)
        pictures.append(
            picture(drawing, a.question.name, caption=f"{a.question.title}.", description=f"Fit {fits}.")
        )  # fmt: skip
    told = (
        "The same fit on logs of the rig out of level: with a model that takes it for level, with one that may lean, "
    )
    table = Table(
        caption="Fit percent of ψ and θ, fitted run and predicted run",
        headings=("model", "ψ fitted", "θ fitted", "ψ predicted", "θ predicted", "lean found"),
        rows=tuple(rows),
        numbers=(1, 2, 3, 4, 5),
    )
    said = tuple(f"{a.question.title}: {a.fit.verdict}" for a in answers)
    return [
        Part(title="Is the rig level?", sentences=(f"{told}and with the spring on.", *said), tables=(table,),
             pictures=tuple(pictures))
    ]  # fmt: skip


def _worst(fit: Fit, role: str, name: str) -> float:
    """Fit percent of a signal; what an outlier has cut into several runs counts by the worst."""
    return min(score.fit_percent[name] for score in fit.runs.values() if score.role == role)
