"""The verdict in three answers: does the model predict, which of its numbers can be used, and is it enough for a loop?

None is better than its reasons. What was not tested is reported as not tested.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from upright.identification.inference.verdict.evidence import LOOP, USABLE, Evidence
from upright.identification.inference.verdict.loop import enough_for_a_loop
from upright.identification.inference.verdict.predicts import predicts
from upright.identification.inference.verdict.usable import usable_numbers
from upright.identification.model.fit import Judgement

INTERRUPTED = "Not evaluated: interrupted."


def judge(evidence: Evidence) -> tuple[Judgement, ...]:
    """The three answers."""
    first = predicts(evidence)
    untested = first.answer == "not tested"
    others = (
        usable_numbers(evidence, confirmed=first.answer == "yes", untested=untested),
        enough_for_a_loop(evidence, supported=first.answer != "no"),
    )
    if evidence.interrupted:
        return first, *map(_not_evaluated, others)
    if first.answer != "no":
        return first, *others
    return first, *(_no_better(a) for a in others)


def _not_evaluated(a: Judgement) -> Judgement:
    """An answer that an interrupted search did not come to; what speaks against the numbers already stays."""
    if a.question == USABLE and a.answer == "no":
        return replace(a, reasons=(f"{INTERRUPTED} This is from the best so far.", *a.reasons))
    return Judgement(question=a.question, answer="not tested", headline=INTERRUPTED)


def _no_better(a: Judgement) -> Judgement:
    """An answer that rests on a model which does not predict."""
    reason = (
        "They are numbers of a model that does not predict." if a.question == USABLE else "The model does not predict."
    )
    return replace(a, answer="in part", reasons=(reason, *a.reasons)) if a.answer == "yes" else a


def trusted(answers: Sequence[Judgement]) -> bool:
    """Whether nothing speaks against the model or its numbers; what was not tested does not."""
    return not any(a.answer == "no" for a in answers if a.question != LOOP)
