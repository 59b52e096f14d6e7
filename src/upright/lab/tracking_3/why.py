"""Why state feedback? What PD control of either encoder can have, in sentences and pictures."""

from __future__ import annotations

import math

import numpy as np

from upright.lab.tracking_3.figures import Bargain, Locus, bargain_figure, loci_figure, steps_figure
from upright.lab.tracking_3.laws import AT
from upright.lab.tracking_3.parts import described, frame, strongest, trace
from upright.lab.tracking_3.pd import best_decay, root_locus, sampled
from upright.lab.tracking_3.run import BEFORE, DWELL, Tracking
from upright.lab.tracking_3.tables import share
from upright.report.document import Picture, picture
from upright.report.sections import Part
from upright.report.symbols import number


def why(done: Tracking, near: str, far: str) -> Part:
    """PD control beside state feedback, and what its one damper cannot do."""
    assert done.pd is not None
    assert done.stiff is not None
    assert done.far is not None
    best, pd, stiff = strongest(done), done.pd, done.stiff
    p = done.model.plant.parameters()
    inertia = p.get("m_1", p.get("J_1", 1.0))
    other = p.get("m_2", p.get("J_2", 1.0))
    force = "N m/rad" if done.rig.plant.coordinates[-1].unit == "rad" else "N/m"
    bound = 0.5 * math.sqrt(p["k_12"] / inertia)
    compared = [best, *((done.summed,) if done.summed else ()), pd, stiff, done.far]
    trips = done.far.found.tripped
    end = f"trips the rig {trips - BEFORE:.2g} s after the step" if math.isfinite(trips) else "does not trip the rig"
    tried = 0 if done.search is None else done.search.kp.size
    return Part(
        title="Why state feedback",
        sentences=(
            f"PD control of the driven body, kp and kd the best of {tried} pairs tried on the fitted rig under the "
            f"same limit, brings {far} to the reference about as soon, at {share(pd.found.effort.share, 0)} of the "
            "limit. For a step alone it would do.",
            "But it has one damper for two modes. Without natural damping no kp and kd let every pole decay faster "
            f"than half the root of k/inertia 1, {number(bound, 3)} 1/s here, and it gets there only at kp·gain = k "
            f"(inertia 1)/(inertia 2), {number(p['k_12'] * inertia / other, 3)} {force}, where {best.law.name} has "
            f"{number(best.law.stiffness, 3)}. Stiffer, {near} is held fast and {far} swings on its spring: as stiff "
            f"as {best.law.name}, the slowest pole decays with {number(stiff.law.decay, 2)} 1/s at a damping ratio of "
            f"{number(stiff.law.damping, 2)}, against {number(best.law.decay, 3)} 1/s and "
            f"{number(best.law.damping, 2)}. State feedback is fast and stiff at once: it alone uses the far encoder.",
            f"PD control of the far encoder with the same gains {end}: between drive and far body lies no zero, the "
            "phase of the flexible mode is turned by half a turn, and kd drives what it should damp (without natural "
            "damping for any kp and kd: the polynomial lacks s³).",
        ),
        pictures=(
            picture(
                steps_figure([trace(o) for o in compared], frame(done), until=DWELL + 1.4, kick=None),
                "track-compared",
                caption="The same step, then a steady push of the drive, which the command shown contains. A cross: "
                "the rig has tripped.",
                description=f"State feedback beside PD control: {described(done)}",
            ),
            *_reasons(done, bound),
        ),
    )  # fmt: skip


def _reasons(done: Tracking, bound: float) -> list[Picture]:
    """Stiffness against decay, and the root loci of both PDs."""
    assert done.pd is not None
    assert done.stiff is not None
    assert done.far is not None
    model, pd = done.model.linear(AT), done.pd.law
    p = done.model.plant.parameters()
    of = done.rig.plant.coordinates[-1].unit
    kp = np.geomspace(0.2 * pd.k_pf, 2.5 * strongest(done).law.k_pf, 40)
    points = {o.law.name: (o.law.stiffness, o.law.decay) for o in (*done.sets, done.pd, done.stiff)}
    bargain = Bargain(
        stiffness=kp * done.model.gain, bound=bound, shaft=p["k_12"], points=points,
        decay=best_decay(sampled(done.model), kp, period=done.model.period),
        unit=f"{'N m' if of == 'rad' else 'N'}/{of}",
    )  # fmt: skip
    rate = float(pd.K[1]) / pd.k_pf
    rising = pd.k_pf * np.geomspace(1e-3, 30, 300)
    swing = 1j * math.sqrt(p["k_12"] / p.get("m_2", p.get("J_2", 1.0)))
    loci: list[Locus] = []
    for title, body, zeros in (("near encoder", 0, [-1 / rate, swing]), ("far encoder", 1, [-1 / rate])):
        loci.append(
            Locus(title=title, tracks=root_locus(model, body, rate, rising),
                  marked=root_locus(model, body, rate, np.array([pd.k_pf]))[0], zeros=np.array(zeros, dtype=complex))
        )  # fmt: skip
    return [
        picture(
            bargain_figure(bargain), "track-bargain",
            caption="Fast against stiff. PD of the near encoder has what lies under the curve; state feedback stands "
            "outside of it. All as the loops run; dashed: the most that PD can have without natural damping and delay.",
            description="Decay of the slowest pole over static force per error.",
        ),
        picture(
            loci_figure(loci, model.poles()), "track-loci",
            caption="Poles as kp rises, kd/kp as tuned. Poles and zeros alternate at the near encoder, and every "
            "branch stays left; at the far encoder the flexible mode goes right at once.",
            description="Two root loci, upper half plane.",
        ),
    ]  # fmt: skip
