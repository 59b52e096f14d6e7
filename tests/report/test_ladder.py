"""Does the advice below a ladder name what the study is to lose, and nothing where it has nothing to lose?"""

from __future__ import annotations

import pytest

from upright.identification.ladder.growth import Ladder
from upright.report.ladder import next_steps


@pytest.mark.parametrize(
    ("left_out", "trimmed", "said"),
    [
        ((), False, False),  # nothing was refused
        (("b_1c",), False, True),  # the owner's own study still has it
        (("b_1c",), True, False),  # the study that was written has lost it already
    ],
)
def test_only_what_was_refused_and_is_still_in_the_study_is_to_be_taken_out(fit, left_out, trimmed, said):
    ladder = Ladder(
        steps=(), rig=fit.model, runs=(), held_out="half of the runs", repeats=(), stopped="No rung is left.",
        scores={}, left_out=left_out,
    )  # fmt: skip
    steps = next_steps(ladder, study="swing.toml", folder="out", data="", trimmed=trimmed)
    taken = [step.sentence for step in steps if "out of the study" in step.sentence]
    assert len(taken) == said
    assert all("Take b_1c out" in sentence for sentence in taken)
