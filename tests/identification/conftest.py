"""A folder in which a test writes a study beside its log."""

import numpy as np
import pytest
from tests.identification.crane_log import THETA, T, X

from upright.identification.study import load_study


@pytest.fixture
def study(tmp_path):
    """Load a study written beside a log with the given columns; time and the two coordinates if none are given."""

    def load(text, *, t=T, log="log.csv", name="study.toml", **columns):
        columns = columns or {"theta": THETA, "x": X, "v": 2 * T}
        rows = np.column_stack([t, *columns.values()])
        np.savetxt(tmp_path / log, rows, "%.17g", ",", header=",".join(["t", *columns]), comments="")
        (tmp_path / name).write_text(text)
        return load_study(tmp_path / name)

    return load
