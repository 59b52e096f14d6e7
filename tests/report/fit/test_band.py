"""Is the band drawn around a prediction, and around nothing else?"""

from dataclasses import replace

import numpy as np

from tests.report.conftest import make_swing
from upright.report.fit.figures import fit_figure


def filled(figure):
    """Lower and upper edge of everything that is filled, panel by panel."""
    return [
        (shape.get_paths()[0].vertices[:, 1].min(), shape.get_paths()[0].vertices[:, 1].max())
        for panel in figure.axes for shape in panel.collections
    ]  # fmt: skip


def test_a_prediction_is_drawn_with_its_band():
    """Of theta alone: around the model above, and around zero below, as wide as it is, thinned or not."""
    for n in (500, 5000):
        swing = make_swing("predict", n=n)
        half = np.linspace(0.02, 0.05, n)
        edges = filled(fit_figure(replace(swing, band={"theta": half})))
        model = swing.simulated[:, 1]
        np.testing.assert_allclose(edges, [((model - half).min(), (model + half).max()), (-0.05, 0.05)])


def test_a_fitted_run_has_none():
    assert not filled(fit_figure(make_swing()))
