"""Does the chapter of experiment 2 print what the runs came to, and has each of its sentences been printed once?"""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.experiments.regulation_2.test_regulation import fit_of
from tests.report.rendering import Rendered
from upright.basis import NOT_TRUSTED, Basis
from upright.control.preflight import WORDS
from upright.experiments.regulation_2.chapter import chapter
from upright.experiments.regulation_2.run import Regulation, RegulationRequest, run_regulation
from upright.experiments.stand.twin import TwinStand
from upright.report.html import WORDS_OF_A_VERDICT
from upright.report.page import Chapter, Points, Table
from upright.rig.completion import completed
from upright.rig.makes import make_rig

MODULE = "upright.experiments.regulation_2.chapter"


@pytest.fixture(scope="module")
def ran(tmp_path_factory) -> Regulation:
    """Two sets on a twin, for a second."""
    poles = {n: p for n, p in RegulationRequest().poles.items() if n in ("set 2", "set 4")}
    request = RegulationRequest(poles=poles, draws=4, seconds=1.0)
    truth = make_rig("linear")
    known = completed(fit_of(truth, draws=4))
    return run_regulation(known, TwinStand(rig=truth), 0, tmp_path_factory.mktemp("regulation"), request=request)


def changed(result: Regulation, **of_attempts) -> Regulation:
    """The same with every attempt's prediction, or the figures of its run, changed."""
    attempts = []
    for a in result.attempts:
        before = replace(a.before, **of_attempts.get("before", {}))
        measured = a.measured and replace(
            a.measured,
            score=replace(a.measured.score, **of_attempts.get("score", {})),
            ended=of_attempts.get("ended", ""),
        )
        attempts.append(replace(a, before=before, measured=measured))
    return replace(result, attempts=tuple(attempts))


def words(**shares) -> dict[str, float]:
    """Shares of the results, those that are not named at zero."""
    return {w: shares.get(w.replace(" ", "_"), 0.0) for w in WORDS}


def nothing_run(result: Regulation) -> Regulation:
    return replace(result, truth=None, attempts=tuple(replace(a, measured=None) for a in result.attempts))


def untrusted(result: Regulation) -> Regulation:
    """The model's own verdict refuses it."""
    basis = Basis(level=NOT_TRUSTED, sentence="Do not rely on this model yet.")
    attempts = []
    for a in result.attempts:
        run = replace(a.before.run, rig=replace(a.before.run.rig, basis=basis))
        attempts.append(replace(a, before=replace(a.before, run=run)))
    return replace(result, rig=replace(result.rig, basis=basis), attempts=tuple(attempts))


def variants(result: Regulation) -> dict[str, Regulation]:
    """One result for each verdict that the chapter can come to."""
    restless = replace(result.attempts[0].before.rest, rms=0.3, peak=0.9)
    quiet = {"final": np.zeros(2), "settled": 0.5, "at_limit": 0.2}
    alone = replace(result, attempts=result.attempts[:1])
    return {
        "as it ran": result,
        "at rest, quietly": changed(result, score=quiet),
        "settles": changed(result, score={"final": np.full(2, 0.1), "settled": 0.5}),
        "does not settle": changed(result, score={"settled": math.inf}),
        "fell": changed(result, score={"fell": 0.3}, ended="The supervisor stopped it."),
        "ran out of travel": changed(result, score={"ran_out": 0.2}),
        "one alone": alone,
        "nothing run": nothing_run(result),
        "no uncertainty": replace(nothing_run(result), uncertain=False),
        "one not run": replace(result, attempts=(result.attempts[0], replace(result.attempts[1], measured=None))),
        "interrupted": replace(result, interrupted=True, ways=()),
        "seldom": changed(result, before={"words": words(falls=0.75, stabilised=0.25)}),
        "busy": changed(
            nothing_run(result), before={"words": words(stabilised_with_excessive_effort=1.0), "rest": restless}
        ),
        "no margins": changed(result, before={"margins": None, "noise": None}),
        "not trusted": untrusted(result),
        "one rig": replace(changed(nothing_run(result)), request=replace(result.request, draws=1)),
    }


def test_every_sentence_is_printed_for_some_result(ran):
    template = Rendered(MODULE)
    with template.watched():
        for result in variants(ran).values():
            chapter(result)
    assert template.missed == {}


def shown(page: Chapter) -> str:
    """All that it says in words."""
    texts = [page.question, page.verdict, page.detail]
    for part in page.parts:
        for block in part.content:
            texts += [block] if isinstance(block, str) else block.sentences if isinstance(block, Points) else []
    return "\n".join(texts)


def test_a_verdict_takes_at_most_120_words_and_no_sentence_of_it_more_than_40(ran):
    for name, result in variants(ran).items():
        page = chapter(result)
        said = f"{page.title} {page.question} {page.verdict}"
        assert len(said.split()) <= WORDS_OF_A_VERDICT, name
        longest = max(re.split(r"(?<=[.?;]) ", shown(page).replace("\n", " ")), key=lambda s: len(s.split()))
        assert len(longest.split()) <= 40, longest


def test_half_of_the_sentences_have_at_most_25_words(ran):
    for name, result in variants(ran).items():
        lengths = [len(s.split()) for s in re.split(r"(?<=[.?!])\s", shown(chapter(result)))]
        assert np.median(lengths) <= 25, name


def test_the_table_prints_the_figures_of_the_runs(ran):
    """To the digits printed: three for times and peaks of the command."""
    table = next(b for p in chapter(ran).parts for b in p.content if isinstance(b, Table))
    column = {heading: i for i, heading in enumerate(table.headings)}
    scores = [s for a in ran.attempts for s in (a.before.score, a.score)]
    assert len(table.rows) == len(scores) == 4
    for row, score in zip(table.rows, scores, strict=True):
        assert float(row[column["settled [s]"]]) == pytest.approx(score.settled, rel=5e-3)
        assert float(row[column["peak [V]"]]) == pytest.approx(score.effort_peak, rel=5e-3)
        assert float(row[column["at limit"]].removesuffix(" %")) == pytest.approx(100 * score.saturated, abs=0.05)
    for row, a in zip(table.rows[::2], ran.attempts, strict=True):
        assert float(row[column["tilt [deg]"]]) == pytest.approx(math.degrees(a.before.tilt), abs=0.5)
        assert float(row[column["tap [rad/s]"]]) == pytest.approx(a.before.push, abs=0.05)
        held = np.mean(a.before.drawn.held)
        assert float(row[column["probability"]].removesuffix(" %")) == pytest.approx(100 * held, abs=0.5)


def test_a_set_is_recommended_by_the_number_of_rigs_that_it_stabilises(ran):
    three = changed(ran, before={"words": words(stabilised=0.75, falls=0.25)})
    assert "stabilises 3 of 4 rigs sampled from the fit's covariance without saturation" in chapter(three).verdict
    none = changed(ran, before={"words": words(falls=1.0)})
    assert "stabilises none of 4 rigs" in chapter(none).verdict


def test_a_run_that_fell_is_named_with_its_time_and_what_stopped_it(ran):
    page = chapter(variants(ran)["fell"])
    assert "0 of 2 runs agreed with their predictions. Not so: set 2: falls" in page.verdict
    assert "Measured: it fell after 0.3 s. The supervisor stopped it." in shown(page)
    assert not page.sound


def test_no_probability_is_printed_of_a_model_that_is_not_trusted(ran):
    page = chapter(variants(ran)["not trusted"])
    assert page.verdict.startswith("Do not rely on this")
    assert not re.search(r"probability[^.]*\d+ %", page.verdict + shown(page))


@pytest.mark.parametrize(("counts", "still"), [(1.9, True), (2.1, False)])
def test_a_cart_that_rests_within_two_counts_of_its_own_encoder_is_still(ran, counts, still):
    """Its counts are per metre, the pendulum's per turn: one is ninety times the other."""
    fine, coarse = ran.rig.resolution
    assert coarse > 50 * fine
    page = chapter(changed(ran, score={"final": np.array([counts * fine, 0.0]), "settled": 0.5, "at_limit": 0.0}))
    table = next(b for p in page.parts for b in p.content if isinstance(b, Table))
    measured = [row[-1] for row in table.rows[1::2]]
    assert len(measured) == 2
    assert all((cell == "still") == still for cell in measured)


@pytest.mark.parametrize(("rms", "said"), [(0.3, True), (0.01, False)])
def test_the_command_at_rest_is_blamed_only_where_it_is_too_much_itself(ran, rms, said):
    """Most rigs that the fit allows may be busy where the one that was identified is quiet."""
    rest = replace(ran.attempts[0].before.rest, rms=rms, peak=2 * rms)
    busy = {"words": words(stabilised_with_excessive_effort=1.0), "rest": rest}
    page = chapter(changed(nothing_run(ran), before=busy))
    assert rest.quiet != said
    assert ("The command at rest" in page.verdict + page.detail + shown(page)) == said
