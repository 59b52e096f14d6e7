"""Is a rig told from another one, and asked for what it lacks, entry by entry?"""

from __future__ import annotations

from pathlib import Path

import pytest

from upright.errors import BadInput
from upright.physics import find
from upright.rig.hardware import DRIVE_SIGN, Entry, Hardware, check_vendor, driven_unit, meaning_of, place_of
from upright.study.description import read_hardware
from upright.study.rig import read_rig
from upright.study.text import StudyText


def entry(value: float, unit: str = "V", source: str = "known") -> Entry:
    return Entry(value=value, unit=unit, source=source)


RIG = Hardware(name="bench 3", vendor="", entries={"limit": entry(10.0), "travel": entry(0.3, "m", "measured")})


def test_entries_are_laid_over_each_other():
    assert RIG.over({"limit": entry(5.0), "lag": entry(0.01, "s")}).entries == {**RIG.entries, "lag": entry(0.01, "s")}
    given = RIG.with_entries({"limit": entry(5.0), "travel": None})
    assert given.entries == {"limit": entry(5.0), "travel": RIG.entries["travel"]}
    assert (RIG.value("limit", 3.0), RIG.value("lag", 3.0)) == (10.0, 3.0)
    assert RIG.plain() == {
        "name": "bench 3",
        "vendor": "",
        "entries": {
            "limit": {"value": 10.0, "unit": "V", "source": "known"},
            "travel": {"value": 0.3, "unit": "m", "source": "measured"},
        },
    }
    assert str(entry(0.123456789)) == "0.123457 V (known)"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sign_of_a_drive_is_taken_out_once_and_its_offset_with_it(sign):
    """u' = s u + o is s (u + s o): what a log's command meets."""
    said = Hardware(entries={DRIVE_SIGN: entry(sign, ""), "offset": entry(0.3), "limit": entry(10.0)})
    found, plain = said.as_commanded()
    assert found == sign
    assert plain.entries == {"offset": entry(sign * 0.3), "limit": entry(10.0)}
    assert plain.as_commanded() == (1.0, plain)
    assert RIG.as_commanded() == (1.0, RIG)


def test_what_is_missing_is_asked_for_with_every_way_to_say_it():
    RIG.demand({"limit": "--limit 10"}, "design", sheet="--vendor NAME")
    with pytest.raises(BadInput) as caught:
        RIG.demand(
            {"limit": "--limit 10", "servo_period": "--period", "counts.theta": ""}, "design", sheet="--vendor NAME"
        )
    said = str(caught.value)
    assert said.startswith(
        "design needs numbers that neither the study nor its fit has: servo period (--period or [rig] servo_period"
        ' = "2 ms"); encoder counts of theta ([sensors.theta] counts_per_rev or counts_per_m). Give the option, or'
    )
    assert "limit" not in said.partition(";")[0]
    assert "--vendor NAME takes the data sheet" in said
    with pytest.raises(BadInput, match=r"\. Write them into the study and identify"):
        RIG.demand({"servo_period": ""}, "design", sheet="vendor=")


@pytest.mark.parametrize(
    ("name", "mine", "others", "differs"),
    [
        ("limit", entry(10.0), entry(10.02), True),
        ("limit", entry(10.0), entry(10.005), False),
        ("limit", entry(10.0, source="measured"), entry(5.0), True),
        ("limit", entry(10.0, source="assumed"), entry(5.0), False),
        ("limit", entry(10.0), entry(5.0, source="identified"), False),
        ("counts.theta", entry(4096, "", "assumed"), entry(4000, ""), True),
        ("offset.theta", entry(1.0, ""), entry(2.0, ""), False),
        ("sign.theta", entry(1.0, ""), entry(-1.0, ""), True),
    ],
)
def test_a_fit_of_another_rig_is_told_by_what_nobody_guessed(name, mine, others, differs):
    said = Hardware(entries={name: mine}).unlike(Hardware(entries={name: others}))
    assert len(said) == differs
    if differs:
        assert said[0].startswith(f"Is it the same rig? Its {meaning_of(name)}: ")
        assert f"{mine.value:.5g}" in said[0].partition(" in the fit")[0]
        assert f"{others.value:.5g}" in said[0].partition(" in the fit, ")[2]
    assert Hardware(entries={name: mine}).unlike(Hardware()) == ()


def test_names_and_vendors_tell_rigs_apart_where_both_have_one():
    one, two = Hardware(name="a", vendor="ECP 205"), Hardware(name="b", vendor="ECP 210")
    assert one.unlike(two) == (
        "The fit is of another rig (a) than the study (b).",
        "The fit is of another rig (vendor ECP 205) than the study (vendor ECP 210).",
    )
    assert one.unlike(Hardware()) == one.unlike(one) == Hardware().unlike(two) == ()


@pytest.mark.parametrize(
    ("name", "meaning", "place"),
    [
        ("converter", "smallest step of the command", '[actuator] converter = "..."'),
        ("servo_period", "servo period", '[rig] servo_period = "2 ms"'),
        ("travel", "how far the driven body may go either way", '[rig] travel = "..."'),
        ("counts.x", "encoder counts of x", "[sensors.x] counts_per_rev or counts_per_m"),
        ("sign.x", "sign of the encoder of x", "[sensors.x] sign"),
        ("offset.x", "reading at which x is zero", "[sensors.x] offset"),
    ],
)
def test_an_entry_says_what_it_is_and_where_a_study_says_it(name, meaning, place):
    assert (meaning_of(name), place_of(name)) == (meaning, place)


def described(text: str, logs=()) -> Hardware:
    plant = find("cart-pendulum")
    root = StudyText(Path("s.toml"), text).root()
    return read_hardware(root, plant, read_rig(root, plant, "V", {"m_c": 1, "m_p": 1, "l_cg": 1}), logs)


def test_a_study_describes_drive_servo_and_encoders():
    found = described(
        '[rig]\nplant = "cart-pendulum"\nservo_period = { value = "2 ms", assumed = true }\ntravel = "30 cm"\n'
        '[actuator]\nlimit = { value = "10 V", measured = true }\nlag = { guess = "5 ms" }\nconverter = "5 mV"\n'
        '[sensors.x]\nunit = "counts"\ncounts_per_m = 4000\nsign = -1\n'
    )
    told = {name: (e.value, e.unit, e.source) for name, e in found.entries.items()}
    assert told["servo_period"] == (pytest.approx(0.002), "s", "assumed")
    assert told["travel"] == (pytest.approx(0.3), "m", "known")
    assert told["limit"][1:] == ("V", "measured")
    assert told["converter"] == (pytest.approx(0.005), "V", "known")
    assert told["counts.x"][0] == 4000
    assert told["sign.x"][0] == -1
    assert "counts.theta" not in told


@pytest.mark.parametrize(
    ("text", "logs", "name"),
    [("", ["a"], "a"), ("", ["a", "a"], "a"), ("", ["a", "b"], ""), ("", [], ""), ('name = "c"\n', ["a"], "c")],
)
def test_a_rig_is_called_as_its_study_or_all_its_logs_call_it(text, logs, name):
    assert described(f'[rig]\nplant = "cart-pendulum"\n{text}', logs).name == name


def test_a_vendor_has_a_data_sheet_or_is_none():
    assert check_vendor(None) is None
    assert check_vendor("ECP 205") == "ECP 205"
    with pytest.raises(BadInput, match="there is no data sheet of 'ECP 206'; did you mean"):
        check_vendor("ECP 206")
    assert driven_unit(find("cart-pendulum")) == "m"
    assert driven_unit(find("furuta")) == "rad"
