"""Which type holds both of two, where two branches of a user's function meet?"""

from __future__ import annotations

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
