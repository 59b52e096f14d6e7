"""What is known before a user's function is compiled, and which type holds both where two of its branches meet?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.simulation.lowering.operands import (
    BOOL,
    FLOAT,
    FLOATS,
    INT,
    INTS,
    ArrayOf,
    TupleOf,
    Type,
    Unsupported,
    has_lanes,
    known_real,
    llvm,
    real,
    truth,
    whole,
    wider,
)


@pytest.mark.parametrize(
    ("a", "b", "both"),
    [
        (INT, INT, INT),
        (INT, FLOAT, FLOAT),
        (BOOL, INT, INT),
        (FLOAT, INTS, FLOATS),  # of each lane, as soon as one is
        (TupleOf((INT, BOOL)), TupleOf((FLOAT, BOOL)), TupleOf((FLOAT, BOOL))),
        (ArrayOf(2), ArrayOf(2), ArrayOf(2)),  # the same array on both sides
        (TupleOf((ArrayOf(1), INT)), TupleOf((ArrayOf(1), FLOAT)), TupleOf((ArrayOf(1), FLOAT))),
    ],
)
def test_the_type_that_holds_both_is_that_of_the_wider_number_on_either_side(a: Type, b: Type, both: Type) -> None:
    assert wider(a, b) == both
    assert wider(b, a) == both


@pytest.mark.parametrize("other", [ArrayOf(1), TupleOf((INT,)), TupleOf((INT, INT, INT)), FLOAT])
def test_nothing_holds_a_pair_and_what_is_no_pair(other: Type) -> None:
    with pytest.raises(Unsupported, match="'x' is a tuple of one length in one place and something else in another"):
        wider(TupleOf((INT, INT)), other, "'x'")


@pytest.mark.parametrize("x", [0, -1, 2**63 - 1, -(2**63)])
def test_a_whole_number_of_64_bits_is_known_as_it_is(x: int) -> None:
    """From -2^63 to 2^63 - 1, as two's complement has them."""
    assert np.int64(x) == x
    assert (whole(x).type, whole(x).text, whole(x).const) == (INT, str(x), x)


@pytest.mark.parametrize("x", [2**63, -(2**63) - 1, 10**30])
def test_a_larger_one_is_refused(x: int) -> None:
    with pytest.raises(OverflowError):
        np.int64(x)
    with pytest.raises(Unsupported, match=f"{x} is no whole number of 64 bits"):
        whole(x)


@pytest.mark.parametrize("x", [0.1, -0.0, 1e308, 5e-324, math.pi, -math.inf])
def test_a_float_is_known_to_its_last_bit(x: float) -> None:
    """LLVM reads the sixteen digits of IEEE 754's double, as numpy has them."""
    assert real(x).text == f"0x{np.float64(x).view(np.uint64):016X}"
    assert math.copysign(1.0, known_real(real(x))) == math.copysign(1.0, x)
    assert known_real(real(x)) == x


def test_truth_is_a_bit_that_is_known() -> None:
    assert [(v.type, v.text, v.const) for v in (truth(False), truth(True))] == [(BOOL, "false", 0), (BOOL, "true", 1)]


def test_a_tuple_has_lanes_where_one_of_its_items_has() -> None:
    assert [has_lanes(t) for t in (INT, FLOAT, FLOATS, INTS, ArrayOf(1))] == [False, False, True, True, False]
    assert not has_lanes(TupleOf((INT, TupleOf((FLOAT, ArrayOf(1))))))
    assert has_lanes(TupleOf((INT, TupleOf((FLOAT, INTS)))))
    assert llvm(TupleOf((FLOAT, TupleOf((FLOATS, ArrayOf(2))))), 8) == "{double, {<8 x double>, ptr}}"


def test_whole_numbers_are_those_of_64_bits():
    for x in (-(2**63), -1, 0, 2**63 - 1):
        assert (whole(x).text, whole(x).const) == (str(x), x)
    for x in (-(2**63) - 1, 2**63):
        with pytest.raises(Unsupported, match="64 bits"):
            whole(x)
