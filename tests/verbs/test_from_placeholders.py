"""Does a loop that is designed for numbers nobody measured promise anything?"""

from __future__ import annotations

import numpy as np
import pandas as pd

import upright as up


def test_a_design_from_placeholders_promises_nothing_and_says_what_to_do(tmp_path):
    heavy = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.11, J_p=6e-4, b_1=1e-3, b_2=6e-5)
    log = up.simulate(heavy, at="hanging", start={"theta": "40 deg"}, seconds=6, dt=5e-3)
    frame = pd.DataFrame({"t": log.t, "psi": log["psi"], "theta": log["theta"]})
    fit = up.identify(up.init(frame, plant="furuta", out=tmp_path / "free.toml").files[0])
    done = up.design(fit, at="inverted", poles=[-8, -9, -10, -12], limit=5, period="2 ms", counts=4000)
    model = heavy.linear("inverted")
    growth = np.linalg.eigvals(model.A - model.B @ np.atleast_2d(done.K)).real.max()
    assert growth > 0  # for the arm is a hundred times as heavy as the draft's placeholder
    assert done.numbers["chance_over_the_fit"] == "not supported"
    assert "the fastest pole is not known: it rests on" in done.chapter.first_line
    assert "identify again" in done.chapter.steps[0].sentence
