"""Does whatever a client sends become a message of the table or one sentence?"""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upright.browser.messages import TABLE, read
from upright.errors import BadInput

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)
NAMES = st.sampled_from(sorted({name for fields in TABLE.values() for name in fields} | {"do", "K"}))


ASKED = st.tuples(st.sampled_from([*TABLE, "x"]), st.dictionaries(NAMES, JSON, max_size=3)).map(
    lambda pair: json.dumps(pair[1] | {"do": pair[0]})
)


@settings(max_examples=150, deadline=None)
@given(st.one_of(st.text(max_size=60), JSON.map(json.dumps), ASKED))
def test_anything_is_a_message_of_finite_numbers_or_a_sentence(text):
    message, sentence = None, ""
    try:
        message = read(text)
    except BadInput as error:
        sentence = str(error)
    assert (message is None) == (0 < len(sentence) < 200)
    fields = {} if message is None else message.fields
    assert message is None or fields.keys() <= TABLE[message.do].keys()
    for value in fields.values():
        for x in value if isinstance(value, list) else [value]:
            assert isinstance(x, str | bool) or math.isfinite(abs(x))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "JSON"), ("[" * 4000, "JSON"), ('{"do": "stop"', "JSON"), ("[]", "what to do"),
        ('{"do": 3}', "what to do"), ('{"do": "stopp"}', "did you mean 'stop'"),
        ('{"do": "stop", "now": 1}', "no field 'now'"),
        ('{"do": "tap", "coordinate": "psi"}', "needs speed"), (f'{{"do": "stop", "x": "{"a" * 5000}"}}', "4096 bytes"),
        ('{"do": "tap", "coordinate": "psi", "speed": NaN}', "JSON"),
        ('{"do": "tap", "coordinate": "psi", "speed": 1e999}', "speed of 'tap' is a number"),
        ('{"do": "tap", "coordinate": "psi", "speed": true}', "is a number"),
        (f'{{"do": "reference", "value": 1{"0" * 400}}}', "value of 'reference'"),
        ('{"do": "poles", "poles": [[1, 2, 3]]}', "pairs"), ('{"do": "poles", "poles": [1]}', "a list"),
        ('{"do": "start", "from": "above"}', "from of 'start' is one of held, hanging, motions, sweep, step"),
        ('{"do": "start", "from": ["held"]}', "one of held, hanging, motions, sweep, step"),
        ('{"do": "start", "start": [' + "0," * 16 + "0]}", "at most 16"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(text, sentence):
    with pytest.raises(BadInput, match=sentence):
        read(text)


def test_poles_are_complex_numbers():
    assert read('{"do": "poles", "poles": [[-4, 1.5], [-4, -1.5]]}').fields["poles"] == [-4 + 1.5j, -4 - 1.5j]
