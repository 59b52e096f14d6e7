"""Are a chain's numbers found from motions whose plant is known, and written where its drafted study needs them?"""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from tests.study.draft.test_recognise import col, log
from upright.physics import find
from upright.readers.inspection import Column
from upright.readers.resolution import Resolution
from upright.study.draft.chain import ChainStarts, chain_tables, starts
from upright.study.draft.chain_log import ChainLog
from upright.study.draft.recognise import Recognised
from upright.study.text import study_text

DT = 0.002
T = DT * np.arange(5001)


def moved(M: list[float], K: np.ndarray, C: list[float], u: np.ndarray, first: list[float]) -> list[np.ndarray]:
    """Linear chain ``M q'' + C q' + K q = u e_1``, held commands, sampled exactly by the matrix exponential."""
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-K / np.array(M)[:, None], -np.diag(np.array(C) / M)]])
    B = np.zeros(2 * n)
    B[n] = 1 / M[0]
    step = expm(np.block([[A, B[:, None]], [np.zeros((1, 2 * n + 1))]]) * DT)
    x, out = np.r_[first, np.zeros(n)], np.zeros((u.size, n))
    for k in range(u.size):
        out[k] = x[:n]
        x = step[:-1, :-1] @ x + step[:-1, -1] * u[k]
    return list(out.T)


SQUARE = np.where((T > 0.5) & (T % 4 < 2), 3.0, 0.0)


def test_two_carts_are_found_from_their_driven_motion():
    """Carts of 2 and 1.5 kg on springs of 300 and 200 N/m, damped by 3 and 2 N s/m."""
    K = np.array([[500.0, -200], [-200, 200]])
    bodies = moved([2.0, 1.5], K, [3.0, 2.0], SQUARE, [0, 0])
    found = starts(T, SQUARE, bodies, [True, True], plant=find("rectilinear-2"), quanta=[1e-6, 1e-6], loop=False)
    expected = {"m_1": 2.0, "m_2": 1.5, "k_1": 300, "k_12": 200, "c_1": 3.0, "c_2": 2.0}
    for name, value in expected.items():
        assert found.numbers[name] == pytest.approx(value, rel=0.15 if name[0] != "c" else 0.5), name
    assert not found.trips
    assert (found.limit, found.grounded) == (0.0, None)
    slow, fast = np.sqrt(np.sort(np.linalg.eigvals(K / np.array([[2.0], [1.5]]))))
    assert slow < found.fastest < 1.05 * fast


@pytest.mark.parametrize(("second", "metre", "newton"), [(16.0, 1.0, 1.0), (1.0, 1e-3, 1.0), (1.0, 1.0, 40.0)])
def test_numbers_of_a_chain_follow_the_units_of_time_length_and_force(second, metre, newton):
    """What is written as 1 s, 1 m and 1 N is another one: mass, stiffness and damping scale by their dimensions."""
    bodies = moved([2.0, 1.5], np.array([[500.0, -200], [-200, 200]]), [3.0, 2.0], SQUARE, [0, 0])

    def found(second: float, metre: float, newton: float) -> ChainStarts:
        t = 2 * T * second  # of 4 ms, so that no braking of the drive is looked for
        return starts(t, SQUARE * newton, [x * metre for x in bodies], [True, True], plant=find("rectilinear-2"),
                      quanta=[1e-6 * metre] * 2, loop=False)  # fmt: skip

    as_it_is, scaled = found(1.0, 1.0, 1.0), found(second, metre, newton)
    per_metre = newton / metre
    dimension = {"m": per_metre * second**2, "c": per_metre * second, "k": per_metre, "f": newton}
    assert scaled.numbers == pytest.approx({n: v * dimension[n[0]] for n, v in as_it_is.numbers.items()}, rel=1e-6)
    assert scaled.fastest == pytest.approx(as_it_is.fastest / second, rel=1e-6)


def test_free_disks_are_found_and_have_no_spring_to_ground():
    K = np.array([[2.4, -2.4], [-2.4, 2.4]])
    u = np.where(T > 0.5, 0.5, 0.0)
    bodies = moved([0.009, 0.006], K, [1e-4, 1e-4], u, [0, 0])
    found = starts(T, u, bodies, [True, True], plant=find("torsional-2"), quanta=[1e-5, 1e-5], loop=False)
    assert found.numbers["J_1"] == pytest.approx(0.009, rel=0.1)
    assert found.numbers["J_2"] == pytest.approx(0.006, rel=0.1)
    assert found.numbers["k_12"] == pytest.approx(2.4, rel=0.1)
    assert "k_1" not in found.numbers
    assert "k_2" not in found.numbers


def test_a_cart_beside_one_that_is_held_is_tied_by_both_springs():
    bodies = moved([2.0], np.array([[500.0]]), [3.0], SQUARE, [0])
    found = starts(
        T, SQUARE, [*bodies, 0 * T], [True, False], plant=find("rectilinear-2"), quanta=[1e-6, 1e-6], loop=False
    )
    assert found.numbers["k_1"] == pytest.approx(500, rel=0.1)
    assert found.numbers["m_1"] == pytest.approx(2.0, rel=0.1)
    assert found.numbers["m_2"] == found.numbers["m_1"]  # it does not matter
    assert "k_12" not in found.numbers


def test_a_free_swing_tells_ratios_to_an_inertia_of_one():
    bodies = moved([2.0], np.array([[500.0]]), [3.0], 0 * T, [0.02])
    found = starts(T, None, bodies, [True], plant=find("rectilinear-1"), quanta=[1e-7], loop=False)
    assert found.numbers["m_1"] == 1.0
    assert found.numbers["k_1"] == pytest.approx(250, rel=0.05)
    assert found.numbers["c_1"] == pytest.approx(1.5, rel=0.3)
    assert found.fastest == pytest.approx(np.sqrt(250), rel=0.02)
    assert found.braked == 0.0
    assert not found.trips


def test_a_drive_that_brakes_while_it_is_on_is_told_from_friction():
    """A cart of 2 kg on 500 N/m, damped by 3 N s/m, and by 8 N s/m more while it is commanded."""
    u = np.where(T % 1.0 < 0.5, 6.0, 0.0)
    steps = []
    for c in (3.0, 11.0):
        A = np.array([[0, 1, 0], [-250, -c / 2, 0.5], [0, 0, 0]])
        steps.append(expm(A * DT))
    x, y = np.zeros(2), np.zeros(T.size)
    for k in range(T.size):
        y[k] = x[0]
        step = steps[int(u[k] != 0)]
        x = step[:2, :2] @ x + step[:2, 2] * u[k]
    found = starts(T, u, [y], [True], plant=find("rectilinear-1"), quanta=[1e-7], loop=False)
    assert found.braked == pytest.approx(8.0, rel=0.25)
    assert found.numbers["c_1"] == pytest.approx(3.0, rel=0.3)
    assert starts(T, u, [y], [True], plant=find("rectilinear-1"), quanta=[1e-7], loop=True).braked == 0.0


def test_a_last_body_that_rests_behind_its_neighbour_is_tied_to_ground():
    """k_12 (x_1 - x_2) = k_2 x_2 with 200 and 50 N/m: four fifths of the way."""
    K = np.array([[500.0, -200], [-200, 250]])
    u = np.where(T > 0.5, 3.0, 0.0)
    bodies = moved([2.0, 1.5], K, [12.0, 9.0], u, [0, 0])
    found = starts(T, u, bodies, [True, True], plant=find("rectilinear-2"), quanta=[1e-7, 1e-7], loop=False)
    assert found.grounded == pytest.approx(0.8, abs=0.01)
    assert found.numbers["k_2"] == pytest.approx(0.25 * found.numbers["k_12"], rel=0.05)
    for quanta, free in (([1e-3, 1e-3], [True, True]), ([1e-7, 1e-7], [False, True])):
        again = starts(T, u, bodies, free, plant=find("rectilinear-2"), quanta=quanta, loop=False)
        assert again.grounded is None  # too near to tell by the steps of its sensor, or beside a hand


def test_a_command_beyond_reach_is_taken_to_pass_a_tenth_of_it():
    bodies = moved([2.0], np.array([[500.0]]), [3.0], SQUARE, [0])
    for reach, limit in ((2.9, 0.29), (3.0, 0.0), (np.inf, 0.0)):
        found = starts(T, SQUARE, bodies, [True], plant=find("rectilinear-1"), quanta=[1e-6], loop=True, reach=reach)
        assert found.limit == pytest.approx(limit)


def columns(guess: str = "counts", **more: Any) -> dict[str, Column]:
    return {
        "x_1": col("enc1", guess, low=-500.0, high=500.0, **more),
        "x_2": col("enc2", guess, low=-400.0, high=400.0),
    }


def chain(plant: str = "rectilinear-2", names: tuple[str, ...] = ("x_1", "x_2"), drive: Column | None = None,
          windows: tuple[tuple[float, float], ...] = ((0.0, 10.0),), reversed_: bool = False, guess: str = "counts",
          **more: Any) -> ChainLog:  # fmt: skip
    of = dict(zip(names, columns(guess).values(), strict=False))
    found = Recognised(
        plant=plant, columns=of, rest=dict.fromkeys(of, 0.0), drive=drive, reversed=reversed_, throw=0.0,
        window=windows[0], frequency=0.0, settled=True, doubts=("first",),
    )  # fmt: skip
    about: dict[str, Any] = {"held": (), "locked": (), "reference": None, "loop": ""}
    return ChainLog(recognised=found, windows=windows, **(about | more))


METRE = 10_000  # counts, as a placeholder says
CARTS = moved([2.0, 1.5], np.array([[500.0, -200], [-200, 200]]), [3.0, 2.0], SQUARE, [0, 0])
RECORD = log(DT, enc1=np.round(METRE * 100 * CARTS[0]), enc2=np.round(METRE * 100 * CARTS[1]), u=SQUARE)
U = col("u", "V", drive=True, low=0.0, high=3.0)


def study(of: ChainLog, record=RECORD) -> tuple[dict[str, Any], str, Recognised]:
    found, tables = chain_tables(record, of, "log.csv", "log")
    return tomllib.loads(study_text(tables)), study_text(tables), found


def value(stated: dict[str, Any]) -> float:
    return float(str(stated.get("guess", stated.get("value"))).partition(" ")[0])


def test_a_draft_of_driven_carts_asks_for_what_a_newton_per_volt_moves():
    """Their columns count a hundred times as far as they went, so masses and springs are a hundredth."""
    said, _, found = study(chain(drive=U, still=("x_1", "x_2")))
    given = said["parameters"]
    for name, expected in {"m_1": 0.02, "m_2": 0.015, "k_1": 3, "k_12": 2}.items():
        assert value(given[name]) == pytest.approx(expected, rel=0.2), name
        assert given[name]["min"] == 0
    assert said["actuator"]["gain"] == {"value": "1 N/V", "assumed": True}
    assert said["drive"] == {"column": "u", "unit": "V"}
    assert said["sensors"]["x_1"]["counts_per_m"] == {"value": METRE, "assumed": True}
    assert said["defaults"] == {"unknown": ["initial", "offset"]}
    start, tail = said["runs"]
    assert (start["label"], start["role"], tail["label"], tail["role"]) == ("log start", "fit", "log tail", "predict")
    assert start["initial"] == {"x_1_dot": 0, "x_2_dot": 0}
    assert "initial" not in tail  # it begins on the way
    assert found.doubts[0] == "first"
    back = study(chain(drive=U, reversed_=True))[0]
    assert back["drive"]["sign"] == -1
    assert "initial" not in back["runs"][0]


def test_a_loops_output_in_counts_is_the_converters():
    counts = col("u", "counts", drive=True, low=0.0, high=819.0 * 3)
    record = log(DT, enc1=RECORD["enc1"], enc2=RECORD["enc2"], u=819 * SQUARE)
    said = study(chain(drive=counts), record)[0]
    assert said["drive"] == {"column": "u", "unit": "V", "scale": 0.001221}
    assert value(said["parameters"]["m_1"]) == pytest.approx(0.02, rel=0.2)
    assert "limit" not in said["actuator"]
    far = log(DT, enc1=RECORD["enc1"], enc2=RECORD["enc2"], u=819 * 4 * SQUARE)
    assert study(chain(drive=counts), far)[0]["actuator"]["limit"] == {"guess": "1 V", "min": 0}


def test_a_free_swing_assumes_one_inertia_and_says_that_it_sees_only_ratios():
    swing = moved([2.0, 1.5], np.array([[500.0, -200], [-200, 200]]), [3.0, 2.0], 0 * T, [0.02, 0.03])
    record = log(DT, enc1=np.round(METRE * swing[0]), enc2=np.round(METRE * swing[1]))
    said, text, _ = study(chain(windows=((0.0, 4.0), (5.0, 10.0))), record)
    given = said["parameters"]
    assert given["m_1"] == {"value": "1 kg", "assumed": True}
    assert "guess" in given["m_2"]
    assert "MEASURE: a free swing sees only ratios" in text
    # reversals are seen from three steps of the sensor on, or from 1e-4 of what it went through
    assert given["delta_1"] == {"guess": "5e-05 m", "min": "1e-05 m"}
    assert given["delta_2"] == {"guess": "4e-05 m", "min": "8e-06 m"}
    assert "drive" not in said
    assert [r["label"] for r in said["runs"]] == ["log 1", "log 2"]
    assert [r["window"] for r in said["runs"]] == [[0.0, 4.0], [5.0, 10.0]]
    assert said["defaults"] == {"unknown": ["initial", "offset"]}
    three = study(chain(windows=((0.0, 4.0), (4.0, 7.0), (7.0, 10.0))), record)[0]
    assert three["defaults"]["unknown"] == ["initial", "offset", "friction"]
    coarse = chain(windows=((0.0, 4.0),))
    coarse.recognised.columns["x_1"] = col("enc1", "counts", low=-500, high=500, resolution=Resolution(step=1.0))
    assert study(coarse, record)[0]["parameters"]["delta_1"] == {"guess": "0.0015 m", "min": "0.0003 m"}


def test_of_a_held_cart_only_the_sum_of_its_springs_is_seen():
    alone = moved([2.0], np.array([[500.0]]), [3.0], SQUARE, [0])[0]
    record = log(DT, enc1=np.round(METRE * 100 * alone), enc2=0 * T, u=SQUARE)
    said, text, _ = study(chain(drive=U, held=("x_2",)), record)
    given = said["parameters"]
    assert value(given["k_1"]) == pytest.approx(2.5, rel=0.1)  # one half each
    assert value(given["k_12"]) == pytest.approx(2.5, rel=0.1)
    assert given["k_12"]["assumed"]
    assert given["m_2"]["assumed"]
    assert "MEASURE: with body 2 held, only k_1 + k_12 is seen" in text
    assert said["defaults"]["held"] == ["x_2"]
    locked = study(chain(drive=U, locked=("x_2",), still=("x_1", "x_2")), record)[0]
    assert locked["defaults"] == {"locked": ["x_2"], "unknown": ["initial", "offset"]}
    assert locked["runs"][0]["initial"] == {"x_1_dot": 0}


def test_a_spring_behind_a_hand_pulls_at_the_hand():
    swing = moved([1.5], np.array([[200.0]]), [2.0], 0 * T, [0.03])[0]
    record = log(DT, enc1=0 * T, enc2=np.round(METRE * swing))
    said, text, _ = study(chain(held=("x_1",)), record)
    assert said["parameters"]["k_1"] == {"value": "0 N/m", "assumed": True}
    assert "pulls at the hand" in text
    assert "delta_1" not in said["parameters"]
    assert "delta_2" in said["parameters"]


DISKS = moved([0.009, 0.006], np.array([[2.4, -2.4], [-2.4, 2.4]]), [1e-4, 1e-4], np.where(T > 0.5, 0.5, 0), [0, 0])


def test_disks_are_drafted_in_rad_with_their_delay():
    record = log(DT, enc1=DISKS[0], enc2=DISKS[1], u=np.where(T > 0.5, 0.5, 0.0))
    of = chain("torsional-2", ("theta_1", "theta_2"), drive=U, guess="rad")
    said, _, _ = study(of, record)
    assert value(said["parameters"]["J_1"]) == pytest.approx(0.009, rel=0.1)
    assert said["actuator"]["gain"]["value"] == "1 (N m)/V"
    assert said["actuator"]["delay"] == {"guess": "2 ms", "max": "50 ms"}
    assert said["defaults"]["unknown"][0] == "initial"
    assert "offset" not in said["defaults"]["unknown"]  # nothing ties them to a place
    looped = chain("torsional-2", ("theta_1", "theta_2"), drive=U, guess="rad", loop="loop = { ki = 3 }", reference=U)
    told, _, _ = study(looped, record)
    assert "delay" not in told["actuator"]
    assert told["defaults"]["unknown"] == ["initial", "input_offset"]
    assert told["defaults"]["loop"] == {"ki": 3}
    assert "period" not in told["rig"]
    degrees = log(DT, enc1=np.degrees(DISKS[0]), enc2=np.degrees(DISKS[1]), u=record["u"])
    turned = study(chain("torsional-2", ("theta_1", "theta_2"), drive=U, guess="deg"), degrees)[0]
    assert value(turned["parameters"]["J_1"]) == pytest.approx(0.009, rel=0.1)
    counted = log(
        DT, enc1=np.round(4096 / 2 / np.pi * DISKS[0]), enc2=np.round(4096 / 2 / np.pi * DISKS[1]), u=record["u"]
    )
    turned = study(chain("torsional-2", ("theta_1", "theta_2"), drive=U), counted)[0]
    assert value(turned["parameters"]["J_1"]) == pytest.approx(0.009, rel=0.1)


def test_a_slow_chain_is_fitted_on_a_coarser_grid():
    """A period of 2 s in 120 steps would be 16.7 ms; four of the log's 2 ms are the most."""
    slow = moved([2.0], np.array([[2 * np.pi**2]]), [0.1], 0 * T, [0.02])[0]
    record = log(DT, enc1=np.round(METRE * 10 * slow))
    assert study(chain("rectilinear-1", ("x_1",)), record)[0]["rig"]["period"] == "8 ms"
    quick = moved([2.0], np.array([[500.0]]), [3.0], 0 * T, [0.02])[0]  # 0.4 s in 120 steps are 3.3 ms
    record = log(DT, enc1=np.round(METRE * 10 * quick))
    assert "period" not in study(chain("rectilinear-1", ("x_1",)), record)[0]["rig"]


def test_starts_are_plain_numbers():
    assert ChainStarts(numbers={}, braked=0.0, trips=False, limit=0.0, fastest=6.0).grounded is None
