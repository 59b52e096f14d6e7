"""What each rung of a ladder estimates, of the rig and of single runs, and where it begins."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run
from upright.identification.ladder.rungs import Rung, default_rungs, rig_at, runs_at
from upright.physics import CartPendulum

GUESSES = {"m_c": 0.8, "b_1c": 0.5, "b_1q": 0.2, "actuator.lag": 0.01, "actuator.force_limit": 20.0,
           "actuator.offset": 0.1}  # fmt: skip
RIG = GreyBox(plant=CartPendulum, parameters={
    **{n: Parameter(name=n, value=v) for n, v in {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3}.items()},
    **{n: Parameter(name=n, value=v, estimate=True) for n, v in GUESSES.items()},
})  # fmt: skip
RUN = Run(label="a", role="fit", t=0.01 * np.arange(50), u=np.ones((50, 1)), y=np.zeros((50, 1)), measured=("x",),
          unknown=("initial",))  # fmt: skip
DRY, DRAG = Rung(name="dry", adds=("b_1c",)), Rung(name="drag", adds=("b_1q",))


def test_a_term_begins_a_tenth_of_the_way_to_its_guess_and_a_limit_at_its_guess():
    """A limit that does nothing is infinite, so that no share of the way there is a place."""
    rung = Rung(name="all", adds=("b_1c", "actuator.lag", "actuator.force_limit"))
    assert rung.seeds(RIG) == {"b_1c": pytest.approx(0.05), "actuator.lag": pytest.approx(1e-3),
                               "actuator.force_limit": 20.0}  # fmt: skip


def test_a_place_on_the_ladder_estimates_what_the_kept_rungs_add_and_what_none_adds():
    every = set(GUESSES)
    assert set(rig_at(RIG, [DRY, DRAG], []).estimated) == every - {"b_1c", "b_1q"}
    assert set(rig_at(RIG, [DRY, DRAG], [DRY]).estimated) == every - {"b_1q"}
    assert set(rig_at(RIG, [DRY, DRAG], [DRY, DRAG]).estimated) == every
    # what does nothing stands where it does nothing
    assert rig_at(RIG, [DRY, DRAG], [DRY]).parameters.get("b_1q", Parameter(name="b_1q", value=0.0)).value == 0.0
    limit = rig_at(RIG, [Rung(name="limit", adds=("actuator.force_limit",))], []).parameters
    assert limit.get("actuator.force_limit", Parameter(name="", value=math.inf)).value == math.inf


def test_a_rung_that_drops_a_term_does_without_it_from_there_on():
    instead = Rung(name="drag instead", adds=("b_1q",), drops=("b_1c",))
    assert set(rig_at(RIG, [DRY, instead], [DRY]).estimated) == set(GUESSES) - {"b_1q"}
    assert set(rig_at(RIG, [DRY, instead], [DRY, instead]).estimated) == set(GUESSES) - {"b_1c"}
    # dropped by a rung that is not kept, and added by none: it was asked from the beginning
    assert set(rig_at(RIG, [instead], []).estimated) == set(GUESSES) - {"b_1q"}


def test_runs_estimate_what_they_did_and_what_the_kept_rungs_leave_to_each():
    rungs = [Rung(name="levels", unknown=("friction", "initial")), Rung(name="gain", unknown=("gain",))]
    (run,) = runs_at([RUN], rungs)
    assert run.unknown == ("initial", "friction", "gain")
    assert runs_at([RUN], [])[0].unknown == ("initial",)


def test_friction_is_tried_first_and_then_the_drive_from_its_offset_to_its_limit():
    names = [rung.name for rung in default_rungs(RIG, [RUN])]
    assert names == ["viscous friction", "Coulomb friction", "quadratic drag", "offset of the drive",
                     "lag of the drive", "limit of the force"]  # fmt: skip
    smooth = replace(RIG, parameters={n: p for n, p in RIG.parameters.items() if not n.startswith("b_1")})
    assert [rung.name for rung in default_rungs(smooth, [RUN])][:2] == ["as asked", "offset of the drive"]
    assert default_rungs(RIG, [RUN])[4].adds == ("actuator.lag",)
