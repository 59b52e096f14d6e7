"""A held-out tail is scored alone, and the report says and shows where its score begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from tests.report.conftest import make_swing
from upright.identification.estimate import predict
from upright.identification.inference.scoring import fit_percent
from upright.physics import Pendulum
from upright.report.fit.figures import fit_figure
from upright.report.fit.tables import score_table


def test_score_says_from_where_it_counts() -> None:
    run = noisy(swing(seconds=6.0, role="predict", score_from=4.0), 1e-3, seed=1)
    score = predict(PENDULUM, rig(Pendulum, PENDULUM, {}), [run])["swing"]
    assert score.score_from == 4.0
    tail = score.t >= 4.0 - 1e-9
    assert score.fit_percent["theta"] == pytest.approx(fit_percent(score.y[tail, 0], score.simulated[tail, 0]))


def test_part_not_scored_is_shaded_in_every_panel() -> None:
    shaded = fit_figure(replace(make_swing("predict"), score_from=4.0))
    for panel in shaded.axes:
        bands = [p for p in panel.patches if np.isclose(p.get_extents().transformed(panel.transData.inverted()).x1, 4)]
        assert len(bands) == 1
        assert bands[0].get_extents().transformed(panel.transData.inverted()).x0 == pytest.approx(0.0)
    assert "not scored" in [text.get_text() for text in shaded.legends[0].get_texts()]
    assert not any(panel.patches for panel in fit_figure(make_swing()).axes)


def test_table_says_from_where_scores_count() -> None:
    runs = {"whole": make_swing(), "tail": replace(make_swing("predict", horizon=2.0), score_from=30.0)}
    said = {row[0]: row[-1] for row in score_table(runs).rows}
    assert said == {"whole": "from the first sample", "tail": "restarted every 2 s; scored from 30 s on"}
