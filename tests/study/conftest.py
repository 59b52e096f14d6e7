"""A folder in which a test writes a study beside its log."""

import numpy as np
import pytest

from tests.study.crane_log import THETA, T, X
from upright.readers import inspect, read
from upright.study.draft.draft import draft
from upright.study.load import load_study


@pytest.fixture
def study(tmp_path):
    """Load a study written beside a log with the given columns; time and the two coordinates if none are given."""

    def load(text, *, t=T, log="log.csv", name="study.toml", **columns):
        columns = columns or {"theta": THETA, "x": X, "v": 2 * T}
        rows = np.column_stack([t, *columns.values()])
        np.savetxt(tmp_path / log, rows, "%.17g", ",", header=",".join(["t", *columns]), comments="")
        (tmp_path / name).write_text(text, encoding="utf-8")
        return load_study(tmp_path / name)

    return load


@pytest.fixture
def drafted(tmp_path):
    """Draft a study for a log with these columns, and load it."""

    def make(plant="", name="log.csv", **columns):
        t = columns.pop("t", np.arange(4000) * 0.01)
        rows = np.column_stack([t, *columns.values()])
        np.savetxt(tmp_path / name, rows, "%.17g", ",", header=",".join(["t", *columns]), comments="")
        record = read(tmp_path / name)
        text = draft(record, inspect(record), tmp_path / name, tmp_path / "study.toml", plant=plant)
        (tmp_path / "study.toml").write_text(text, encoding="utf-8")
        return text, load_study(tmp_path / "study.toml")

    return make


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a log; t from 0 to 10 s, theta in counts, z in m, v."""
    place = tmp_path_factory.mktemp("study")
    t = np.arange(1001) * 0.01
    columns = [t, np.round(700 * np.cos(6 * t)), 0.05 * np.sin(t), np.ones_like(t)]
    np.savetxt(place / "log.csv", np.column_stack(columns), "%.10g", ",", header="t,theta,z,v", comments="")
    silent = (t < 4) | (t > 6)
    np.savetxt(place / "silent.csv", np.column_stack(columns)[silent], "%.10g", ",", header="t,theta,z,v", comments="")
    (place / "bad_plant.py").write_text("import nothing_of_this_name\n", encoding="utf-8")
    return place
