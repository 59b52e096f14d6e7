"""Is each thing that the log of a chain shows (carts or disks, held or free, where it swings) told at its limit?"""

from __future__ import annotations

import numpy as np
import pytest

from tests.study.draft.test_recognise import col, log, resting
from upright.errors import BadInput
from upright.readers import inspect
from upright.readers.resolution import Resolution
from upright.records import Provenance, Record
from upright.study.draft.chain_log import (
    ChainLog,
    chain_kind,
    follows,
    held_bodies,
    read_chain,
    releases,
    still_bodies,
    widest,
    zero_at,
)
from upright.study.draft.recognise import recognise

N = 400
OUT = np.r_[np.zeros(100), np.linspace(0, 1000, 200), np.full(100, 1000.0)]  # goes away and stays
BACK = np.r_[np.zeros(100), 1000 * np.sin(np.linspace(0, np.pi, 200)), np.zeros(100)]
SHORT = np.r_[np.zeros(100), np.linspace(0, 1000, 150), np.linspace(1000, 290, 50), np.full(100, 290.0)]
LONG = np.r_[np.zeros(100), np.linspace(0, 1000, 150), np.linspace(1000, 310, 50), np.full(100, 310.0)]
DRIFTS = np.r_[OUT[:300], 1000 + np.linspace(-12, 12, 100)]
PULSE = np.r_[np.zeros(100), np.ones(100), np.zeros(200)]
ON = np.r_[np.zeros(100), np.ones(300)]
CAME_BACK = ("rectilinear", "they return to where they began")
ELSEWHERE = ("torsional", "they come to rest elsewhere, where springs would pull carts back")


@pytest.mark.parametrize(
    ("guess", "name", "x", "u", "against", "path", "kind"),
    [
        ("rad", "e1", BACK, PULSE, False, "", ("torsional", "they are angles")),
        ("deg", "e1", BACK, None, False, "", ("torsional", "they are angles")),
        ("m", "e1", 20 * OUT, PULSE, False, "disks/", ("rectilinear", "they are lengths")),
        ("mm", "disk1", OUT, None, False, "", ("rectilinear", "they are lengths")),
        ("counts", "e1", 16.001 * BACK, None, False, "", ("torsional", "16001 counts are more than a cart can travel")),
        ("counts", "e1", 15.999 * BACK, None, False, "", CAME_BACK),
        ("counts", "disc 1", BACK, None, False, "", ("torsional", "the columns are called so")),
        ("counts", "e1", OUT, PULSE, False, "", ELSEWHERE),
        ("counts", "e1", OUT, None, False, "", CAME_BACK),  # nothing drove it: a hand did
        ("counts", "e1", OUT, ON, False, "", CAME_BACK),  # the command holds it there
        ("counts", "e1", OUT, -ON, False, "", ELSEWHERE),
        ("counts", "e1", OUT, ON, True, "", ELSEWHERE),
        ("counts", "e1", OUT, -ON, True, "", CAME_BACK),
        ("", "c1", OUT, PULSE, False, "", CAME_BACK),
        ("counts", "e1", SHORT, PULSE, False, "", CAME_BACK),
        ("counts", "e1", LONG, PULSE, False, "", ELSEWHERE),
        # an encoder may have begun to count anywhere
        ("counts", "e1", OUT - 3000, ON, False, "", CAME_BACK),
        ("counts", "e1", OUT - 3000, -ON, False, "", ELSEWHERE),
        ("counts", "e1", 3000 - OUT, ON, True, "", CAME_BACK),
        ("counts", "e1", -LONG, PULSE, False, "", ELSEWHERE),
        ("counts", "e1", DRIFTS, PULSE, False, "", ELSEWHERE),  # the last twentieth drifts by 0.5 %
        ("counts", "e1", np.r_[OUT[:380], 1000 + np.linspace(0, 30, 20)], PULSE, False, "", CAME_BACK),
        ("counts", "e1", BACK, PULSE, False, "torsion/log.csv", ("torsional", "the file or its folder is called so")),
        ("counts", "e1", BACK, PULSE, False, "ecp205.csv", ("torsional", "the file or its folder is called so")),
        ("counts", "e1", BACK, PULSE, False, "torsion/ecp210.csv", CAME_BACK),
    ],
)
def test_carts_are_told_from_disks(guess, name, x, u, against, path, kind):
    signals = {name: x} | ({} if u is None else {"u": u})
    record = log(**signals)
    drive = None if u is None else col("u", "V")
    assert chain_kind(record, [col(name, guess)], drive, against, path) == kind


def test_the_widest_body_moves_most():
    record = log(a=OUT, b=-2 * BACK, c=OUT + 5000)
    assert widest(record, [col(n) for n in "abc"]) is record["b"]


def test_a_body_is_held_below_a_fifth_of_the_widest_and_locked_within_two_steps():
    bodies = [("a", 500.0), ("b", 101.0), ("c", 99.0), ("d", 1.01), ("e", 0.99)]
    rise = np.clip(np.arange(N) - 100, 0, 100) / 50
    record = log(**{name: size * rise for name, size in bodies})
    columns = [col(name, "counts", resolution=Resolution(step=1.0)) for name, _ in bodies]
    names = [f"x_{i}" for i in range(1, 6)]
    assert held_bodies(record, columns, names, [(1.0, 2.0)]) == (("x_3", "x_4"), ("x_5",))
    # within a stretch, and within all of them
    first = np.where(np.arange(N) < 200, 3 * rise, 6.0)
    record = log(a=500 * rise, b=500 * first)
    assert held_bodies(record, columns[:2], names[:2], [(2.5, 3.0)]) == ((), ("x_1", "x_2"))
    assert held_bodies(record, columns[:2], names[:2], [(1.0, 1.5), (2.5, 3.0)]) == ((), ())


def test_a_column_without_steps_is_locked_only_where_it_does_not_move():
    record = log(a=OUT, b=1e-5 * OUT, c=0 * OUT)
    columns = [col("a", "m"), col("b", "m"), col("c", "m")]
    assert held_bodies(record, columns, ["x_1", "x_2", "x_3"], [(0, 4)]) == (("x_2",), ("x_3",))


@pytest.mark.parametrize(
    ("before", "high", "step", "still"),
    [
        (3.0, 100.0, 1.0, True),
        (3.1, 100.0, 1.0, False),
        (3.1, 700.0, 1.0, True),
        (3.6, 700.0, 1.0, False),
        (0.4, 100.0, 0.0, True),
        (0.6, 100.0, 0.0, False),
    ],
)
def test_a_body_lies_still_that_creeps_by_three_steps_or_half_a_percent(before, high, step, still):
    """In the 0.2 s before the command at 1 s, that sample included; what it did before is nothing."""
    x = np.zeros(N)
    x[:79] = 50.0
    x[100] = before
    x[101:] = high
    record = log(x=x)
    column = col("x", "counts", low=0.0, high=high, resolution=Resolution(step=step))
    assert still_bodies(record, {"x_1": column}, 100) == (("x_1",) if still else ())


def test_the_fifth_of_a_second_before_a_command_begins_with_its_first_sample():
    x = np.zeros(N)
    x[:80] = 50.0
    column = col("x", "counts", low=0.0, high=50.0)
    record = log(1 / 64, x=x)  # 12.8 samples
    assert still_bodies(record, {"x_1": column}, 92) == ("x_1",)
    assert still_bodies(record, {"x_1": column}, 91) == ()
    assert still_bodies(record, {"x_1": column}, 5) == ("x_1",)


def test_zero_is_before_the_command_or_the_middle_of_the_end_of_a_stretch():
    x = np.r_[7.0, np.full(40, 1.0), np.full(49, 3.0), np.arange(310.0)]
    record = log(x=x)
    assert zero_at(record, col("x"), (0, 3.9), 90, driven=True) == 3.0  # 49 of the last fifty
    assert zero_at(record, col("x"), (0, 3.9), 65, driven=True) == 1.0  # 24 of the last fifty
    assert zero_at(record, col("x"), (0, 3.9), 5, driven=True) == 1.0
    assert zero_at(record, col("x"), (0, 3.9), 4, driven=True) == 7.0
    # of the stretch from 1 to 3 s the last 0.6 s, samples 240 to 300, which read 150 to 210
    assert zero_at(record, col("x"), (1.0, 3.0), 90, driven=False) == 180.0


def swings(size: float, halves: int, half: float, dt: float = 0.005, loss: float = 0.01) -> np.ndarray:
    """Half swings from rest at `size`, each a cosine and one hundredth smaller than the one before."""
    out = []
    for k in range(halves):
        s = np.arange(dt, half + dt / 2, dt) / half
        a, b = size * (1 - loss) ** k, -size * (1 - loss) ** (k + 1)
        out.append((-1) ** k * (a + (b - a) * (1 - np.cos(np.pi * s)) / 2))
    return np.concatenate(out)


LEAVES = np.arccos(0.96) / np.pi
"""Halves of a swing after which a cosine has gone 2 % of its way."""


def stretch(begin: float, end: float, half: float) -> tuple[float, float]:
    """From a quarter of a half swing after the body has left the hand; as it is judged to leave each turn."""
    return begin + half * (LEAVES + 0.25 * (1 - LEAVES)), end


@pytest.mark.parametrize("sign", [1, -1])
def test_each_release_is_a_stretch_from_the_hand_to_the_hand(sign):
    """Held to 1 s, six halves of 0.5 s; pulled further from 4 s on, held to 5 s, six halves; the log ends in a turn."""
    dt, half = 0.005, 0.5
    first, second = swings(100, 6, half), swings(150, 6, half)
    pull = first[-1] + (150 - first[-1]) * (1 - np.cos(np.pi * np.arange(1, 101) / 100)) / 2
    x = np.r_[np.full(201, 100.0), first, pull, np.full(100, 150.0), second]
    t = dt * np.arange(x.size)
    found = releases(t, sign * x)
    assert len(found) == 2
    # the trough before the pull is the last turn; the body leaves it for the hand as it would swing
    assert found[0] == pytest.approx(stretch(1.0, 3.5 + LEAVES * 0.5, half), abs=0.03)
    assert found[1] == pytest.approx(stretch(5.0, 8.0, half), abs=0.02)


@pytest.mark.parametrize(("halves", "count"), [(3, 0), (4, 1), (5, 1)])
def test_four_halves_make_a_free_swing(halves, count):
    x = np.r_[np.full(200, 100.0), swings(100, halves, 0.5)]
    assert len(releases(0.005 * np.arange(x.size), x)) == count


def test_a_swing_that_grows_or_changes_its_period_is_a_hand():
    t = 0.005 * np.arange(1000)
    assert releases(t, np.exp(0.2 * t) * np.cos(2 * np.pi * t)) == []
    uneven = np.concatenate([np.full(200, 100.0), *(sign * swings(100 * 0.98**k, 1, half)
                            for k, (sign, half) in enumerate([(1, 0.5), (-1, 0.9)] * 4))])  # fmt: skip
    assert releases(0.005 * np.arange(uneven.size), uneven) == []


def test_noise_that_turns_from_sample_to_sample_does_not_swing():
    x = np.r_[np.full(200, 100.0), 100 * 0.9 ** np.arange(12) * (-1.0) ** np.arange(12), np.zeros(200)]
    assert releases(0.005 * np.arange(x.size), x) == []


@pytest.mark.parametrize(("half", "count"), [(0.1, 1), (0.3, 2)])
def test_what_lasts_less_than_three_tenths_of_the_longest_swing_is_a_hand_that_shakes(half, count):
    slow, quick = swings(100, 6, 0.5), swings(160, 6, half)
    pull = slow[-1] + (160 - slow[-1]) * (1 - np.cos(np.pi * np.arange(1, 301) / 300)) / 2
    x = np.r_[np.full(200, 100.0), slow, pull, quick, np.full(3, quick[-1])]
    assert len(releases(0.005 * np.arange(x.size), x)) == count


@pytest.mark.parametrize(
    ("u", "x", "at", "up"),
    [
        ([0, 0, 0, 1, 1, 1, 1, 1], [0, 0, 0, 0, 0, 2, 3, 4], 3, True),
        ([0, 0, 0, 1, 1, 1, 1, 1], [0, 0, 0, 0, 0, -2, -3, -4], 3, False),
        ([0, 0, 0, -1, -1, -1, -1, -1], [0, 0, 0, 0, 0, -2, -3, -4], 3, True),
        ([0, 0, 0, 1, 1, 1, 1, 1], [5, 5, 5, 5, 5, 5, 5, 5], 3, True),  # does not move: not against
        ([5, 5, 5, 4, 4, 4, 4, 4], [0, 0, 0, 0, 0, 2, 3, 4], 3, False),  # down from 5
        ([5, 5, 4, 4, 4, 4, 4, 4], [0, 0, 0, 0, 0, 2, 3, 4], 2, True),  # a log that begins with it
        ([0, 0, 0, 1, 1, 1, 1, 1], [0, 0, 0, 0, -0.11, 1, 3, 4], 3, True),  # under 3 % is none
        ([0, 0, 0, 1, 1, 1, 1, 1], [0, 0, 0, 0, -0.14, 1, 3, 4], 3, False),
        ([0, 0, 0, 1, 1, 1, 1, -9], [0, 0, 0, 0, 0, 0, 2, 4], 3, True),  # later commands are later
    ],
)
def test_a_body_follows_the_command_that_comes_before_its_motion(u, x, at, up):
    assert follows(0.01 * np.arange(8), np.array(u, dtype=float), np.array(x, dtype=float), at) is up


def test_a_motion_more_than_two_seconds_after_a_command_tells_nothing():
    u = np.r_[np.zeros(4), np.ones(46)]
    for k, up in ((15, False), (16, True)):
        x = np.where(np.arange(50) >= 4 + k, -1.0, 0.0)
        assert follows(0.125 * np.arange(50), u, x, 4) is up


def chain(*, named: bool = False, plant: str = "", path: str = "", notes: tuple[str, ...] = (), rests=None, **signals):
    record = log(**signals)
    record = Record(t=record.t, signals=record.signals, provenance=Provenance(notes=notes))
    seen = inspect(record) if rests is None else resting(record, *rests)
    return read_chain(record, seen, recognise(record, seen, plant), named=named, path=path)


T = 0.01 * np.arange(1000)
DAC = np.where((T >= 1.0) & (T < 4.0), 409.0, 0.0)
GO = np.clip(T - 1.05, 0, 3)
DISK = np.round(2000 * GO + 90 * np.sin(9 * GO) * np.exp(-GO))
SECOND = np.round(1900 * GO - 150 * np.sin(9 * GO) * np.exp(-GO))


def test_disks_driven_by_a_pulse_are_read_as_a_whole():
    found = chain(enc1=DISK + 40, enc2=SECOND - 20, target=DAC)
    shown = found.recognised
    assert isinstance(found, ChainLog)
    assert shown.plant == "torsional-2"
    assert found.disks
    assert {n: c.name for n, c in shown.columns.items()} == {"theta_1": "enc1", "theta_2": "enc2"}
    assert shown.rest == {"theta_1": 40.0, "theta_2": -20.0}
    assert shown.drive is not None
    assert (shown.drive.name, shown.reversed, shown.mirrored) == ("target", False, False)
    assert (found.held, found.locked, found.fixed, found.reference, found.loop) == ((), (), (), None, "")
    assert found.still == ("theta_1", "theta_2")
    assert found.windows == (pytest.approx((0.94, found.windows[0][1])),)  # 50 ms and a sample before the command
    assert shown.window == found.windows[0]
    assert shown.doubts[0] == (
        "Counts of 2 encoders were taken for a torsional chain, since they come to rest elsewhere, where springs would"
        " pull carts back; otherwise --plant rectilinear-2."
    )
    back = chain(enc1=-DISK, enc2=-SECOND, target=DAC)
    assert back.recognised.reversed
    assert not chain(enc1=DISK, enc2=SECOND, target=DAC, named=True, plant="rectilinear-2").disks


@pytest.mark.parametrize(
    ("rests", "plant", "end"),
    [
        ([(0, 0.9), (6.0, 9.99)], "torsional-2", 6.5),
        ([(0, 0.9), (6.0, 9.99)], "rectilinear-2", 9.99),  # where springs leave a cart tells its friction
        ([(0, 0.9), (6.0, 9.5)], "torsional-2", 6.5),
        ([(0, 0.9), (6.0, 9.4)], "torsional-2", 9.99),  # they moved again
        ([(0, 0.9), (9.8, 9.99)], "torsional-2", 9.99),
        ([(0, 0.9), (1.9, 9.99)], "torsional-2", 9.99),  # hardly anything before it
        ([(0, 0.9), (2.0, 9.99)], "torsional-2", 2.5),
        ([], "torsional-2", 9.99),
    ],
)
def test_a_driven_stretch_of_disks_ends_half_a_second_after_they_stopped(rests, plant, end):
    found = chain(enc1=DISK, enc2=SECOND, target=DAC, named=True, plant=plant, rests=rests)
    assert found.windows[0] == pytest.approx((0.94, end))


def test_a_command_from_the_first_sample_on_begins_the_stretch():
    early = chain(enc1=DISK[105:], enc2=SECOND[105:], target=DAC[102:-3])
    assert early.windows[0][0] == 0.0


def test_bodies_that_hardly_move_are_held_and_those_that_do_not_are_locked():
    found = chain(enc1=DISK, enc2=np.round(0.05 * SECOND + 30 * np.sin(T)), enc3=np.full(1000, 7.0), target=DAC)
    assert found.recognised.plant == "torsional-3"
    assert (found.held, found.locked, found.fixed) == (("theta_2",), ("theta_3",), ("theta_2", "theta_3"))
    assert found.recognised.doubts[-2:] == (
        "theta_2 hardly moves: it was taken for held by hand, and its measured motion is prescribed.",
        "theta_3 does not move: it was taken for locked.",
    )


def test_what_a_board_reads_beside_the_encoders_is_no_body():
    """A second or third input that stays 0, a copy, and what is called like nothing that turns."""
    found = chain(enc1=DISK, enc2=SECOND, enc3=0 * T, enc4=DISK, level=np.full(1000, 7.0), target=DAC)
    assert list(found.recognised.columns) == ["theta_1", "theta_2"]
    alone = chain(enc1=DISK, enc2=0 * T, target=DAC)
    assert alone.recognised.plant == "torsional-2"
    assert alone.locked == ("theta_2",)


def test_a_plant_of_other_bodies_than_the_log_has_is_refused_with_their_names():
    with pytest.raises(BadInput, match=r"torsional-3 has 3 bodies, and 2 columns of .* \(enc1, enc2\); choose another"):
        chain(enc1=DISK, enc2=SECOND, target=DAC, named=True, plant="torsional-3")
    with pytest.raises(BadInput, match=r"rectilinear-2 has 2 bodies, and 1 column of .* \(enc1\)"):
        chain(enc1=DISK, target=DAC, named=True, plant="rectilinear-2")


FREE = np.round(np.r_[np.full(200, 900.0), swings(900, 8, 0.5, dt=0.01), np.zeros(400)])


def test_the_free_swings_of_a_log_without_a_command_are_its_stretches():
    found = chain(enc1=FREE, enc2=np.round(0.1 * FREE + np.arange(1000) % 2))
    assert found.recognised.drive is None
    assert len(found.windows) == 1
    assert found.windows[0][0] == pytest.approx(2.0, abs=0.03)  # where the hand lets go
    assert found.held == ("x_2",)
    assert found.still == ()
    assert found.recognised.doubts[0].endswith("since they return to where they began; otherwise --plant torsional-2.")


def test_a_reference_is_a_stepping_column_that_is_called_so():
    steps = np.where((T >= 1) & (T < 4), 1000.0, 0.0)
    found = chain(enc1=FREE, target=steps)
    assert found.reference is not None
    assert found.reference.name == "target"
    assert found.recognised.drive is None
    assert "Column 'target' is what a loop was to follow" in found.recognised.doubts[1]
    assert chain(enc1=FREE, target=0 * T).reference is None
    many = 300.0 * (np.arange(1000) // 70)
    assert chain(enc1=FREE, target=many, named=True, plant="rectilinear-1").reference is None  # 14 steps are none


def test_a_command_of_a_loop_whose_gains_are_zero_was_none():
    asleep = ("runParameters: P_gain = 0, I_gain = 0, D_gain = 0.",)
    weak = ("runParameters: P_gain = 0.5, I_gain = 0, D_gain = 0.",)
    u = np.where(T > 3, 0.3, 0.0)
    found = chain(enc1=FREE, voltage=u, notes=asleep)
    assert found.recognised.drive is None
    assert "Column 'voltage' was left out: the gains of its loop are zero, so nothing was commanded." in (
        found.recognised.doubts
    )
    awake = chain(enc1=FREE, voltage=u, notes=weak).recognised.drive
    assert awake is not None
    assert awake.name == "voltage"
    counts = chain(enc1=DISK, enc2=SECOND, target=DAC, notes=asleep).recognised.drive
    assert counts is not None  # converter counts went out


def test_a_column_of_another_kind_is_counted_as_the_bodies_are():
    """What stands still says neither unit nor kind; it takes the kind of what moves."""
    found = chain(disk1=DISK, disk2=np.full(1000, 3.5), target=DAC)
    assert {c.guess for c in found.recognised.columns.values()} == {"counts"}
