"""Does a MATLAB file hold what the format's description says, and is each habit of saving a log read as meant?

Elements are put together here byte by byte after "MAT-File Format" (The MathWorks), or saved by SciPy.
"""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from tests.readers.test_damage import element, matlab, start
from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.formats.matlab import READER, variables
from upright.readers.source import Source
from upright.records import Record


def source(data: bytes, name: str = "log.mat") -> Source:
    return Source(file=name, data=data)


def saved(**content: Any) -> bytes:
    file = io.BytesIO()
    savemat(file, content)
    return file.getvalue()


def record(**content: Any) -> Record:
    return read_source(source(saved(**content)))


def refusal(**content: Any) -> str:
    with pytest.raises(BadInput) as caught:
        record(**content)
    return str(caught.value)


def of(*elements: bytes) -> dict[str, Any]:
    return variables(source(matlab(*elements)))


def cells(*items: Any) -> np.ndarray:
    out = np.empty((len(items), 1), dtype=object)
    out[:, 0] = items
    return out


HDF5 = b"\x89HDF\r\n\x1a\n"


@pytest.mark.parametrize(
    ("name", "data", "recognised"),
    [
        ("a.dat", b"MATLAB 5.0", True),
        ("a.dat", b"matlab 5.0", False),
        ("a.dat", HDF5, True),
        ("a.dat", bytes(512) + HDF5, True),
        ("a.dat", bytes(511) + HDF5, False),
        ("a.dat", b"t,x\n\0", False),
        ("a.MAT", b"t,x\n\0", True),
        ("a.mat", b" " * 127 + b"\0", True),
        ("a.mat", b" " * 128 + b"\0", False),
    ],
)
def test_a_matlab_file_is_known_by_its_beginning_or_by_its_suffix_and_a_zero_byte(name, data, recognised):
    assert READER.recognises(source(data, name)) is recognised


NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}


def swapped(kind: int, data: bytes) -> bytes:
    return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)


@pytest.mark.parametrize(("kind", "form"), NUMBERS.items())
def test_numbers_of_each_type_come_back_column_by_column(kind, form):
    """Table 1-1 of the format: the number of each type. A file of either byte order says which."""
    x = np.arange(6).astype("<" + form) * (50 if form not in ("i1", "u1") else 20)
    found = of(element(14, start(6, 2, 3) + element(kind, x.tobytes())))["a"]
    np.testing.assert_array_equal(found, np.array([[x[0], x[2], x[4]], [x[1], x[3], x[5]]], dtype=float))
    big = swapped(6, struct.pack(">II", 6, 0)) + swapped(5, struct.pack(">2i", 2, 3)) + swapped(1, b"a")
    data = matlab()[:126] + b"MI" + swapped(14, big + swapped(kind, x.astype(">" + form).tobytes()))
    np.testing.assert_array_equal(variables(source(data))["a"], found)


@pytest.mark.parametrize(
    ("kind", "encoding"),
    [(1, "latin-1"), (2, "latin-1"), (4, "utf-16-le"), (16, "utf-8"), (17, "utf-16-le"), (18, "utf-32-le")],
)  # fmt: skip
def test_text_of_each_type_comes_back_as_its_characters(kind, encoding):
    assert of(element(14, start(4, 1, 5) + element(kind, "90 °C".encode(encoding))))["a"] == "90 °C"


def test_text_in_a_file_of_the_other_byte_order_is_read():
    head = swapped(6, struct.pack(">II", 4, 0)) + swapped(5, struct.pack(">2i", 1, 3)) + swapped(1, b"a")
    data = matlab()[:126] + b"MI" + swapped(14, head + swapped(17, "abc".encode("utf-16-be")))
    assert variables(source(data)) == {"a": "abc"}


@pytest.mark.parametrize(
    ("code", "kind"), [(0, "object"), (3, "object"), (5, "sparse matrix"), (16, "object"), (17, "object")]
)
def test_a_class_that_only_matlab_knows_is_passed_over_by_name(code, kind):
    """0 is none, 3 an object, 16 a function handle, 17 opaque; what follows in the file is read."""
    if 1 <= code <= 15:
        body = start(code, 1, 1)
    else:
        body = element(6, struct.pack("<II", code, 0)) + element(1, b"a")
    after = element(14, start(6, 1, 1).replace(b"a", b"b") + element(9, struct.pack("<d", 2.5)))
    found = of(element(14, body), after)
    assert found["a"].kind == kind
    assert found["b"].item() == 2.5


@pytest.mark.parametrize("code", [6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
def test_every_class_of_numbers_is_read_whatever_type_it_is_packed_as(code):
    body = start(code, 1, 3) + element(2, bytes([3, 1, 2]))
    assert of(element(14, body))["a"].tolist() == [[3, 1, 2]]


@pytest.mark.parametrize(("flag", "plain"), [(0x0200, True), (0x0400, True), (0x0800, False)])
def test_of_the_flags_only_complex_hides_the_numbers(flag, plain):
    """Logical and global values are numbers like any other."""
    flagged = element(6, struct.pack("<II", 6 | flag, 0)) + element(5, struct.pack("<2i", 1, 2)) + element(1, b"a")
    found = of(element(14, flagged + element(9, struct.pack("<2d", 1, 0))))["a"]
    if plain:
        assert found.tolist() == [[1, 0]]
    else:
        assert found.kind == "complex numbers"


def small(kind: int, data: bytes) -> bytes:
    """Element whose data live inside its tag; its length may be a lie."""
    return struct.pack("<HH", kind, len(data)) + data[:4].ljust(4, b"\0")


def test_four_bytes_live_inside_a_tag_and_five_do_not():
    head = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<2i", 1, 4))
    found = of(element(14, head + small(1, b"gain") + small(2, bytes([1, 2, 3, 4]))))
    assert {name: x.tolist() for name, x in found.items()} == {"gain": [[1, 2, 3, 4]]}
    with pytest.raises(BadInput, match="an element of 5 bytes where 12 are left"):
        of(element(14, head + small(1, b"gains") + small(2, bytes(4))))


@pytest.mark.parametrize("length", [1, 7, 8, 9])
def test_data_are_padded_to_eight_bytes(length):
    body = start(6, 1, length) + element(2, bytes(range(length)))
    after = element(14, start(6, 1, 1).replace(b"a", b"b") + element(2, bytes([7])))
    found = of(element(14, body), after)
    assert found["a"].tolist() == [list(range(length))]
    assert found["b"].item() == 7


def nest(depth: int) -> bytes:
    """A number in `depth` cells, one in the other."""
    body = start(6, 1, 1) + element(2, bytes([9]))
    for _ in range(depth):
        body = start(1, 1, 1) + element(14, body)
    return element(14, body)


def test_cells_lie_in_each_other_sixteen_deep():
    value = of(nest(16))["a"]
    for _ in range(16):
        (value,) = value
    assert value.item() == 9
    with pytest.raises(BadInput, match="structures nested too deeply"):
        of(nest(17))


def field(value: float) -> bytes:
    return element(14, start(6, 1, 1).replace(b"a", b"\0") + element(9, struct.pack("<d", value)))


def structure(rows: int, *values: float, width: int = 8) -> bytes:
    names = b"".join(name.ljust(width, b"\0") for name in (b"gain", b"period"))
    head = start(2, 1, rows) + element(5, struct.pack("<i", width)) + element(1, names)
    return element(14, head + b"".join(map(field, values)))


def test_one_structure_is_a_mapping_and_several_are_a_list():
    one = of(structure(1, 2, 3))["a"]
    assert {name: x.item() for name, x in one.items()} == {"gain": 2, "period": 3}
    two = of(structure(2, 2, 3, 4, 5, width=32))["a"]
    assert [{name: x.item() for name, x in row.items()} for row in two] == [
        {"gain": 2, "period": 3},
        {"gain": 4, "period": 5},
    ]
    assert of(structure(0))["a"] == []
    empty = start(2, 1, 1) + element(5, struct.pack("<i", 1)) + element(1, b"")
    assert of(element(14, empty))["a"] == []


def test_fields_with_names_of_one_letter_are_told_apart():
    head = start(2, 1, 1) + element(5, struct.pack("<i", 1)) + element(1, b"kv")
    found = of(element(14, head + field(2) + field(3)))["a"]
    assert {name: x.item() for name, x in found.items()} == {"k": 2, "v": 3}


NAMELESS = start(2, 1, 1) + element(5, struct.pack("<i", 0)) + element(1, b"")


@pytest.mark.parametrize(
    ("elements", "sentence"),
    [
        ([element(14, NAMELESS)], "a structure with nameless fields"),
        ([structure(1, 2)], "2 parts announced, 1 found"),
        ([element(14, start(6, 3) + element(9, bytes(24)))], r"impossible dimensions \(3,\)"),
        ([element(14, start(6, 3, -1) + element(9, bytes(24)))], r"impossible dimensions \(3, -1\)"),
        ([element(14, start(6, 1, 3) + element(9, bytes(16)))], "3 numbers announced, 2 found"),
        ([element(14, start(6, 1, 1) + element(8, bytes(8)))], "numbers of unknown type 8"),
        ([element(14, start(4, 1, 1) + element(9, bytes(8)))], "text of unknown type 9"),
        ([element(14, start(6, 1, 1)[:-16])], "a part of a variable is missing"),
        ([element(9, bytes(8))], "an element of type 9 where a variable should begin"),
        ([structure(1, 2, 3), b"\0\0\0\1"], "after variable 'a' .the last element has no complete tag"),
        ([structure(1, 2, 3), element(14, bytes(8))[:-1]], "an element of 8 bytes where 7 are left"),
        ([element(14, start(1, 1, 1) + element(9, bytes(8)))], "1 parts announced, 0 found"),
    ],
)
def test_what_contradicts_itself_is_said_in_numbers(elements, sentence):
    with pytest.raises(BadInput, match=f"cut short or damaged.*{sentence}"):
        of(*elements)


def test_zeros_behind_the_last_variable_are_no_variable():
    assert list(of(structure(1, 2, 3), bytes(4))) == ["a"]


def test_no_numbers_and_no_text_are_empty_not_missing():
    assert of(element(14, start(6, 0, 0) + element(9, b"")))["a"].shape == (0, 0)
    assert of(element(14, start(4, 0, 0) + element(16, b"")))["a"] == ""
    assert [x.shape for x in of(element(14, start(1, 1, 1) + element(14, b"")))["a"]] == [(0, 0)]


def test_what_matlab_keeps_under_no_name_is_left_out():
    assert of(element(14, start(6, 1, 1).replace(b"a", b"\0") + element(2, b"\1"))) == {}


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (matlab()[:126] + b"IM" + bytes(7), "damaged or older one"),
        (matlab()[:126] + b"IM" + bytes(8), "type 0 where a variable should begin"),
        (matlab()[:126] + b"MM" + bytes(8), "damaged or older one"),
        (b"MATLAB 7.3" + matlab()[10:] + bytes(8), "got version 7.3"),
        (b"MATLAC" + matlab()[6:] + bytes(8), "damaged or older one"),
    ],
)
def test_a_head_says_version_and_byte_order(data, sentence):
    with pytest.raises(BadInput, match=sentence):
        variables(source(data))


T = np.arange(12) * 0.5
X = np.cos(T)


@pytest.mark.parametrize(("name", "unit"), [("t", 1), ("time_ms", 1e-3), ("t_us", 1e-6)])
def test_a_time_vector_counts_in_the_unit_of_its_name(name, unit):
    found = record(**{name: T, "x": X, "n": 3.0})
    np.testing.assert_allclose(found.t, T * unit, rtol=1e-12)
    assert found.names == ("x",)
    assert "n = 3." in found.provenance.notes


def test_columns_of_a_matrix_are_counted_from_one_whichever_way_it_lies():
    """A square matrix and an array of three axes have no columns beside 12 times."""
    table = np.column_stack([X, 2 * X, 3 * X])
    found = record(t=T, tall=table, flat=table.T, short=X[:5], deep=np.zeros((12, 2, 2)))
    assert found.names == ("tall_1", "tall_2", "tall_3", "flat_1", "flat_2", "flat_3")
    for name in found.names:
        np.testing.assert_array_equal(found[name], int(name[-1]) * X)
    notes = found.provenance.notes
    assert "Variable 'short' (1x5) left out: time has 12 samples." in notes
    assert "Variable 'deep' (12x2x2) left out: time has 12 samples." in notes


@pytest.mark.parametrize("name", ["dt", "Ts", "t_s", "h", "period", "SampleTime"])
def test_without_a_time_vector_time_is_counted_in_steps_of_the_period(name):
    found = record(**{name: 0.25, "x": X, "short": X[:4]})
    np.testing.assert_allclose(found.t, 0.25 * np.arange(12))
    assert found.names == ("x",)
    assert f"No time vector; time was counted in steps of {name} = 0.25 s." in found.provenance.notes


@pytest.mark.parametrize("dt", [0.0, -0.1])
def test_a_period_that_is_none_makes_no_time(dt):
    assert "got only parameters: dt (1x1), x (1x12)" in refusal(dt=dt, x=X)


def test_a_time_that_no_variable_is_as_long_as_is_named_with_its_length():
    said = refusal(time=T, x=X[:5], y=X[:6])
    assert "no variable is as long as the time vector 'time' (12 samples)" in said
    assert "Variable 'x' (1x5) left out: time has 12 samples. Variable 'y' (1x6)" in said


def test_nine_parameters_are_named_up_to_the_eighth():
    said = refusal(**{f"p{i}": np.zeros((2, 3)) for i in range(5)}, q=cells(1.0, 2.0), r={"k": 1.0}, s="on", z=1.0)
    assert said.endswith(
        "expected a log with a time vector and signals of the same length, got only parameters: p0 (2x3), p1 (2x3),"
        " p2 (2x3), p3 (2x3), p4 (2x3), q (2 cells), r (structure), s (text); a log needs a vector called t or time."
    )


def test_of_an_object_it_is_said_how_to_save_it():
    opaque = element(14, element(6, struct.pack("<II", 17, 0)) + element(1, b"x"))
    with pytest.raises(BadInput, match=r"x \(object\).*of a timeseries x, in MATLAB: t = x.Time"):
        read_source(source(matlab(opaque)))
    with pytest.raises(BadInput, match=r"got only parameters: nothing; a log needs a vector called t or time\.$"):
        read_source(source(matlab(element(14, start(6, 1, 1).replace(b"a", b"\0") + element(2, b"\1")))))


def test_fields_of_structures_keep_their_own_names_where_these_are_free():
    found = record(x=X, a={"t": T, "x": 2 * X}, b={"x": 3 * X})
    assert found.names == ("x", "a_x", "b_x")
    np.testing.assert_array_equal(found["a_x"], 2 * X)
    np.testing.assert_array_equal(found["b_x"], 3 * X)


def stepped(n: int, uneven: float) -> np.ndarray:
    """Times of steps that are in turn longer and shorter by a share: their spread is that share of their mean."""
    return np.concatenate([[0], np.cumsum(1 + uneven * (-1) ** np.arange(n - 1))])


@pytest.mark.parametrize(
    ("n", "uneven", "read"), [(11, 0.0, True), (10, 0.0, True), (9, 0.0, False), (11, 0.19, True), (11, 0.21, False)]
)
def test_the_first_column_of_ten_or_more_even_steps_is_the_time(n, uneven, read):
    t = stepped(n, uneven)
    content = {"p": np.zeros((n, n // 2)), "data": np.column_stack([t, np.cos(t)])}
    if read:
        found = record(**content)
        np.testing.assert_array_equal(found.t, t)
        assert found.names == ("data_2",)
        np.testing.assert_array_equal(found["data_2"], np.cos(t))
        assert "Column 1 of 'data' increases evenly, so it is the time." in found.provenance.notes
    else:
        assert "needs a vector called t or time" in refusal(**content)


def test_a_vector_that_increases_is_no_table():
    assert "needs a vector called t or time" in refusal(ramp=T)


def simulink(t: np.ndarray, *signals: dict[str, Any]) -> dict[str, Any]:
    several = np.empty((1, len(signals)), dtype=object)
    several[0, :] = signals
    if len(signals) == 1:
        return {"time": t[:, None], "signals": signals[0]}
    names = sorted(set().union(*signals))
    out = np.zeros((1, len(signals)), dtype=[(name, object) for name in names])
    for j, signal in enumerate(signals):
        for name in names:
            out[name][0, j] = signal[name]
    return {"time": t[:, None], "signals": out}


def test_signals_of_a_structure_are_called_by_label_or_by_number():
    t = T[:, None]
    scope = simulink(
        T,
        {"values": np.cos(t), "label": "arm"},
        {"values": np.hstack([np.sin(t), 2 * np.sin(t)]), "label": ""},
        {"values": np.zeros((3, 1)), "label": "else"},
    )
    wide = simulink(T, {"values": np.hstack([3 * t, 4 * t]), "label": "x"})
    deep = simulink(T, {"values": (5 * T).reshape(1, 1, -1), "label": ""})
    found = record(scope=scope, wide=wide, deep=deep)
    assert found.names == ("scope/arm", "scope/2_1", "scope/2_2", "wide_1", "wide_2", "deep")
    expected = [np.cos(T), np.sin(T), 2 * np.sin(T), 3 * T, 4 * T, 5 * T]
    for name, x in zip(found.names, expected, strict=True):
        np.testing.assert_array_equal(found[name], x)


def test_of_structures_with_different_times_the_longest_counts():
    short = simulink(T[:7], {"values": X[:7, None], "label": ""})
    one = simulink(T[:1], {"values": X[:1, None], "label": ""})
    late = simulink(T + 1, {"values": X[:, None], "label": ""})
    long = simulink(T, {"values": X[:, None], "label": ""})
    found = record(short=short, long=long, late=late, one=one)
    assert found.names == ("long",)
    np.testing.assert_array_equal(found.t, T)
    assert found.provenance.notes == (
        "Structure 'short' left out: its time differs (7 samples).",
        "Structure 'late' left out: its time differs (12 samples).",
    )


def test_pieces_keep_the_order_of_their_times_and_say_which_they_were():
    found = record(
        t_a=cells(T[6:, None], T[:3, None]),
        y_a=cells(np.stack([X[6:], 2 * X[6:]]), np.stack([X[:3], 2 * X[:3]], axis=1)),
        t_b=cells(T[3:6, None]),
        y_b=cells(np.stack([X[3:6], 2 * X[3:6]], axis=1)),
        other_a=cells("no", "piece"),
    )
    np.testing.assert_array_equal(found.t, T)
    assert found.names == ("y_1", "y_2")
    np.testing.assert_array_equal(found["y_1"], X)
    np.testing.assert_array_equal(found["y_2"], 2 * X)
    assert found.provenance.notes == (
        "Pieces joined in the order of time: y_a{2}, y_b{1}, y_a{1}; rows became columns y_1, y_2.",
    )


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ({"t": cells(T[:, None]), "y": cells(X[:5, None])}, "piece 1 of 'y' as long as its time, got 5x1 and 12x1"),
        (
            {"t": cells(T[:, None], "x"), "y": cells(X[:, None], X[:, None])},
            "piece 2 of 'y' as long as its time, got 12x1 and text",
        ),
        ({"t": cells(np.ones((1, 1))), "y": cells(np.ones((1, 1)))}, "as long as its time, got 1x1 and 1x1"),
        (
            {"t": cells(T[:3, None], T[3:, None]), "y": cells(X[:3, None], np.stack([X[3:], X[3:]], axis=1))},
            "pieces with the same number of signals in the cells 'y'",
        ),
    ],
)
def test_pieces_that_do_not_fit_together_are_refused(content, sentence):
    assert sentence in refusal(**content)


def test_cells_of_another_number_are_no_pieces():
    assert "got only parameters" in refusal(t=cells(T[:, None]), y=cells(X[:, None], X[:, None]))


def test_a_time_that_falls_back_is_named_by_its_sample():
    t = T.copy()
    t[4] = t[2]
    said = refusal(t=t, x=X)
    assert "sample 5: time must increase from sample to sample, got 1 s after 1.5 s" in said


def test_notes_tell_settings_scalars_and_what_was_left_out():
    found = record(
        t=T, x=X, k=0.125, who="A" * 90, z=np.array([1j, 2]), s={"gain": 2.0, "name": "fast", "table": np.zeros((2, 2))}
    )
    notes = found.provenance.notes
    assert "k = 0.125." in notes
    assert f"who = '{'A' * 80}'." in notes
    assert "Variable 'z' left out: complex numbers." in notes
    assert "s: gain = 2, name = 'fast'." in notes
    assert not any("table" in note for note in notes)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"signals": np.zeros((4, 2))}, r"expected 3 samples of 2 signals, got 4x2"),
        ({"signals": np.zeros((3, 1))}, r"expected 3 samples of 2 signals, got 3x1"),
        ({"signals": "none"}, "got variables of other kinds"),
        ({"t": "none"}, "got variables of other kinds"),
        ({"names": "none"}, "got variables of other kinds"),
        ({"upright": 1.0}, "got variables of other kinds"),
    ],
)
def test_a_record_of_ours_that_was_changed_by_hand_is_refused(changed, sentence):
    content = {"t": T[:3], "signals": np.stack([X[:3], T[:3]], axis=1), "names": cells("x", "y"), "upright": ""}
    back = record(**content)
    assert back.names == ("x", "y")
    np.testing.assert_array_equal(back["y"], T[:3])
    assert sentence in refusal(**content | changed)


def test_a_record_of_ours_without_its_signals_is_a_log_like_any_other():
    found = record(t=T, x=X, upright="{}")
    assert found.provenance.reader == "matlab"
    assert found.names == ("x",)


def captured(*signals: tuple[str, np.ndarray, str], axes: tuple[np.ndarray, ...], on: tuple[int, ...]) -> dict:
    """What dSPACE's ControlDesk saves: a structure of X, the times, and Y, the signals."""
    X = np.zeros((1, len(axes)), dtype=[("Name", "O"), ("Data", "O")])
    for k, t in enumerate(axes):
        X[0, k] = ("", t.reshape(1, -1))
    Y = np.zeros((1, len(signals)), dtype=[("Name", "O"), ("Data", "O"), ("Unit", "O"), ("XIndex", "O")])
    for k, (name, y, unit) in enumerate(signals):
        Y[0, k] = (name, y.reshape(1, -1), unit, on[k])
    return {"rec_001": {"X": X, "Y": Y, "Description": "", "RTProgram": "rig"}}


def test_a_capture_of_dspace_has_its_signals_on_its_longest_time():
    t = 0.001 * np.arange(50)
    y, u, slow = np.cos(t), np.sin(t), np.ones(25)
    read = record(**captured(
        ("Model Root/Enc1/theta", y, "rad"), ("Model Root/Enc2/theta", 2 * y, ""),
        ('"Model Root"\n"Motor"\n"u"', u, "V"), ("Model Root/T", slow, ""), axes=(t, t[::2]), on=(1, 1, 1, 2),
    ))  # fmt: skip
    assert dict(read.units) == {"Enc1/theta (rad)": "rad", "Enc2/theta": "", "u (V)": "V"}
    np.testing.assert_allclose(read.t, t, atol=1e-12)
    for name, values in {"Enc1/theta (rad)": y, "Enc2/theta": 2 * y, "u (V)": u}.items():
        np.testing.assert_array_equal(read[name], values)
    assert "Signal 'T' left out: its time differs." in read.provenance.notes
