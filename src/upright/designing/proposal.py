"""Proposed closed-loop poles, where none are requested.

As fast as the rig falls, or swings where nothing falls, and somewhat slower or faster. Of those that hold as many of
the rigs that a fit allows, whose start the drive can take, whose command is quiet at rest, and whose loop keeps nearly
the largest distance to -1, the one with the least command noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upright.designing.run import Designed, DesignRequest, design_for
from upright.errors import BadInput
from upright.gains.requests import Roots, poles_of
from upright.rig import Rig
from upright.systems import StateSpace, to_s

PACES = (0.7, 1.0, 1.4, 2.0)
"""Multiples of the rig's own pace that are tried."""
SPREAD = 0.25
"""How much faster each further pole is than the one before, as a share of the first: gains grow where poles meet."""
NEARLY = 0.9
"""Share of the largest distance to -1 from which a quieter command decides."""


def design_unasked(rig: Rig | StateSpace, request: DesignRequest) -> Designed:
    """The design with proposed poles.

    Raises
    ------
    BadInput
        When nothing about the model says how fast, or no loop of that pace stands.
    """
    model = rig if isinstance(rig, StateSpace) else rig.linear(request.at)
    pace = own_pace(to_s(poles_of(model.A), model.period) if model.dt is not None else poles_of(model.A))
    tried: list[tuple[float, Designed]] = []
    for times in PACES:
        poles = -times * pace * (1 + SPREAD * np.arange(len(model.states)))
        design = design_for(rig, replace(request, poles=poles.astype(np.complex128), proposed=times))
        if design.chosen.margins is not None:
            tried.append((design.chosen.margins.modulus, design))
    if not tried:
        raise BadInput(
            f"no poles from {PACES[0]:g} to {PACES[-1]:g} times {pace:.3g} 1/s, as fast as the model moves by itself, "
            f"are held with a period of {1e3 * request.period:.4g} ms and this delay; sample faster, or give --poles."
        )
    limit = np.inf if request.limit is None else request.limit
    surest = max(_chance(d) for _, d in tried)
    sure = [(m, d) for m, d in tried if _chance(d) >= surest - 0.01]
    within = [(m, d) for m, d in sure if d.peak_sampled <= limit] or [min(sure, key=lambda one: one[1].peak_sampled)]
    calm = [(m, d) for m, d in within if d.holding is None or d.holding.quiet] or within
    widest = max(modulus for modulus, _ in calm)
    return min((d for m, d in calm if m >= NEARLY * widest), key=_loudness)


def own_pace(poles: Roots) -> float:
    """How fast a model moves by itself [1/s]: its fastest fall, else its slowest swing, else its slowest decay.

    Raises
    ------
    BadInput
        When it does none of these.
    """
    falls = poles.real[poles.real > 1e-6 * np.abs(poles).max(initial=0.0)]
    swings = np.abs(poles[np.abs(poles.imag) > 1e-3 * np.abs(poles)])
    decays = np.abs(poles[np.abs(poles) > 1e-6])
    for paces, choose in ((falls, np.max), (swings, np.min), (decays, np.min)):
        if paces.size:
            return float(choose(paces))
    raise BadInput(
        "a model that neither falls, swings nor comes to rest has no pace of its own; give either "
        '--poles "-4+-2j, -10, -3" or --lqr "1,0,1,0" (weights of the states).'
    )


def _chance(design: Designed) -> float:
    return 1.0 if design.chance is None else design.chance


def _loudness(design: Designed) -> float:
    noise = design.chosen.command_noise
    return design.peak_sampled if noise is None else noise
