"""Is a wrong study answered with the line, what was expected and the nearest valid name, in one sentence?"""

import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.study.good_study import GOOD
from upright.errors import BadInput
from upright.study.keys import names
from upright.study.load import load_study


def complaint(folder, text, **kwargs):
    (folder / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadInput) as error:
        load_study(folder / "study.toml", **kwargs)
    return str(error.value)


def test_the_good_study_is_good(folder):
    (folder / "study.toml").write_text(GOOD, encoding="utf-8")
    assert len(load_study(folder / "study.toml").runs) == 2


WRONG = [
    # what is written, what is written instead, line, what the answer must contain
    ("substeps = 2", "substep = 2", 3, "did you mean 'substeps'?"),
    ("substeps = 2", "substeps = 0", 3, "a whole number from 1 to 100, got 0"),
    ("substeps = 2", "substeps = true", 3, "got true"),
    ('"cart-pendulum"', '"cart-pendulm"', 2, "did you mean 'cart-pendulum'?"),
    ('"cart-pendulum"', "7", 2, 'such as plant = "cart-pendulum", got 7'),
    ('"cart-pendulum"', '"absent.py:Rig"', 2, "absent.py does not exist"),
    ('"cart-pendulum"', '"bad_plant.py:Rig"', 2, "nothing_of_this_name"),
    ("[rig]", "[rigg]", 1, "did you mean 'rig'?"),
    ('m_c = "0.5 kg"\n', "", 4, "CartPendulum needs m_c (mass of the cart, in kg)"),
    ('m_c = "0.5 kg"', 'm_cc = "0.5 kg"', 5, "did you mean 'm_c'?"),
    ('m_c = "0.5 kg"', 'm_c = "0.5 m"', 5, "a length"),
    ('m_c = "0.5 kg"', 'm_c = "0.5 kgg"', 5, "did you mean 'kg'?"),
    ('m_c = "0.5 kg"', 'm_c = "half a kg"', 5, "write the number first"),
    ('m_c = "0.5 kg"', 'm_c = "0.5"', 5, "without a unit"),
    ('m_c = "0.5 kg"', 'm_c = "-0.5 kg"', 5, "must be > 0 kg, got -0.5"),
    ('m_c = "0.5 kg"', "m_c = nan", 5, "must be > 0 kg"),
    ('m_c = "0.5 kg"', "m_c = inf", 5, "must be > 0 kg"),
    ('m_c = "0.5 kg"', "m_c = [1]", 5, "must be a number or text"),
    ('m_c = "0.5 kg"', "m_c = {}", 5, "either value (known) or guess (to estimate)"),
    ('uncertainty = "1 g"', 'uncertaincy = "1 g"', 6, "did you mean 'uncertainty'?"),
    ('uncertainty = "1 g"', 'uncertainty = "1 mm"', 6, "a length"),
    ('uncertainty = "1 g"', 'uncertainty = "-1 %"', 6, "zero or more"),
    ('uncertainty = "1 g"', 'uncertainty = "some %"', 6, 'like "2 mm" or "1 %"'),
    ('uncertainty = "1 g"', 'max = "1 kg"', 6, "write guess instead of value"),
    ('uncertainty = "1 g"', 'guess = "1 kg"', 6, "either value (known) or guess"),
    ("min = 0 }", 'uncertainty = "1 g mm^2" }', 8, "write value instead of guess"),
    ("min = 0 }", 'min = "1 kg m^2" }', 8, "outside its bounds 1 to inf"),
    ("min = 0 }", 'min = "1 mm" }', 8, "a length"),
    ('gain = { guess = "5 N/V" }', 'gains = { guess = "5 N/V" }', 10, "did you mean 'gain'?"),
    ('gain = { guess = "5 N/V" }', 'gain = { guess = "5 N m/V" }', 10, "N/V"),
    ('gain = { guess = "5 N/V" }', 'lag = "-2 ms"', 10, "must be >= 0 s, got -0.002"),
    ('gain = { guess = "5 N/V" }', 'offset = "2 N"', 10, "a force"),
    ("[sensors.theta]", "[sensors.thetta]", 11, "did you mean 'theta'?"),
    ("[sensors.theta]", "[sensor.theta]", 11, "did you mean 'sensors'?"),
    ('column = "theta"', 'column = "thetta"', 12, "did you mean 'theta'?"),
    ('column = "theta"', "column = 3", 12, "got 3"),
    ('unit = "counts"', 'unit = "count5"', 13, "did you mean"),
    ('unit = "counts"\ncounts_per_rev = 14400', 'unit = "counts"', 12, "theta needs counts_per_rev"),
    ('unit = "counts"\ncounts_per_rev = 14400', 'unit = "V"', 12, 'or give scale = "... rad/V"'),
    ("counts_per_rev = 14400", "counts_per_turn = 14400", 14, "did you mean 'counts_per_rev'?"),
    ("counts_per_rev = 14400", "counts_per_rev = 0", 14, "above zero, got 0"),
    ("counts_per_rev = 14400", "counts_per_m = 14400", 14, "theta is in rad, so give counts_per_rev"),
    ("sign = -1", "sign = -2", 15, "must be 1 or -1, got -2"),
    ("sign = -1", "scale = 0", 15, "must not be zero"),
    ("sign = -1", 'offset = "1 kgg"', 15, "did you mean"),
    ("sign = -1", 'resolution = "1 mm"', 15, "a length"),
    ('column = "z"', 'column = "zz"', 17, "did you mean 'z'?"),
    ('column = "v"\n', "", 19, 'a drive needs column = "v"'),
    ('column = "v"', 'colum = "v"', 19, "did you mean 'column'?"),
    ('column = "v"', 'column = "w"', 19, "the column 'w'"),
    ('column = "v"', 'expression = "2*(0.2 - q)"', 19, "the column 'q'"),
    ('column = "v"', 'column = "v"\nexpression = "2*v"', 20, "got both"),
    ('label = "a"', 'lable = "a"', 22, "did you mean 'label'?"),
    ('label = "a"', "label = 3", 22, "got 3"),
    ('label = "b"', 'label = "a"', 27, "taken by the run on line"),
    ('label = "a"\nfile = "log.csv"', 'label = "a"\nfile = "lgo.csv"', 23, "did you mean 'log.csv'?"),
    ('label = "a"\nfile = "log.csv"', 'label = "a"\nfile = "far/away"', 23, "--data DIR names another folder"),
    ('label = "a"\nfile = "log.csv"', f'label = "a"\nfile = "{"far/" + 400 * "x"}"', 23, "does not exist"),
    ('label = "a"\nfile = "log.csv"', 'label = "a"', 21, "needs file as text"),
    ('label = "a"\nfile = "log.csv"', 'label = "a"\nfile = "bad_plant.py"', 23, "bad_plant.py"),
    ('label = "a"\nfile = "log.csv"', 'label = "a"\nfile = "silent.csv"', 24, "silent from t = 3.99 to 6.01 s"),
    ("window = [1.0, 9.0]", "window = [9.0, 1.0]", 24, "must start before it ends, got 9 to 1 s"),
    ("window = [1.0, 9.0]", "window = [1.0, 90.0]", 24, 'write window = [1, "end"]'),
    ("window = [1.0, 9.0]", "window = 9.0", 24, "two times in s"),
    ("window = [1.0, 9.0]", 'window = ["begin", 9.0]', 24, "write the number first"),
    ("window = [1.0, 9.0]", 'window = ["1 m", 9.0]', 24, "a length"),
    ("window = [1.0, 9.0]", "window = [1.0, 1.05]", 24, "at least 8 are needed"),
    ('role = "fit"', 'role = "fitt"', 25, "did you mean 'fit'?"),
    ('role = "fit"', 'refit = "yes"', 25, "refit must be true or false"),
    ('role = "fit"', 'unknown = ["inital"]', 25, "did you mean 'initial'?"),
    ('role = "fit"', "unknown = 3", 25, "must be a list of names"),
    ('role = "fit"', 'shared = { fricton = "Monday" }', 25, "did you mean 'friction'?"),
    ('role = "fit"', 'shared = { initial = "Monday" }', 25, "shared has no 'initial'"),
    ('role = "fit"', 'shared = { scale.psi = "Monday" }', 25, "shared has no 'scale.psi'"),
    ('role = "fit"', "shared = { friction = 3 }", 25, 'such as friction = "28 Jan", got 3'),
    ('role = "fit"', "spread = { friction = 0 }", 25, "above zero, got 0"),
    ('role = "fit"', "spread = { input_offset = 1 }", 25, "spread has no 'input_offset'"),
    ('role = "fit"', 'held = ["psi"]', 25, "valid names: theta, x"),
    ('role = "fit"', 'known = { m_q = "1 kg" }', 25, "did you mean 'm_p'?"),
    ('role = "fit"', 'known = { m_p = "1 V" }', 25, "a voltage"),
    ('role = "fit"', "initial = { theta_dott = 0 }", 25, "did you mean 'theta_dot'?"),
    ('role = "fit"', 'initial = { theta = "1 kg" }', 25, "a mass"),
    ('role = "fit"', 'horizon = "0.5 m"', 25, "a length"),
    ('role = "fit"', 'horizon = "1 ms"', 25, "less than two samples"),
    ('role = "fit"', 'score_from = "30 s"', 25, "inside the run, 0 to 8 s"),
    ('role = "fit"', "period = 0", 25, "above zero"),
    ('role = "fit"', 'measured = ["theta"]\nlocked = ["theta"]', 26, "neither held nor measured"),
    ('role = "fit"', 'reader = "exp"', 25, "There is no reader 'exp'"),
    ('role = "fit"', 'time = "tt"', 25, "has no column 'tt'"),
    ('role = "fit"', "loop = {}", 25, "a loop needs gains per state"),
    ('role = "fit"', "loop = { gain = { x = 1 } }", 25, "did you mean 'gains'?"),
    ('role = "fit"', 'loop = { gains = { x = "1 N/m" } }', 25, "V/m"),
    ('role = "fit"', "loop = { gains = { x = 1 }, alpha = 1.5 }", 25, "below 1, got 1.5"),
    ('role = "fit"', 'loop = { gains = { x = 1 }, reference = "zz" }', 25, "did you mean 'z'?"),
    ('role = "fit"', "sensors.theta.sing = 1", 25, "did you mean 'sign'?"),
    ('role = "fit"', "sensors.phi.sign = 1", 25, "CartPendulum called 'phi'"),
    ("locked = { x = 0.0 }", "locked = { x = 0.0, theta = 0.0 }", 28, "nothing is left to compare"),
    ("locked = { x = 0.0 }", "locked = { y = 0.0 }", 29, "valid names: theta, x"),
    ("locked = { x = 0.0 }", 'locked = { x = "1 rad" }', 29, "m"),
]


@pytest.mark.parametrize(
    ("right", "wrong", "line", "says"), WRONG, ids=[w[1].replace("\n", "; ")[:50] or w[0] for w in WRONG]
)
def test_a_wrong_study_is_answered_with_line_and_remedy(folder, right, wrong, line, says):
    assert right in GOOD
    answer = complaint(folder, GOOD.replace(right, wrong, 1))
    assert f"study.toml, line {line}: " in answer
    assert says in answer
    assert "\n" not in answer


RUN = 'role = "fit"\n'


@pytest.mark.parametrize(
    ("right", "wrong", "says"),
    [
        ("min = 0", "min = 1e-300", "J_p must be 0 or from 1e-60 to 1e[+]60 in size, got 1e-300"),
        ("min = 0", 'min = "1e200 kg m^2"', 'must be 0 or from 1e-60 to 1e[+]60 in size, got "1e200 kg m.2"'),
        ('column = "v"\n', f'expression = "{"-" * 1900}v"\n', "nested too deeply"),
        ('column = "v"\n', f'expression = "v{"**2" * 600}"\n', "nested too deeply"),
        ('column = "v"\n', f'expression = "{"(" * 900}v{")" * 900}"\n', "neither a column nor arithmetic"),
        (RUN, f"{RUN}measured = {'[' * 900}{']' * 900}\n", "brackets nested hundreds deep"),
        (RUN, f"{RUN}score_from = {'9' * 5000}\n", "thousands of digits"),
        (RUN, f"{RUN}period = 1e-9\n", "8 s in steps of 1e-09 s are 8e[+]09 samples, and a run may have 1e[+]07"),
        (RUN, f"{RUN}horizon = [{', '.join(f'{0.02 + 0.001 * i:.3f}' for i in range(2000))}]\n", "lists 2000 times"),
        ("substeps = 2", "substeps = 1000000000", "from 1 to 100, got 1000000000"),
    ],
    ids=["tiny", "huge", "signs", "powers", "brackets", "lists", "digits", "period", "horizons", "substeps"],
)
def test_more_than_anybody_means_is_a_sentence(folder, right, wrong, says):
    """Each of these ended in a recursion without end, in gigabytes, or in hours."""
    assert re.search(says, complaint(folder, GOOD.replace(right, wrong, 1)))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "line 1: a study needs a table [rig]"),
        ("[rig\n", "line 1: this is not TOML"),
        ('[rig]\nplant = "furuta"\nplant = "furuta"\n', "line 3: this is not TOML"),
        ("[rig]\nplant = furuta\n", "line 2: this is not TOML"),
        ("t,theta\n0,1\n", "upright init"),
        (GOOD.partition("[[runs]]")[0], "needs at least one run"),
        (GOOD.partition("[[runs]]")[0] + "[runs]\n", "needs at least one run"),
        ("rig = 3\n", "line 1: 'rig' must be a table"),
        (GOOD.replace("[sensors.theta]", "[defaults]\nmesured = 3\n[sensors.theta]"), "line 12: [defaults] has no key"),
        (GOOD.replace('[sensors.x]\ncolumn = "z"\n', "").replace("window", 'held = ["x"]\nwindow'), "x has no sensor"),
    ],
)
def test_a_study_that_is_none_says_what_is_missing(folder, text, says):
    assert says in complaint(folder, text)


def test_a_study_without_sensors_says_how_to_add_one(folder):
    head, _, tail = GOOD.partition("[sensors.theta]")
    answer = complaint(folder, head + "[drive]" + tail.partition("[drive]")[2])
    assert "[sensors.x]" in answer


def test_a_binary_file_is_taken_for_a_log(folder):
    (folder / "study.toml").write_bytes(bytes(range(256)))
    with pytest.raises(BadInput, match="upright init"):
        load_study(folder / "study.toml")


KEYS = [
    (section, key)
    for section in ("rig", "actuator", "sensors", "drive", "runs", "loop")
    for key in names(section)
    if len(key) >= 4
]
WHERE = {
    "rig": ("substeps = 2", "{} = 1"),
    "actuator": ('gain = { guess = "5 N/V" }', "{} = 1"),
    "sensors": ("sign = -1", "{} = 1"),
    "drive": ('column = "v"', "{} = 1"),
    "runs": ('role = "fit"', "{} = 1"),
    "loop": ('role = "fit"', "loop = {{ {} = 1 }}"),
}


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(target=st.sampled_from(KEYS), slip=st.sampled_from(["swap", "drop", "double"]), where=st.floats(0, 0.999))
def test_a_slip_of_the_finger_is_answered_with_the_key_that_was_meant(folder, target, slip, where):
    section, key = target
    i = int(where * (len(key) - 1))
    typo = {
        "swap": key[:i] + key[i + 1] + key[i] + key[i + 2 :],
        "drop": key[:i] + key[i + 1 :],
        "double": key[:i] + key[i] + key[i:],
    }[slip]
    if typo in names(section) or len(key) < 4 or key == "known":  # "nkown" is as near to "unknown"
        return
    right, wrong = WHERE[section]
    answer = complaint(folder, GOOD.replace(right, wrong.format(typo), 1))
    assert f"'{typo}'; did you mean '{key}'?" in answer
