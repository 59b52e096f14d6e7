"""Does a run that is played back give the commands that were logged, to the last bit?"""

from __future__ import annotations

import numpy as np
import pytest

from tests.rigs.test_twin import LAW, RIG, started
from upright.control.trial import law_on_rig
from upright.errors import BadInput, RigStopped
from upright.records import Record
from upright.rigs import Board, Limits, Mode, ReplayPort
from upright.rigs.law import RunningLaw

TICKS = 400
REST = (0.0, np.pi)
WIDE = Limits(travel=(np.inf,) * 2, speed=(np.inf,) * 2, start=(np.inf,) * 2, command=RIG.limit, saturation=10.0)


def angles(counts):
    return [n / per for n, per in zip(counts, RIG.per_unit, strict=True)]


@pytest.fixture(scope="module")
def logged():
    """Commands of a run on the twin, and its record as it came back from a file."""
    _, board = started(Mode.HOST)
    running = RunningLaw(law_on_rig(RIG, LAW, REST), RIG.period)
    tick, rows = board.exchange(0.0), []
    for _ in range(TICKS):
        command = running.step(angles(tick.counts))
        rows.append((tick.time, command, *angles(tick.counts)))
        tick = board.exchange(command)
    t, u, psi, theta = np.array(rows).T
    return u, Record(t=t, signals={"u": u, "psi": psi, "theta": theta}, units={"u": "V"}, inputs=("u",),
                     outputs=("psi", "theta"))  # fmt: skip


def played(record, law):
    board = Board(ReplayPort(record, RIG.per_unit, 2 * RIG.limit, RIG.converter))
    board.open()
    board.clear_fault()
    board.configure(WIDE)
    board.zero()
    board.arm()
    board.start(Mode.HOST)
    running, tick, said = RunningLaw(law, RIG.period), board.exchange(0.0), []
    for k in range(TICKS):
        said.append(running.step(angles(tick.counts)))
        if k < TICKS - 1:
            tick = board.exchange(said[-1])
    with pytest.raises(RigStopped, match=f"ends after {TICKS} samples"):
        board.exchange(0.0)
    return np.array(said)


def test_the_law_that_was_logged_gives_the_same_bits(logged, tmp_path):
    commands, record = logged
    record.to_csv(tmp_path / "run.csv")
    assert played(Record.from_csv(tmp_path / "run.csv"), law_on_rig(RIG, LAW, REST)).tobytes() == commands.tobytes()


def test_another_law_is_told_from_it(logged):
    commands, record = logged
    other = law_on_rig(RIG, LAW, (0.0, np.pi + 1e-9))
    assert played(record, other).tobytes() != commands.tobytes()


def test_counts_have_to_be_known(logged):
    with pytest.raises(BadInput, match="counts for each"):
        ReplayPort(logged[1], (16_000.0,), 10.0, 1e-3)


def test_a_record_stands_still_until_the_power_stage_is_on_and_ends_with_its_last_sample():
    """Time goes on by the record's clock, here an uneven one, and by its period while the record waits."""
    t = np.array([5.0, 5.1, 5.3, 5.4])
    record = Record(t=t, signals={"u": np.zeros(4), "psi": [0.0, 0.26, 0.24, -0.26]}, units={"u": "A"}, inputs=("u",),
                    outputs=("psi",))  # fmt: skip
    port = ReplayPort(record, (10.0,), 10.04, 0.1)
    about = port.open()
    assert (about.coordinates, about.counts, about.command_unit) == (("psi",), (10.0,), "A")
    assert (about.steps, about.full_scale, about.period) == (100, pytest.approx(10.0), record.period)
    assert (about.virtual, about.hardware, about.replayed) == (True, False, True)
    for waited in (1, 2, 3):
        assert port.advance() == pytest.approx(5.0 + waited * record.period)
        assert port.read() == (0,)
    port.enable(True)
    shown = [(port.advance(), port.read()) for _ in t]
    assert [time for time, _ in shown] == pytest.approx(t + 3 * record.period)
    assert [counts for _, counts in shown] == [(0,), (3,), (2,), (-3,)]  # 2.6, 2.4 and -2.6 to the nearest
    with pytest.raises(RigStopped, match=r"The record ends after 4 samples\."):
        port.advance()
    port.enable(False)
    assert port.advance() == pytest.approx(5.4 + 4 * record.period)
