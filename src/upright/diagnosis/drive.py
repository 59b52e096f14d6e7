"""Did the drive do what the effort column says, all of the time? A drive that trips; a column that is no effort."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.balance import Balance
from upright.diagnosis.case import Case
from upright.diagnosis.findings import Curve, Finding, Panel
from upright.diagnosis.motion import Motion
from upright.diagnosis.structure import driven_row
from upright.records import Array
from upright.signals.trips import Regression

LEAST = 0.7
"""Of what may stay unexplained before a trip, this part must be exceeded with all of the effort."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Push:
    """How the effort explains what friction and springs leave of the driven body's force or acceleration.

    `without`, `full` and `cut` are shares of it left without effort, with all of it, and with the effort until `end`
    [s]; `after` is the force per unit after `end` beside that before, 0 unless it explains something; `late` is the
    share of the effort after `end`; `rest` (N,) is what is to be explained.
    """

    without: float
    full: float
    cut: float
    end: float
    after: float
    late: float
    rest: Array
    t: Array
    u: Array


def push_of(motion: Motion, balance: Balance | None) -> Push | None:
    """What the effort explains; None without an effort on a measured body."""
    if not np.ptp(motion.u) > 0:
        return None
    driven, here = 0, swift(motion, 0)
    row = driven_row(motion, here)
    if np.count_nonzero(here) < 40 or row is None:
        return None
    target, others = row
    if balance is not None:
        driven, here = balance.driven, swift(motion, balance.driven)
        k = motion.rows.index(driven)
        tau, _ = balance.needed(np.ones((1, len(balance.names))))
        target, others = tau[0, k][here], balance.friction[k][here]
    u, t, rows = motion.u[here], motion.t[here], motion.samples[here]
    live = np.flatnonzero(np.abs(u) > 0.02 * float(np.abs(u).max()))
    if live.size < 8:
        return None
    table = Regression(rows=rows, target=target, base=others, switched=motion.command[:, None], weights=motion.weights)
    end, costs = table.search(int(rows[live[0]]), int(rows[live[-1]]) + 1, forward=False)
    early = table.before(end)
    late = table.whole - early
    after = 1.0
    if float(np.sum(late**2)) > 1e-9 * float(u @ u):
        left, g = table.explain(np.hstack([early, late]))
        after = float(g[1] / g[0]) if g[0] and left < 0.6 * costs[end] else 0.0
    speed = motion.v[driven][here]
    sliding = np.abs(speed) > 0.1 * float(np.abs(speed).max())
    return Push(
        without=table.explain(early[:, :0])[0],
        full=table.explain(table.whole)[0],
        cut=costs[end],
        end=float(motion.t[0] + (end - motion.samples[0]) * motion.dt),
        after=after,
        late=float(np.sum(late[sliding] ** 2)) / float(u @ u),
        rest=table.rest,
        t=t,
        u=u,
    )


def swift(motion: Motion, i: int) -> NDArray[np.bool_]:
    """Samples (N,) at which a body is clearly on its way: then friction is known up to a number, and cannot hide."""
    return np.abs(motion.v[i]) > 0.05 * float(np.abs(motion.v[i]).max())


def examine_push(case: Case, push: Push, *, most: float) -> list[Finding]:
    """A silent trip, when the effort before it leaves less than `most` unexplained."""
    t, end = case.record.t, push.end
    driven = next(iter(case.places.values())).column
    tripped = (
        push.cut < most and push.cut < 0.5 * push.full and push.cut < 0.5 * push.without and abs(push.after) < 0.45
    )
    live = np.flatnonzero(case.u)
    strong = push.t[np.abs(push.u) > 0.1 * float(np.abs(push.u).max())]
    first, last = float(strong[0]), float(strong[-1])
    lasted = end - first > 0.05 * (last - first)  # a kick at the start is no drive that worked until then
    if tripped and lasted and push.late > 0.04 and push.full > LEAST * most:
        return [
            Finding(
                kind="trip",
                columns=(case.drive,),
                severity="fault",
                sentence=f"The drive trips silently: '{case.drive}' is logged until {t[live[-1]]:.4g} s, but from about"
                f" {end:.4g} s on '{driven}' moves as if there were none ({100 * push.full:.0f} % of its force is"
                f" unexplained with all of the effort, {100 * push.cut:.1f} % with what came before).",
                evidence={"end [s]": end, "logged end [s]": float(t[live[-1]]), "unexplained with all [%]":
                          100 * push.full, "unexplained with the first part [%]": 100 * push.cut},
                advice="Ask for the end of the effective input, or end the window there.",
                key='unknown = ["initial", "input_end"]',
                panels=(*case.over_time(driven, case.drive), _panel(case, push)),
                marks=(end,),
            )
        ]  # fmt: skip
    return []


def examine_uselessness(case: Case, push: Push) -> list[Finding]:
    """An effort column that explains little of the force that the driven body needs."""
    if push.without < 0.3 or push.full < 0.95 * push.without:
        return []
    driven = next(iter(case.places.values())).column
    explains = 100 * (1 - push.full / push.without)
    return [
        Finding(
            kind="effort",
            columns=(case.drive,),
            severity="warning",
            sentence=f"'{case.drive}' acts like no effort: friction and springs leave {100 * push.without:.0f} %"
            f" of the driven body's force, and of that '{case.drive}' explains {explains:.0f} %.",
            evidence={"left to explain [%]": 100 * push.without, "explained by it [%]": explains},
            advice="Look for the column the controller put out; a reference or a set value is no effort.",
            key='[drive]\ncolumn = "..."',
            panels=(*case.over_time(driven, case.drive), _panel(case, push)),
        )
    ]


def _panel(case: Case, push: Push) -> Panel:
    """What the effort must explain beside the effort, each as a share of its largest value."""
    return Panel(label="what effort must explain\n(scaled)", curves=(
        Curve(name="needed", t=push.t, y=push.rest / (float(np.abs(push.rest).max()) or 1.0)),
        Curve(name=f"'{case.drive}'", t=push.t, y=push.u / (float(np.abs(push.u).max()) or 1.0)),
    ))  # fmt: skip
