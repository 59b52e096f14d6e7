"""Does a sentence name what its reader can type: arguments in Python, options at the command line?"""

from __future__ import annotations

import inspect
import pickle
import re

import numpy as np
import pytest

import upright as up
from upright.errors import BadInput
from upright.verbs.command import Command
from upright.verbs.in_python import worded

A, B = np.array([[0.0, 1.0], [4.0, 0.0]]), np.array([[0.0], [1.0]])


def test_python_is_told_arguments_and_the_command_line_options():
    from upright.verbs.control.design import design

    with pytest.raises(BadInput, match='period="2 ms"') as told:
        up.design((A, B), poles=[-4, -5])
    assert "--" not in str(told.value)
    with pytest.raises(BadInput, match='--period "2 ms"'):
        design((A, B), poles=[-4, -5])


def test_an_option_called_otherwise_than_its_argument_is_told_by_the_argument():
    with pytest.raises(BadInput, match="which is 1 to 4, or all, got 'nine'"):
        up.regulate(up.Furuta(m_p=0.1, l_cg=0.2, r=0.2, J_d=0.01, J_p=1e-4), which="nine", limit=5, period=1e-3)


@pytest.mark.parametrize(
    ("sentence", "python"),
    [
        ("give one with --effort-weight 2, please.", "give one with effort_weight=2, please."),
        ("choose another place with -o.", "choose another place with out."),
        ("print it with `upright log show -o x`.", "print it with `upright log show -o x`."),
        ("type upright lab --quick, or leave --quick out.", "type upright lab --quick, or leave quick out."),
        ("poles such as -4+-2j, -1--2 and x-y stay", "poles such as -4+-2j, -1--2 and x-y stay"),
        ("run it without: --no-check.", "run it without: check=False."),
        ("it hung upright here", "it hung upright here"),
        ("replace it with --force", "replace it with --force"),
    ],
)  # fmt: skip
def test_an_option_becomes_an_argument_and_what_is_none_stays(sentence, python):
    command = Command(verb=up.design, flags={"force": None})
    assert worded(sentence, command) == python


def test_a_verb_keeps_its_signature_and_can_be_sent_to_another_process():
    from upright.verbs.model.identify import identify

    assert inspect.signature(up.identify) == inspect.signature(identify)
    assert up.identify.__doc__ == identify.__doc__
    assert pickle.loads(pickle.dumps(up.identify)) is up.identify


VERBS = sorted(
    name for name in up.__all__ if inspect.isfunction(getattr(up, name)) and name not in ("quantity", "chain")
)


@pytest.mark.parametrize("name", VERBS)
def test_a_signature_says_what_a_verb_takes_and_has_ten_parameters_at_most(name):
    """What more there is stands in one options object; progress and its kin are callables, said as such."""
    parameters = inspect.signature(getattr(up, name)).parameters.values()
    assert len(parameters) <= 10 + any(p.kind is p.VAR_KEYWORD for p in parameters)
    for p in parameters:
        annotation = str(p.annotation)
        assert not re.fullmatch(r"(str \| )?(typing\.)?Any( \| None)?|Sequence\[Any\]|object", annotation), p.name


WRONG = [object(), -3j, b"x", {3: 4}, [[1, "a"]], np.zeros((2, 3)), up.Furuta]
"""No path, text, number or truth value."""


@pytest.mark.parametrize(
    ("name", "argument"),
    [
        (name, p.name)
        for name in VERBS
        for p in inspect.signature(getattr(up, name)).parameters.values()
        if str(p.annotation).removesuffix(" | None") in ("PathLike", "str", "int", "float", "bool")
    ],
)
def test_an_argument_of_another_kind_than_its_signature_states_is_named(name, argument):
    for wrong in WRONG:
        with pytest.raises(BadInput, match=f"^{argument} (takes|is) "):
            getattr(up, name)(**{argument: wrong})


@pytest.mark.parametrize("wrong", WRONG)
def test_a_chain_is_of_a_whole_number_of_bodies_and_of_a_kind_with_a_name(wrong):
    with pytest.raises(BadInput, match="1 to 9 bodies"):
        up.chain(wrong)
    with pytest.raises(BadInput, match="'rectilinear' or 'torsional'"):
        up.chain(2, wrong)


def test_what_numpy_counts_and_asks_counts_too(tmp_path):
    with pytest.raises(BadInput, match="There is no file"):
        up.init(tmp_path / "none.csv", force=np.bool_(False))
    model = up.StateSpace(A, B, np.eye(2))
    assert up.hold(model, np.float32(0.5), delay=np.float64(0.0)).dt == 0.5
    assert up.chain(np.int64(2)) is up.chain(2)


@pytest.mark.parametrize("verb", ["from_matlab", "from_mjcf", "read", "identify", "log_show"])
def test_a_file_that_is_missing_is_named_in_a_sentence(tmp_path, verb):
    with pytest.raises(BadInput, match=r"There is no (file|study) '.*nowhere\.x'"):
        getattr(up, verb)(tmp_path / "nowhere.x")
