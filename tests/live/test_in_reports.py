"""Does the rig move in the reports of fits and designs, and stay out of those that know too little?"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import upright as up
from tests.live.browser import opened, until

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=0.003, b_2=2e-4, b_1c=0.008, b_2c=3e-4)
RIG = up.Rig.known(ARM, name="bench 3", gain="0.65 N m/V", limit="3 V", period="2 ms", counts=4096, travel="120 deg")


def test_a_design_for_a_rig_has_it_and_one_for_matrices_has_not(tmp_path):
    up.design(RIG, at="inverted", out=tmp_path / "rig")
    up.design(RIG.linear("inverted"), period="2 ms", out=tmp_path / "matrices")
    pages = [(tmp_path / name / "design.html").read_text(encoding="utf-8") for name in ("rig", "matrices")]
    assert ["<iframe" in page for page in pages] == [True, False]
    assert 'sandbox="allow-scripts"' in pages[0]
    assert len(pages[0]) < 600_000


def test_a_page_of_an_answer_shows_itself_in_a_notebook_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    played = up.play(RIG, draws=16)
    assert played._repr_html_().startswith('<iframe sandbox="allow-scripts"')
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_fit_plays(tmp_path):
    """A hanging swing, driven, of which limit and counts are given."""
    import numpy as np

    t = np.arange(0, 6, 2e-3)
    u = np.where(t < 5, 1.2 * np.sign(np.sin(2 * math.pi * 0.7 * t)), 0.0)
    motion = up.simulate(RIG, u=u, at="hanging", seconds=6.0)
    fit = up.identify(motion, up.Furuta, known={"m_p": 0.135, "r": 0.16, "actuator.gain": 0.65}, columns={"T": "T"})
    played = fit.play(limit="3 V", period="2 ms", counts=4096, draws=16, out=tmp_path / "play.html")
    assert int(played.held.sum()) == 16
    assert (tmp_path / "play.html").stat().st_size < 150_000


def test_of_a_model_that_is_not_trusted_no_share_is_told_as_the_rig_s():
    from upright.basis import NOT_TRUSTED, Basis

    doubted = replace(RIG, basis=Basis(level=NOT_TRUSTED, sentence="It does not predict."))
    played = up.play(doubted, draws=16)
    assert played.numbers["held"] == "not supported"
    assert played.chapter.verdict.startswith("Do not rely on this")
    assert ">Of the rig not supported; of the model: 16 of 16 rigs" in played.page


@pytest.mark.slow
def test_it_moves_inside_the_report(tmp_path):
    up.design(RIG, at="inverted", out=tmp_path)
    with opened(tmp_path / "design.html", width=1280) as (page, wrong):
        page.locator("iframe.live").scroll_into_view_if_needed()
        live = page.locator("iframe.live").content_frame
        live.locator("#share").wait_for()  # it is loaded once it is seen, into a frame that is another one until then
        frame = live.locator("html").element_handle().owner_frame()
        until(frame, "window.upright && upright.answered.length > 0 && upright.twin.k > 100")
        assert "rigs are stabilised" in frame.inner_text("#share")
        assert not frame.locator("h1").is_visible()
        assert wrong == []
