"""Does a study take laws as programs had them, recover them from the log, and refuse what is none?"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.closed_loop.programs import Pid, T, closed_loop
from upright.errors import BadInput
from upright.identification import Run
from upright.study import load_study
from upright.study.loop import matching

STUDY = """
[rig]
plant = "rectilinear-1"
[parameters]
m_1 = "1 kg"
k_1 = 0
c_1 = {{ guess = "3 N s/m" }}
[actuator]
gain = "20 N/V"
[drive]
column = "u"
unit = "V"
sign = -1
scale = 0.5
[sensors.x_1]
column = "y"
unit = "m"
scale = 0.01
sign = -1
offset = 0.25
[[runs]]
file = "log.csv"
{loop}
"""
RECORD = closed_loop(Pid(kp=4.0, ki=3.0, kd=0.2, tau=0.01), rows=1500)
RECOVER = 'loop = { kind = "recover", reference = "r" }'
WRITTEN = 'loop = { kind = "pid", kp = 4, ki = 3, kd = 0.2, tau = "10 ms", reference = "r", units = "log" }'


def run_of(folder: Path, loop: str, **changes: np.ndarray) -> Run:
    table = {"t": RECORD.t, **RECORD.signals, **changes}
    np.savetxt(
        folder / "log.csv", np.column_stack(list(table.values())), "%.12g", ",", header=",".join(table), comments=""
    )
    (folder / "study.toml").write_text(STUDY.format(loop=loop), encoding="utf-8")
    return load_study(folder / "study.toml").runs[0]


@pytest.mark.parametrize("loop", [RECOVER, WRITTEN], ids=["recovered", "written"])
def test_a_law_of_the_logs_columns_commands_in_the_drives_unit(tmp_path: Path, loop: str) -> None:
    """Whatever sign, scale and offset the sensor and the drive have, the commands are those of the log."""
    run = run_of(tmp_path, loop)
    u, _ = run.loop.follow(run.y, run.measured)
    np.testing.assert_allclose(u[3:], -0.5 * RECORD["u"][3:], atol=1e-6)


def test_two_taps_smooth_a_difference_as_the_program_does(tmp_path: Path) -> None:
    """``u = kp e + kd (0.2 d + 0.8 d_before)``, the differences `d` of the error; the drive halves and turns it."""
    run = run_of(
        tmp_path, 'loop = { kind = "pid", kp = 4, kd = 0.1, taps = [0.2, 0.8], reference = "r", units = "log" }'
    )
    u, _ = run.loop.follow(run.y, run.measured)
    e = RECORD["r"] - RECORD["y"]
    d = np.diff(e, prepend=e[0]) / T
    expected = 4 * e + 0.1 * (0.2 * d + 0.8 * np.concatenate([[0.0], d[:-1]]))
    np.testing.assert_allclose(u[3:], -0.5 * expected[3:], atol=1e-6)


def test_a_recovered_law_is_told_with_the_run(tmp_path: Path) -> None:
    assert "loop recovered from the log: PID; filtered difference of the error" in run_of(tmp_path, RECOVER).source


def test_the_loops_sign_replaces_the_drives(tmp_path: Path) -> None:
    run = run_of(tmp_path, WRITTEN.replace('units = "log"', 'units = "log", sign = 1'))
    u, _ = run.loop.follow(run.y, run.measured)
    np.testing.assert_allclose(u[3:], 0.5 * RECORD["u"][3:], atol=1e-6)


def test_gains_in_si_have_units(tmp_path: Path) -> None:
    run = run_of(tmp_path, 'loop = { kind = "pid", kp = "2 V/cm", kd = "1 V s/m", reference = "1 cm" }')
    u, _ = run.loop.follow(np.array([[0.0], [0.001]]), ("x_1",))
    first = run.y[0, 0]  # the difference sees no jump at the run's own first sample
    np.testing.assert_allclose(u, [200 * 0.01 - (0.0 - first) / T, 200 * 0.009 - 0.001 / T])


def test_matrices_state_any_law(tmp_path: Path) -> None:
    """A sum written out: z+ = z + T (r - y), u = 5 (z + T (r - y)) + 2 (r - y)."""
    loop = f"loop = {{ kind = 'general', A = [[1.0]], B = [[{-T}, {T}]], C = [5.0], D = [{-5 * T - 2}, {5 * T + 2}],"
    run = run_of(tmp_path, loop + " measured = 'x_1', reference = 0.3 }")
    y = np.array([0.1, 0.2, 0.0])
    u, _ = run.loop.follow(y[:, None], ("x_1",))
    np.testing.assert_allclose(u, 5 * T * np.cumsum(0.3 - y) + 2 * (0.3 - y))


def test_a_law_faster_than_the_rows_needs_its_period(tmp_path: Path) -> None:
    run = run_of(tmp_path, WRITTEN.replace("kp = 4", 'kp = 4, period = "0.4 ms"'))
    assert run.loop.every == 5
    assert run.loop.law.period == pytest.approx(T / 5)
    # each row's reference for the five samples from there on, and the last one for the last
    for k in (0, 1, 700, RECORD.t.size - 2):
        np.testing.assert_allclose(run.loop.law.references[5 * k : 5 * k + 5, 0], RECORD["r"][k], atol=1e-9)
    assert len(run.loop.law.references) == 5 * (RECORD.t.size - 1) + 1


@pytest.mark.parametrize(
    ("ratio", "every"), [(1.0, 1), (0.985, 1), (1.015, 1), (4.91, 5), (5.09, 5), (0.97, 0), (1.03, 0), (5.11, 0),
                         (0.4, 0)],
)  # fmt: skip
def test_a_law_is_evaluated_a_whole_number_of_times_a_row_to_two_percent(ratio: float, every: int) -> None:
    section: Any = SimpleNamespace(error=lambda key, text: BadInput(f"{key}: {text}"))
    if every:
        assert matching(section, ratio) == every
    else:
        with pytest.raises(BadInput, match=f"period: the law is evaluated {ratio:g} times per row"):
            matching(section, ratio)


@pytest.mark.parametrize(
    ("reference", "metres"), [('"1 cm"', 0.01), ('"+1 cm"', 0.01), ('"-2 mm"', -2e-3), ('".5 cm"', 5e-3), ("0.3", 0.3)]
)
def test_a_reference_that_begins_like_a_number_is_one_and_another_is_a_column(
    tmp_path: Path, reference: str, metres: float
) -> None:
    run = run_of(tmp_path, f'loop = {{ kind = "pid", kp = "2 V/m", reference = {reference} }}')
    u, _ = run.loop.follow(np.zeros((3, 1)), ("x_1",))
    np.testing.assert_allclose(u, 2 * metres)


def test_a_law_has_the_limit_the_windup_and_the_delay_of_its_program(tmp_path: Path) -> None:
    law = run_of(tmp_path, WRITTEN).loop.law
    assert (law.limit, law.windup, law.delay) == (np.inf, "free", 0.0)
    more = 'kind = "pid", limit = "1.5 V", windup = "hold", delay = 2, quantized = true'
    loop = run_of(tmp_path, WRITTEN.replace('kind = "pid"', more).replace(', units = "log"', "")).loop
    assert (loop.law.limit, loop.law.windup, loop.law.delay, loop.quantized) == (1.5, "hold", 2.0, True)


@pytest.mark.parametrize(
    ("loop", "sentence"),
    [
        ('loop = { kind = "pip" }', "did you mean 'pid'"),
        ('loop = { kind = "pid", reference = "r" }', "needs kp, ki or kd"),
        ('loop = { kind = "pid", kp = 1, on = "y" }', 'on must be "error" or "measurement"'),
        *(
            (f'loop = {{ kind = "pid", kp = 1, taps = {taps} }}', "two numbers that sum to 1")
            for taps in ("[1, 1]", "[1]", "[0.2, 0.3, 0.5]", '["0.2", 0.8]', "[true, 0]", "[2e6, -1999999]", "1")
        ),
        ('loop = { kind = "pid", kp = 1, period = "3 ms" }', "whole number of times"),
        ('loop = { kind = "pid", kp = [1, 2] }', "2 values for 1 measured"),
        ('loop = { kind = "pid", kp = 1, units = "counts" }', 'units must be "SI" or "log"'),
        ('loop = { kind = "general", A = [[1.0]], D = [1.0] }', "a law with 0 memories"),
        ('loop = { kind = "recover", reference = 3 }', "must name columns"),
    ],
)
def test_a_wrong_loop_is_answered_with_line_and_remedy(tmp_path: Path, loop: str, sentence: str) -> None:
    with pytest.raises(BadInput, match="line 23") as complaint:
        run_of(tmp_path, loop)
    assert sentence in str(complaint.value)


def test_a_poor_law_is_refused(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=RECORD.t.size)
    with pytest.raises(BadInput, match=r"no law could be recovered from 'u'|does not depend on"):
        run_of(tmp_path, RECOVER, u=noise)
