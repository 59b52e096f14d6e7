"""Is a record refused when it cannot be true, and does it survive every journey?"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from upright.errors import BadInput
from upright.readers import inspect
from upright.records import Provenance, Record

NUMBERS = st.floats(min_value=-1e15, max_value=1e15, allow_nan=False, width=64)
NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), min_size=1, max_size=12).filter(
    lambda name: name != "t" and name.strip() == name
)


@st.composite
def records(draw: st.DrawFn) -> Record:
    n = draw(st.integers(2, 12))
    steps = draw(hnp.arrays(np.float64, n, elements=st.floats(1e-4, 10)))
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    signals = {name: draw(hnp.arrays(np.float64, n, elements=NUMBERS)) for name in names}
    cut = draw(st.integers(0, len(names) - 1))
    return Record(
        t=np.cumsum(steps),
        signals=signals,
        units={names[0]: "counts"},
        inputs=tuple(names[:cut]),
        outputs=tuple(names[cut:]),
        provenance=Provenance(file="run 1.csv", sha256="ab", reader="csv", window=(0.5, 2.0), notes=("a, 'b'", "ü")),
    )


def small(**changes: object) -> Record:
    fields = {"t": [0.0, 0.1, 0.2], "signals": {"u": [0, 1, 1], "theta": [0.0, 0.1, 0.3]}} | changes
    return Record(**fields)  # type: ignore[arg-type]


def same(a: Record, b: Record) -> bool:
    return (
        np.array_equal(a.t, b.t)
        and a.names == b.names
        and all(np.array_equal(a[name], b[name]) for name in a.names)
        and (a.units, a.inputs, a.outputs, a.provenance) == (b.units, b.inputs, b.outputs, b.provenance)
    )


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"t": [0.0, 0.1, 0.1]}, "sample 3 is at 0.1 s after 0.1 s"),
        ({"t": [0.0, 0.2, 0.1]}, "Time must increase"),
        ({"t": [0.0, np.nan, 0.1]}, "sample 2"),
        ({"t": [0.0], "signals": {}}, "at least 2 samples"),
        ({"signals": {"u": [0, 1]}}, "needs 3 samples"),
        ({"signals": {"u": [0, np.inf, 1]}}, "column 'u' must be finite"),
        ({"signals": {"u": [0, 1e300, 1]}}, "below 1e\\+30"),
        ({"signals": {"u": ["a", "b", "c"]}}, "must be numbers"),
        ({"signals": {"u": np.zeros((3, 2))}}, "one-dimensional"),
        ({"inputs": ("theata",)}, "did you mean 'theta'"),
        ({"units": {"v": "V"}}, "no column 'v'"),
    ],
)
def test_a_record_that_cannot_be_true_is_refused_with_a_sentence(changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(BadInput, match=sentence):
        small(**changes)


def test_signals_cannot_be_changed_behind_the_record() -> None:
    source = np.array([0.0, 0.1, 0.3])
    record = small(signals={"theta": source})
    source[0] = 9
    assert record["theta"][0] == 0
    with pytest.raises(ValueError, match="read-only"):
        record["theta"][0] = 9


def test_inputs_and_outputs_are_columns_in_the_order_named() -> None:
    record = small(inputs=("u",), outputs=("theta", "u"))
    assert record.u.shape == (3, 1)
    np.testing.assert_array_equal(record.y, [[0, 0], [0.1, 1], [0.3, 1]])
    assert small().y.shape == (3, 0)


def test_a_window_keeps_both_ends_and_says_so() -> None:
    part = small().window(0.1, 0.2)
    np.testing.assert_array_equal(part.t, [0.1, 0.2])
    assert part.provenance.window == (0.1, 0.2)
    with pytest.raises(BadInput, match="holds 0 samples"):
        small().window(5, 6)


def test_period_is_the_median_step() -> None:
    assert small(t=[0.0, 1.0, 5.0], signals={}).period == pytest.approx(2.5)


@settings(deadline=None)  # the first call pays for an import
@given(records())
def test_a_record_holds_and_lists_the_columns_of_its_data_frame(record: Record) -> None:
    frame = record.to_pandas()
    assert [name in record for name in (*record, "nothing")] == [name in frame for name in (*record, "nothing")]
    assert list(record) == [name for name in frame if name in record.signals]


@settings(deadline=None)
@given(records())
def test_pandas_gives_back_every_bit(record: Record) -> None:
    assert same(Record.from_pandas(record.to_pandas()), record)


@settings(deadline=None)  # the first call pays for an import
@given(records())
def test_xarray_gives_back_every_bit(record: Record) -> None:
    assert same(Record.from_xarray(record.to_xarray()), record)


@settings(deadline=None)  # the first call pays for an import
@given(records())
def test_control_gives_back_time_inputs_and_outputs(record: Record) -> None:
    back = Record.from_control(record.to_control())
    np.testing.assert_array_equal(back.t, record.t)
    np.testing.assert_array_equal(back.u, record.u)
    np.testing.assert_array_equal(back.y, record.y)
    assert (back.inputs, back.outputs) == (record.inputs, record.outputs)


def test_a_response_simulated_by_control_becomes_a_record() -> None:
    import control

    t = np.linspace(0, 5, 501)
    record = Record.from_control(control.step_response(control.tf([1], [1, 1]), t))
    # Unit step through 1/(s+1): 1 - exp(-t).
    np.testing.assert_allclose(record.y[:, 0], 1 - np.exp(-record.t), atol=1e-9)


@pytest.mark.parametrize("form", ["csv", "mat", "parquet"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30, deadline=None)
@given(record=records())
def test_files_give_back_every_bit(tmp_path: Path, form: str, record: Record) -> None:
    path = tmp_path / f"record.{form}"
    getattr(record, f"to_{form}")(path)
    assert same(getattr(Record, f"from_{form}")(path), record)


@pytest.mark.parametrize("form", ["csv", "mat", "parquet"])
def test_a_file_of_something_else_is_refused_with_a_sentence(tmp_path: Path, form: str) -> None:
    path = tmp_path / f"other.{form}"
    with pytest.raises(BadInput):
        getattr(Record, f"from_{form}")(path)
    path.write_bytes(b"\x00\x01 not a record \xff" * 20)
    with pytest.raises(BadInput):
        getattr(Record, f"from_{form}")(path)


def test_a_time_column_is_the_time_and_rows_are_not_counted_as_seconds() -> None:
    import pandas as pd

    frame = pd.DataFrame({"time [ms]": [0, 10, 20, 30], "theta [rad]": [0.1, 0.2, 0.3, 0.4]})
    record = Record.from_pandas(frame)
    np.testing.assert_allclose(record.t, [0.0, 0.01, 0.02, 0.03], rtol=1e-15)
    assert record.names == ("theta [rad]",)
    assert record.units == {"theta [rad]": "rad"}
    np.testing.assert_array_equal(Record.from_pandas(frame[frame.index > 0]).t, record.t[1:])


@pytest.mark.parametrize("name", ["t", "clock"])
def test_the_column_named_as_the_time_is_taken(name: str) -> None:
    import pandas as pd

    frame = pd.DataFrame({name: [1.0, 1.5, 2.5], "time": [7.0, 8.0, 9.0], "u": [0.0, 1.0, 0.0]})
    record = Record.from_pandas(frame, time=name)
    assert record.t.tolist() == [1.0, 1.5, 2.5]
    assert record.names == ("time", "u")


def test_stamps_count_from_the_first() -> None:
    import pandas as pd

    at = pd.to_datetime(["2025-02-14 09:22:43.000", "2025-02-14 09:22:43.250", "2025-02-14 09:22:44.000"])
    assert Record.from_pandas(pd.DataFrame({"u": [0.0, 1.0, 2.0]}, index=at)).t.tolist() == [0.0, 0.25, 1.0]


@pytest.mark.parametrize(
    ("columns", "time", "sentence"),
    [
        ({"u": [0.0, 1.0], "y": [0.0, 1.0]}, None, "needs one column of time, and its columns are u, y; name it"),
        ({"t": [0.0, 1.0], "time": [0.0, 1.0]}, None, "t and time are called so; name it, as in time='t'"),
        ({"clock": [0.0, 1.0], "u": [0.0, 1.0]}, "clok", "did you mean 'clock'"),
    ],
)
def test_a_frame_without_a_clear_time_is_refused(columns: dict[str, list[float]], time: str, sentence: str) -> None:
    import pandas as pd

    with pytest.raises(BadInput, match=sentence):
        Record.from_pandas(pd.DataFrame(columns), time=time)


def test_a_step_of_time_that_no_clock_has_is_refused():
    """1/5e-324 overflows, and so did whatever came of the sample rate."""
    with pytest.raises(BadInput, match=r"advance by 1e-12 s or more .* comes 4\.94e-324 s after"):
        Record(t=np.arange(50) * 5e-324, signals={"x": np.zeros(50)})


def test_provenance_in_numbers_is_text_after_reading(tmp_path):
    """Who edits the second line of such a file by hand, or with a program, may put anything there."""
    about = '{"units": {"x": 3}, "provenance": {"file": 5, "notes": [1, 2.5], "window": ["0", 1]}}'
    (tmp_path / "own.csv").write_text(f"# upright record 1\n# {about}\nt,x\n0,1\n1,2\n2,3\n", encoding="utf-8")
    record = Record.from_csv(tmp_path / "own.csv")
    assert record.provenance.notes == ("1", "2.5")
    assert (record.provenance.file, record.provenance.window) == ("5", (0.0, 1.0))
    assert inspect(record).time.samples == 3
