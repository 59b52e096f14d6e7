"""Is the law that a program ran found in the log it left? Loops with known programs, and logs without a law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.closed_loop.programs import Pid, T, closed_loop
from upright.closed_loop import recover_law
from upright.errors import BadInput, NotIdentifiable
from upright.records import Record

STRUCTURES = {
    "P": {"kp": 3.0},
    "PI": {"kp": 3.0, "ki": 2.0},
    "PD; plain difference of the error": {"kp": 4.0, "kd": 0.2},
    "PD; plain difference of the measurement": {"kp": 4.0, "kd": 0.2, "on": "measurement"},
    "PID; plain difference of the error": {"kp": 4.0, "ki": 3.0, "kd": 0.2},
    "PID; plain difference of the measurement": {"kp": 4.0, "ki": 3.0, "kd": 0.2, "on": "measurement"},
    "PID; filtered difference of the error": {"kp": 4.0, "ki": 3.0, "kd": 0.2, "tau": 0.013},
    "PID; filtered difference of the measurement": {"kp": 4.0, "ki": 3.0, "kd": 0.2, "tau": 0.004, "on": "measurement"},
    "PID; two-tap difference of the measurement": {"kp": 4.0, "ki": 3.0, "kd": 0.2, "second": 0.8, "on": "measurement"},
    "PD; two-tap difference of the error": {"kp": 4.0, "kd": 0.1, "second": 0.5},
}


def found_in(record: Record, **asked):
    return recover_law(record, measured=["y"], references=["r"], command="u", **asked)


@pytest.mark.parametrize(("structure", "program"), STRUCTURES.items(), ids=STRUCTURES)
def test_every_structure_is_found_exactly(structure: str, program: dict) -> None:
    found = found_in(closed_loop(Pid(**program)))
    assert found.structure == structure
    assert found.quality == "exact"
    for name in ("kp", "ki", "kd"):
        if program.get(name):
            assert found.gains[name].value == pytest.approx(program[name], rel=1e-7)
        else:
            assert name not in found.gains
    read = "y" if program.get("on") == "measurement" else "the error of y"
    meanings = {
        "kp": "on the error of y", "ki": "on the sum of the error of y [1/s]", "kd": f"on the rate of {read} [s]",
    }  # fmt: skip
    assert {n: g.meaning for n, g in found.gains.items() if n in meanings} == {
        n: m for n, m in meanings.items() if program.get(n)
    }
    if program.get("tau"):
        assert found.gains["tau"].value == pytest.approx(program["tau"], rel=1e-6)
        corner = 1 / (2 * np.pi * program["tau"])  # of a low pass of the first order
        assert found.gains["tau"].meaning.endswith(f"corner {corner:.4g} Hz")
    if program.get("second"):
        assert found.gains["second tap"].value == pytest.approx(program["second"], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("structure", "program"), STRUCTURES.items(), ids=STRUCTURES)
def test_rounded_commands_bound_the_gains_on_both_sides(structure: str, program: dict) -> None:
    found = found_in(closed_loop(Pid(**program), count=1e-3, step=0.01))
    assert found.resolution == pytest.approx(0.01)
    assert found.largest <= found.resolution
    for name in ("kp", "ki", "kd"):
        # every gain of the interval puts out every rounded command, so the program's own must be among them
        if program.get(name) and not program.get("tau"):
            low, high = found.gains[name].interval
            assert low <= program[name] <= high
            assert high - low < 0.05 * program[name]


@pytest.mark.parametrize("hold", [False, True], ids=["free", "held"])
def test_a_limit_is_estimated_and_tells_what_the_sum_did_meanwhile(hold: bool) -> None:
    found = found_in(closed_loop(Pid(kp=4.0, ki=5.0, kd=0.2, limit=2.5, hold=hold)))
    assert found.quality == "exact"
    assert found.law.limit == pytest.approx(2.5)
    assert found.law.windup == ("hold" if hold else "free")
    assert 0.01 < found.saturated < 0.5
    assert {n: g.value for n, g in found.gains.items()} == pytest.approx({"kp": 4.0, "ki": 5.0, "kd": 0.2}, rel=1e-6)


def test_a_command_that_comes_a_sample_late_is_told() -> None:
    found = found_in(closed_loop(Pid(kp=3.0, kd=0.1), late=True))
    assert found.structure == "PD; plain difference of the error; one sample late"
    assert found.quality == "exact"


def test_a_slower_servo_is_recovered_at_its_own_rate() -> None:
    found = found_in(closed_loop(Pid(kp=2.0, kd=0.1, period=5 * T), hold=5))
    assert found.law.period == pytest.approx(5 * T)
    assert found.quality == "exact"
    assert found.gains["kd"].value == pytest.approx(0.1, rel=1e-7)


@pytest.mark.slow
def test_rows_that_miss_samples_of_the_servo_are_no_exact_law() -> None:
    found = found_in(closed_loop(Pid(kp=4.0, kd=0.2, period=T / 5), every=5))
    assert found.quality in ("partial", "poor")
    assert "not the whole law" in found.sentence or "no linear law" in found.sentence


def test_junk_in_the_first_row_does_no_harm() -> None:
    record = closed_loop(Pid(kp=4.0, ki=3.0))
    spoilt = record["u"].copy()
    spoilt[0] = 1e5
    found = found_in(Record(t=record.t, signals={**record.signals, "u": spoilt}))
    assert found.quality == "exact"


@pytest.mark.slow
def test_two_channels_and_a_feedforward_are_told_apart() -> None:
    generator = np.random.default_rng(3)
    a, b = np.cumsum(generator.normal(size=(2, 3000)), axis=1) * 0.01
    f = np.sin(np.arange(3000) * 0.01)
    first, second = Pid(kp=6.0, kd=1.8, tau=0.02), Pid(kp=30.0, kd=2.5, tau=0.02)
    u = np.array([first(x, 0.0) + second(y, 0.0) for x, y in zip(a, b, strict=True)]) + 0.7 * f
    record = Record(t=np.arange(3000) * T, signals={"a": a, "b": b, "f": f, "u": u})
    found = recover_law(record, measured=["a", "b"], command="u", feedforward=["f"])
    assert found.quality == "exact"
    assert found.structure == "PD of a and b; filtered difference of the error"
    values = {name: gain.value for name, gain in found.gains.items()}
    expected = {"kp a": 6.0, "kd a": 1.8, "kp b": 30.0, "kd b": 2.5, "tau": 0.02, "factor f": 0.7}
    assert values == pytest.approx(expected, rel=1e-6)


def test_the_law_found_goes_on_where_the_log_stops() -> None:
    whole = closed_loop(Pid(kp=4.0, ki=3.0, kd=0.2, tau=0.01), rows=3000)
    found = found_in(whole.window(0, 2000 * T))
    later = replace(found.law, references=whole["r"]).follow(whole["y"])[0][:, 0]
    np.testing.assert_allclose(later[3:], whole["u"][3:], atol=1e-6 * np.ptp(whole["u"]))


@pytest.mark.slow
def test_noise_is_no_law() -> None:
    record = closed_loop(Pid(kp=3.0))
    noise = np.random.default_rng(2).normal(size=record.t.size)
    try:
        found = found_in(Record(t=record.t, signals={**record.signals, "u": noise}))
    except NotIdentifiable:
        return
    assert found.quality == "poor"
    assert "no linear law" in found.sentence


def test_an_open_loop_is_no_law() -> None:
    """A square wave pushes the cart and the reference rests: what the cart does cannot tell the wave's corners."""
    wave = iter(np.where(np.arange(4000) % 1000 < 500, 0.2, -0.2))
    record = closed_loop(lambda y, r: float(next(wave)))
    try:
        found = recover_law(record, measured=["y"], command="u")
    except NotIdentifiable:
        return
    assert found.quality == "poor"


@pytest.mark.slow
def test_a_law_with_a_dead_zone_is_not_called_exact() -> None:
    pid = Pid(kp=3.0)
    found = found_in(closed_loop(lambda y, r: 0.0 if abs(r - y) < 0.2 else pid(y, r)))
    assert found.quality in ("partial", "poor")


def test_mistakes_are_answered_with_what_is_there() -> None:
    record = closed_loop(Pid(kp=3.0), rows=300)
    with pytest.raises(BadInput, match="no column 'Y'"):
        recover_law(record, measured=["Y"], command="u")
    with pytest.raises(BadInput, match="at least one measured column"):
        recover_law(record, measured=[], command="u")
    with pytest.raises(BadInput, match="1 measured columns take as many references at most, got 2"):
        recover_law(record, measured=["y"], references=["r", "r"], command="u")
    still = Record(t=record.t, signals={**record.signals, "u": np.zeros(300)})
    with pytest.raises(NotIdentifiable, match="stays at 0"):
        found_in(still)
    with pytest.raises(NotIdentifiable, match="at least 60"):
        found_in(record.window(0, 40 * T))
    # a spline through more than a million samples is no answer: 300 rows of 3334
    with pytest.raises(BadInput, match="300 rows of 3334 samples each are 1e"):
        found_in(record, every=3334)


@pytest.mark.parametrize(("every", "said"), [(1, ""), (2, "second"), (3, "third"), (5, "5th")])
def test_what_a_law_misses_is_told_in_percent_of_the_command(every: int, said: str) -> None:
    """Missed by a tenth of the command's deviation, to and fro, it explains 90 %; by half of it, next to nothing."""
    found = found_in(closed_loop(Pid(kp=4.0)))
    rough = np.where(np.arange(found.recorded.size) % 2, 1.0, -1.0) * np.std(found.recorded[3:])
    partial = replace(found, reproduced=found.recorded + 0.1 * rough, every=every)
    assert partial.quality == "partial"
    assert "The law explains 90.0 % of the command" in partial.sentence
    assert ("every" in partial.sentence) is (every > 1)
    assert said in partial.sentence
    assert replace(partial, reproduced=found.recorded + rough).quality == "poor"


def changed(record: Record, later: float = 0.0, **times: float) -> Record:
    """A log on another clock, columns multiplied."""
    signals = {n: times.get(n, 1.0) * x for n, x in record.signals.items()}
    return replace(record, t=record.t + later, signals=signals)


@pytest.mark.parametrize(
    ("program", "rounded"),
    [
        ({"kp": 4.0, "ki": 3.0, "kd": 0.2, "tau": 0.013}, {"count": 2.0**-10, "step": 2.0**-7}),
        ({"kp": 4.0, "kd": 0.1, "second": 0.5, "limit": 2.5}, {}),
    ],
    ids=["rounded", "exact"],
)
def test_a_law_does_not_depend_on_clock_mirror_or_units(program: dict, rounded: dict) -> None:
    """A command of half the size on readings four times as large has an eighth of every gain; a filter keeps its time.

    Powers of two, so that nothing is rounded otherwise.
    """
    record = closed_loop(Pid(**program), rows=2000, **rounded)
    here = found_in(record)
    others = {
        1.0: (changed(record, later=1024.0), changed(record, y=-1.0, r=-1.0, u=-1.0)),
        0.125: (changed(record, y=4.0, r=4.0, u=0.5),),
    }
    for times, records in others.items():
        for other in records:
            found = found_in(other)
            assert (found.structure, found.quality, found.every) == (here.structure, here.quality, here.every)
            assert (found.used == here.used).all()
            for name, gain in here.gains.items():
                factor = times if name.startswith("k") else 1.0
                theirs = found.gains[name]
                assert theirs.value == pytest.approx(factor * gain.value, rel=1e-6)
                assert theirs.interval == pytest.approx([factor * end for end in gain.interval], rel=1e-4)
