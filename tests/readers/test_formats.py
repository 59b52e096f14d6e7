"""Does each program's log come back as the numbers it was made from, and is damage named by line and column?"""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from tests.readers import logs
from upright.errors import BadInput
from upright.readers import read, read_source, reader_of
from upright.readers.resolution import rebuild
from upright.readers.source import Source
from upright.records import Record


def source(data: bytes, name: str = "log.csv") -> Source:
    return Source(file=name, data=data)


@pytest.mark.parametrize(
    ("name", "reader"),
    [
        ("ecp.csv", "ecp"),
        ("front end.txt", "table"),
        ("named.csv", "table"),
        ("bare.csv", "table"),
        ("hash.txt", "table"),
        ("bag.csv", "ros-bag"),
        ("plain.mat", "matlab"),
        ("run.mcap", "mcap"),
    ],
)
def test_the_format_is_told_by_the_content_not_by_the_suffix(name: str, reader: str) -> None:
    assert reader_of(source(logs.SYNTHETIC[name](), "renamed.dat")) == reader


@pytest.mark.parametrize("newline", ["\r\n", "\n"])
def test_an_ecp_export_goes_by_the_names_of_its_columns(newline: str) -> None:
    record = read_source(source(logs.ecp_export(newline=newline, columns=("Encoder 2 Pos", "Control Effort"))))
    assert record.names == ("Sample", "Encoder 2 Pos", "Control Effort")
    assert record.units == {"Sample": "1", "Encoder 2 Pos": "counts", "Control Effort": "V"}
    np.testing.assert_array_equal(record["Encoder 2 Pos"], np.round(300 * np.sin(0.1 * np.arange(60))))
    np.testing.assert_array_equal(record["Control Effort"], 0.5)


@settings(deadline=None)
@given(st.floats(0.0021, 0.05), st.integers(20, 400), st.floats(0, 0.9))
def test_a_clock_rounded_to_1_ms_is_rebuilt_to_its_period(period: float, n: int, phase: float) -> None:
    true = period * np.arange(n) + phase * 1e-3
    rebuilt, note = rebuild(np.round(true, 3))
    if note:
        # Both ends are off by half a millisecond at most, so no sample is off by more than that.
        np.testing.assert_allclose(rebuilt, true, atol=0.51e-3)
        assert np.ptp(np.diff(rebuilt)) < 1e-9


def test_a_true_jitter_is_left_as_it_is() -> None:
    rng = np.random.default_rng(3)
    t = np.cumsum(0.002 + 4e-4 * rng.random(500))
    kept, note = rebuild(t)
    assert note == ""
    np.testing.assert_array_equal(kept, t)


def test_a_missing_sample_keeps_its_place_when_the_log_counts_samples() -> None:
    lines = logs.tab_export(80).decode().split("\n")
    del lines[41]  # sample 41
    record = read_source(source("\n".join(lines).encode()))
    steps = np.diff(record.t)
    assert int(np.argmax(steps)) == 39
    assert steps[39] == pytest.approx(2 * np.median(steps), rel=1e-6)


def test_a_table_without_names_counts_its_columns() -> None:
    record = read_source(source(logs.bare_csv()))
    assert record.names == ("c1", "c2")
    np.testing.assert_allclose(record.t, 0.00667 * np.arange(60), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "t", "names"),
    [
        ("time [ms];theta [deg]\n0;1\n2;3\n5;4\n", [0, 0.002, 0.005], ("theta [deg]",)),
        ("t\tx\n0\t1,5\n1\t2,5\n", [0, 1], ("x",)),
        ("% made by hand\n% t x\n0 1\n1 2\n", [0, 1], ("x",)),
        ("x, t\n5, 0\n5, 1\n", [0, 1], ("x",)),
        ('"t","x, raw"\n0,1\n1,2\n', [0, 1], ("x, raw",)),
        ("t  Encoder 1 Pos\n0  1\n1  2\n", [0, 1], ("Encoder 1 Pos",)),
        ("t_us,x\n0,1\n2000,2\n", [0, 0.002], ("x",)),
        ("0 1d0\n1 2D0\n", [0, 1], ("c1",)),
        ("t x\n0,0 1,5\n0,5 2,5\n", [0, 0.5], ("x",)),
        ("# by hand\n0 1 2\n1 2 3\n", [0, 1], ("c1", "c2")),
    ],
)
def test_habits_of_other_programs_are_read(text: str, t: list[float], names: tuple[str, ...]) -> None:
    record = read_source(source(text.encode()))
    np.testing.assert_allclose(record.t, t, rtol=1e-12)
    assert record.names == names


def test_a_unit_in_brackets_is_the_stated_unit() -> None:
    units = read_source(source(b"t [s],theta [rad],note (no unit),V\n0,1,2,3\n1,2,3,4\n")).units
    assert units == {"theta [rad]": "rad", "note (no unit)": "", "V": ""}


def test_an_epoch_in_a_table_keeps_its_nanoseconds() -> None:
    record = read_source(source(b"time,x\n1707681595.547459602,0\n1707681595.547459603,0\n1707681595.549459605,1\n"))
    np.testing.assert_allclose(record.t, [0, 1e-9, 2.000003e-3], rtol=1e-12)


def test_a_bag_keeps_nanoseconds_and_holds_its_commands() -> None:
    record = read_source(source(logs.ros_bag()))
    np.testing.assert_allclose(record.t, 2_000_123e-9 * np.arange(60), rtol=0, atol=1e-12)
    np.testing.assert_allclose(record["/joint_states/joint1/position"], 0.01 * np.arange(60), atol=1e-12)
    # Message i = 9, 19, ... was followed 0.9 ms later by the command i; the next sample is 2 ms after.
    expected = [0.0 if i < 10 else (i // 10) * 10 - 1 for i in range(60)]
    np.testing.assert_array_equal(record["/effort_control/data.0"], expected)


def test_a_bag_says_that_the_first_of_its_joints_moved_before_the_first_command() -> None:
    """Joint 1 leaves its place at 24 ms, joint 2 at 110 ms, and the first command was recorded at 100 ms."""
    lines = [
        "__time,/effort_control/data.0,/joint_states/header/stamp,/joint_states/a/position,/joint_states/b/position"
    ]
    for i in range(60):
        stamp = 1.7e9 + 0.002 * i
        one, two = 0.1 * max(0, i - 11), 0.1 * max(0, i - 54)
        lines.append(f"{stamp + 0.0004:.6f},,{stamp:.9f},{one:.9f},{two:.9f}")
        if i >= 49:
            lines.append(f"{stamp + 0.0009:.6f},2.0,,,")
    notes = read_source(source(("\n".join(lines) + "\n").encode())).provenance.notes
    assert any(note.startswith("The rig moves at 0.024 s, before the first command") for note in notes)


@pytest.mark.parametrize("compressed", [True, False])
def test_our_matlab_parser_agrees_with_scipy(compressed: bool) -> None:
    from scipy.io import savemat

    from upright.readers.formats.matlab import variables

    rng = np.random.default_rng(1)
    given_ = {
        "a": rng.normal(size=(3, 5)),
        "i": np.arange(-7, 9, dtype=np.int16),
        "b": np.uint8([[200]]),
        "f": np.float32([1.5, 2.5]),
        "text": "Square Wave µ",
        "s": {"gain": 0.5, "inner": {"x": np.arange(4.0)}},
        "c": np.array([np.arange(3.0), "two"], dtype=object),
        "e": np.empty((0, 0)),
        "z": np.array([1 + 2j, 3]),
        "q": np.zeros((2, 3, 4)),
    }
    file = io.BytesIO()
    savemat(file, given_, do_compression=compressed)
    found = variables(source(file.getvalue(), "a.mat"))
    for name in ("a", "i", "b", "f", "e", "q"):
        np.testing.assert_array_equal(found[name].ravel(), np.ravel(given_[name]))
    assert found["a"].shape == (3, 5)
    assert found["text"] == "Square Wave µ"
    np.testing.assert_array_equal(found["s"]["inner"]["x"].ravel(), np.arange(4.0))
    np.testing.assert_array_equal(found["c"][0].ravel(), np.arange(3.0))
    assert found["c"][1] == "two"
    assert found["z"].kind == "complex numbers"


def test_simulink_structures_share_their_time(tmp_path: Path) -> None:
    from scipy.io import savemat

    t = 60 + np.arange(50) * 1e-4
    structure = {
        name: {
            "time": t[:, None],
            "signals": {"values": values[:, None], "dimensions": 1, "label": ""},
            "blockName": "x",
        }
        for name, values in (("Theta1", np.cos(t)), ("Distance", 0 * t))
    }
    savemat(tmp_path / "run.mat", structure)
    record = read(tmp_path / "run.mat")
    assert record.names == ("Theta1", "Distance")
    np.testing.assert_array_equal(record["Theta1"], np.cos(t))
    np.testing.assert_array_equal(record.t, t)


def test_pieces_that_follow_on_are_joined_in_the_order_of_time(tmp_path: Path) -> None:
    from scipy.io import savemat

    t = np.arange(90) * 1e-3
    y = np.vstack((np.sin(t), np.cos(t)))

    def cells(*items: np.ndarray) -> np.ndarray:
        out = np.empty((len(items), 1), dtype=object)
        out[:, 0] = items
        return out

    content = {
        "Time_b": cells(t[60:, None]),
        "Y_b": cells(y[:, 60:]),
        "Time_a": cells(t[:30, None], t[30:60, None]),
        "Y_a": cells(y[:, :30], y[:, 30:60]),
        "dt": 1e-3,
    }
    savemat(tmp_path / "pieces.mat", content)
    record = read(tmp_path / "pieces.mat")
    assert record.names == ("Y_1", "Y_2")
    np.testing.assert_array_equal(record.t, t)
    np.testing.assert_array_equal(record["Y_2"], np.cos(t))
    assert any("dt = 0.001" in note for note in record.provenance.notes)


def test_settings_become_notes(tmp_path: Path) -> None:
    record = read_source(source(logs.mat_vectors(runParameters={"P_gain": 0.6, "Waveform": "Square Wave"}), "a.mat"))
    assert any("P_gain = 0.6, Waveform = 'Square Wave'" in note for note in record.provenance.notes)


@pytest.mark.parametrize("form", ["csv", "mat"])
def test_our_own_files_are_recognised(tmp_path: Path, form: str) -> None:
    record = Record(t=[0, 1, 2.5], signals={"my θ, raw": [1, 2, 4]}, units={"my θ, raw": "rad"}, outputs=("my θ, raw",))
    getattr(record, f"to_{form}")(tmp_path / "record")
    back = read(tmp_path / "record")
    np.testing.assert_array_equal(back["my θ, raw"], record["my θ, raw"])
    assert (back.units, back.outputs) == (record.units, record.outputs)


def test_provenance_names_the_content() -> None:
    import hashlib

    data = logs.named_csv()
    assert read_source(source(data)).provenance.sha256 == hashlib.sha256(data).hexdigest()


def test_two_megabytes_are_read_in_a_few_times_what_numpy_takes() -> None:
    """Row by row it would be twenty times; a ratio, since machines differ by as much."""
    from io import StringIO
    from time import process_time

    data = logs.named_csv(30_000)
    assert len(data) > 2e6

    def least(call: Callable[[], object]) -> float:
        spent = []
        for _ in range(3):
            start = process_time()
            call()
            spent.append(process_time() - start)
        return min(spent)

    alone = least(lambda: np.loadtxt(StringIO(data.decode()), delimiter=",", skiprows=1))
    assert least(lambda: read_source(source(data))) < 6 * alone


SWING_T = np.arange(200) * 0.01
SWING = np.sin(6 * SWING_T) * np.exp(-0.2 * SWING_T)
PUSH = np.sign(np.sin(SWING_T))


def mat(**content) -> Record:
    file = io.BytesIO()
    savemat(file, content)
    return read_source(source(file.getvalue(), "log.mat"))


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ({"data": np.column_stack([SWING_T, SWING, PUSH])}, ("data_2", "data_3")),
        ({"data": np.stack([SWING_T, SWING, PUSH])}, ("data_2", "data_3")),
        ({"log": {"time": SWING_T, "theta": SWING, "u": PUSH}}, ("theta", "u")),
        ({"time": SWING_T, "log": {"theta": SWING, "u": PUSH}}, ("theta", "u")),
    ],
    ids=["matrix", "matrix in rows", "structure with its time", "structure beside its time"],
)
def test_matlab_habits_beside_simulinks_are_read(content, names):
    record = mat(**content)
    assert record.names == names
    np.testing.assert_allclose(record.t, SWING_T, rtol=0, atol=1e-12)
    for name, x in zip(names, (SWING, PUSH), strict=True):
        np.testing.assert_array_equal(record[name], x)


def test_a_matrix_without_a_column_that_can_be_time_is_refused():
    with pytest.raises(BadInput, match="needs a vector called t or time"):
        mat(data=np.column_stack([SWING, PUSH, SWING_T**3 - SWING_T]))


@pytest.mark.parametrize("header", ["t,theta,u,", "t,theta,u"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_delimiter_behind_the_last_column_is_no_column(header, newline):
    rows = [f"{t:.2f},{x!r},{u:.0f}," for t, x, u in zip(SWING_T, SWING.tolist(), PUSH, strict=True)]
    record = read_source(source(newline.join([header, *rows, ""]).encode()))
    assert record.names == ("theta", "u")
    np.testing.assert_array_equal(record["theta"], SWING)


def test_a_last_column_that_is_named_and_left_empty_is_named_in_the_sentence():
    rows = "\n".join(f"{t:.2f},{x:.6f}," for t, x in zip(SWING_T, SWING, strict=True))
    with pytest.raises(BadInput, match=r"column 3 \(u\): this column is empty in every row"):
        read_source(source(f"t,theta,u\n{rows}\n".encode()))
