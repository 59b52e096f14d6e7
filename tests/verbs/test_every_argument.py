"""Does every argument of every verb meet wrong types, shapes and units with an answer or one sentence?"""

from __future__ import annotations

import inspect
import math
from contextlib import suppress
from zlib import crc32

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import upright as up
from tests.logs.runs import written
from upright.verbs.options import shared_parameters

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-3, b_2=2e-4)
RIG = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096, travel="200 deg")
MODEL = ARM.linear("inverted")
SAMPLED = up.hold(MODEL, "2 ms")
POLES = [-4 + 2j, -4 - 2j, -17, -3]
GAINS = up.place(MODEL, POLES)
SWING = up.simulate(up.Pendulum(m_p=0.2, l_cg=0.2, b_2=2e-3), start={"theta": 0.3}, seconds=1)
LOOP = up.simulate(RIG, GAINS, at="inverted", start={"theta": 0.02}, seconds=0.5)
KNOWN = {"m_p": 0.2, "J_p": 0.0}

CALLS = {
    "bench": {"rigs": "RIG.toml", "port": -1, "out": "bench", "browser": False},
    "chain": {"bodies": 2},
    "chance": {"fit": RIG, "gains": GAINS, "draws": 2, "seconds": 0.1},
    "compare": {"fits": "fit.json", "log": SWING},
    "design": {"source": RIG, "poles": "-4+-2j, -17, -3"},
    "dlqr": {"model": SAMPLED, "Q": [1, 0, 1, 0], "R": 1.0},
    "doctor": {"log": SWING},
    "export": {"source": RIG, "to": "mjcf"},
    "firmware_build": {},
    "firmware_pins": {},
    "frequency": {"sources": "log.csv", "command": "T"},
    "from_matlab": {"file": "loop.mat"},
    "from_mjcf": {"file": "rig.xml"},
    "hold": {"model": MODEL, "period": "2 ms"},
    "identify": {"study": SWING, "plant": up.Pendulum, "known": KNOWN, "report": False},
    "init": {"log": SWING},
    "lab": {"experiment": "none"},
    "ladder": {"study": SWING, "plant": up.Pendulum, "known": KNOWN, "window": (0.0, 1e-6)},
    "law": {"log": LOOP, "command": "T", "measured": "theta"},
    "loadings": {"logs": [SWING], "added": "0 kg"},
    "log_convert": {"log": "run.mcap"},
    "log_recover": {"log": "run.mcap"},
    "log_replay": {"log": "run.mcap"},
    "log_show": {"log": "run.mcap"},
    "lqr": {"model": MODEL, "Q": [1, 0, 10, 0], "R": 1.0},
    "margins": {"model": MODEL, "K": GAINS},
    "observer": {"model": SAMPLED, "poles": [0.1, 0.11, 0.12, 0.13]},
    "place": {"model": MODEL, "poles": POLES},
    "plan_inertias": {"runs": 4},
    "play": {"fit": RIG, "draws": 2, "seconds": 0.1},
    "predict": {"model": "fit.json", "study": SWING},
    "prefilter": {"model": MODEL, "K": GAINS},
    "quantity": {"unit": "kg", "meaning": "a mass"},
    "read": {"file": SWING},
    "regulate": {"source": RIG, "which": 1, "draws": 2, "seconds": 0.1},
    "reproduce": {},
    "rig_check": {"rate": 0.0},
    "rig_doctor": {"rig": "RIG.toml"},
    "run": {"rig": "RIG.toml", "excite": "free", "out": "run"},
    "show": {"log": SWING},
    "simulate": {"plant": RIG, "seconds": 0.1},
    "survey": {"file": "means.csv", "n": 20},
    "swing_up": {"source": RIG, "seconds": 0.1},
    "track": {"rig": "torsional", "sets": "9"},
}
"""A call of each verb that answers, or ends in a sentence after it has looked at its arguments."""
FILES = {
    "means.csv": b"concept,pre,post\nfeedback,2.1,3.2\npoles,1.9,3.0\n",
    "run.mcap": written(400),
    "fit.json": b"{}",
    "RIG.toml": b'kind = "twin"\n',
}

WRONG = {
    "none": None, "truth": True, "below zero": -1, "zero": 0, "half": 0.5, "no number": math.nan, "no end": math.inf,
    "huge": 1e300, "complex": -3j, "no text": "", "a word": "nonsense", "a mass": "5 kg", "no unit": "5 parsnip",
    "pairs": "x=1, theta=nonsense", "bytes": b"x", "object": object(), "callable": lambda: 0, "nothing": [],
    "numbers": (1, 2, 3), "ragged": [[1, "a"]], "words": ["a", "b"], "no array": np.zeros(0), "wide": np.zeros((2, 3)),
    "no numbers": np.full(4, math.nan), "nothing by name": {}, "a mass by name": {"theta": "5 kg"},
    "strange name": {"no such": 1.0}, "by number": {3: 4}, "class": up.Furuta, "plant": ARM, "model": MODEL,
    "record": SWING,
}  # fmt: skip
"""Wrong in type, in shape, in unit or in size for most arguments; where one is right, the verb answers."""


def arguments(name):
    """Every argument of a verb, those of its options object too; what calls back is a callable by its annotation."""
    verb = inspect.unwrap(getattr(up, name))
    out = {}
    for p in inspect.signature(verb).parameters.values():
        out |= shared_parameters(p, verb.__module__)[0] if p.kind is p.VAR_KEYWORD else {p.name: p}
    return [n for n, p in out.items() if "Callable" not in str(p.annotation) and str(p.annotation) != "Progress"]


LONG = {"chance", "identify", "law", "play", "regulate", "reproduce"}
"""Verbs whose answer takes seconds; what of them is refused is refused in `test_handovers`, too."""
ARGUMENTS = [(name, argument) for name in CALLS for argument in arguments(name)]


def meets(name, argument, wrong):
    """The call answers or says a sentence; a file that is not there is Python's own sentence."""
    with suppress(up.UprightError, FileNotFoundError):
        result = getattr(up, name)(**{**CALLS[name], argument: WRONG[wrong]})
        next(result, None) if inspect.isgenerator(result) else None


@pytest.fixture
def beside(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)


def test_every_verb_is_called_here_but_those_that_need_a_board():
    verbs = {name for name in up.__all__ if inspect.isfunction(getattr(up, name))}
    assert verbs - CALLS.keys() == {"firmware_flash", "log_tail"}


@pytest.mark.parametrize("name", sorted({name for name, _ in ARGUMENTS} - LONG))
def test_a_few_wrong_values_of_every_argument_get_an_answer_or_a_sentence(name, beside):
    """Others for each argument, chosen by its name."""
    for argument in arguments(name):
        for k in range(2):
            meets(name, argument, sorted(WRONG)[crc32(f"{name} {argument} {k}".encode()) % len(WRONG)])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "argument"),
    [  # of the names of experiments some are those of experiments, which run
        pytest.param(*each, marks=pytest.mark.thorough) if each == ("lab", "experiment") else each for each in ARGUMENTS
    ],
)
def test_every_wrong_value_of_every_argument_gets_an_answer_or_a_sentence(name, argument, beside):
    for wrong in WRONG:
        meets(name, argument, wrong)


LEAVES = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 3), st.sampled_from([-1.5, 0.25, 1e300, math.nan, math.inf]),
    st.complex_numbers(max_magnitude=5, allow_nan=False), st.binary(max_size=4), st.text("abx_=,;+-±° 12", max_size=10),
    st.builds("{:g} {}".format, st.integers(-3, 3), st.sampled_from(["kg", "deg", "V", "ms", "N m/V", "rad/s", "cm"])),
    st.sampled_from([MODEL, SAMPLED, ARM, RIG, SWING, up.Furuta, GAINS, abs]),
)  # fmt: skip
SMALL = st.integers(0, 3)
ANYTHING = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.tuples(inner, inner),
        st.dictionaries(st.text("abxm_p", max_size=4), inner, max_size=3),
        arrays(np.float64, st.tuples(SMALL, SMALL), elements=st.sampled_from([-1.0, 0.0, 2.0, math.nan])),
    ),
    max_leaves=6,
)  # fmt: skip
"""Any type, shape and unit, small enough that what is right for an argument is answered soon."""


@pytest.mark.slow
@settings(max_examples=400, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
@given(of=st.sampled_from([pair for pair in ARGUMENTS if pair[0] not in LONG]), value=ANYTHING)
def test_whatever_hypothesis_finds_for_an_argument_gets_an_answer_or_a_sentence(beside, of, value):
    with suppress(up.UprightError, FileNotFoundError):
        result = getattr(up, of[0])(**{**CALLS[of[0]], of[1]: value})
        next(result, None) if inspect.isgenerator(result) else None


SENTENCES = [
    ("design", "memory", (1, 2), r"memory takes a number or None, got \(1, 2\)"),
    ("design", "sampled", "yes", "sampled takes True or False or None, got 'yes'"),
    ("regulate", "counts", object(), "counts takes a number, a text, several numbers, values by name or None, got "),
    ("ladder", "window", (1.0, 2.0, 3.0), "window takes two numbers or None, got "),
    ("identify", "columns", "theta", "columns takes values by name or None, got 'theta'"),
    ("law", "measured", np.zeros(2), "measured takes several texts, a text or None, got "),
    ("survey", "scale", None, "scale takes a text or two numbers, got None"),
]


@pytest.mark.parametrize(("name", "argument", "wrong", "sentence"), SENTENCES)
def test_what_an_argument_takes_is_said_in_the_words_of_its_annotation(name, argument, wrong, sentence):
    with pytest.raises(up.BadInput, match=sentence):
        getattr(up, name)(**{**CALLS[name], argument: wrong})


def test_what_numpy_and_pandas_hold_is_taken_as_what_it_is():
    import pandas as pd

    one = up.design(RIG, poles=POLES, memory=0.5, counts=[4096, 8192])
    other = up.design(RIG, poles=pd.Series(POLES), memory=np.float32(0.5), counts=np.array([4096, 8192]))
    np.testing.assert_array_equal(one.K, other.K)
    np.testing.assert_array_equal(one.law.resolution, other.law.resolution)
