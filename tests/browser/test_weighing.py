"""Does the bench weigh a body as the line through its swings says, and one at a time?"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.browser.runs import hardware, settled, twin
from tests.browser.test_fits import ByHand
from upright.browser.identify.weighed import weigh_body
from upright.browser.identify.weighing import BodyWeighing
from upright.errors import BadInput
from upright.experiments.weighing_1a.run import first_body
from upright.progress import silent
from upright.rig.makes import make_rig

SEED = 3


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    made = twin(tmp_path_factory.mktemp("bench"))
    return replace(made, file=replace(made.file, seed=SEED))


def test_stiffness_and_inertia_of_a_twin_s_body_are_those_of_a_line_and_hold_the_truth(rig):
    shown = []
    last = json.loads(weigh_body(rig.file, silent, shown.append))
    assert [each["loadings"] for each in shown] == [1, 2, 3, 4, 5]
    assert ["line" in each for each in shown] == [False, True, True, True, True]
    assert last == shown[-1]
    added, y, error = np.array([[p["added"], p["y"], p["error"]] for p in last["points"]]).T
    slope, level = np.polyfit(added, y, 1, w=1 / error)
    # beside the swings' own errors the line weighs that of the pieces, alike for all of a loading
    assert last["line"]["k"] == pytest.approx(1 / slope, rel=2e-3)
    assert last["line"]["bare"] == pytest.approx(level / slope, rel=4e-3)
    true = first_body(make_rig("furuta", SEED))
    assert last["line"]["k"] == pytest.approx(true.stiffness, rel=0.008)  # twice what the verdict says
    assert last["line"]["bare"] == pytest.approx(true.bare, rel=0.008)
    assert [row["symbol"] for row in last["numbers"]] == ["k", "J_0", "c"]
    assert last["numbers"][0]["value"].startswith(f"{last['line']['k']:.2f}")


def test_one_weighing_at_a_time_is_shown_as_far_as_it_is_and_a_failure_is_a_sentence(rig):
    carry = ByHand()
    weighing = BodyWeighing(carry)
    assert weighing.described() is None
    carry.hold()
    weighing.begin(rig)
    with pytest.raises(BadInput, match="being weighed"):
        weighing.begin(rig)
    carry.bounds["show"]({"loadings": 1})
    assert weighing.described() == {"loadings": 1, "over": False}
    carry.answer = BadInput("friction holds it.")
    carry.go()
    assert settled(weighing, lambda each: each.described()["over"])
    assert weighing.described() == {"failed": "Friction holds it.", "over": True}
    with pytest.raises(BadInput, match="upright lab"):
        weighing.begin(hardware(rig))
