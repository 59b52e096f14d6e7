"""Does the firmware's loop compute what the project's law says, in float32?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.boards import COUNTS, STEP, STEPS, rig_on
from benchmarks.designs import LIMITS, PERIOD, inverted, pid, swing_free
from upright.errors import BadInput, RigStopped
from upright.laws import Law, state_feedback
from upright.rigs.line import TerminalLine
from upright.rigs.onboard import onboard
from upright.rigs.protocol import Capabilities, Mode
from upright.rigs.wire import Kind, Parser, pack

ABOUT = Capabilities(
    name="a board", coordinates=("psi", "theta"), counts=(COUNTS, COUNTS), command_unit="V", full_scale=STEP * STEPS,
    steps=STEPS, period=PERIOD,
)  # fmt: skip
FREE = replace(LIMITS, travel=(math.inf,) * 2, speed=(math.inf,) * 2, saturation=math.inf, command=6.0)
LAWS = {
    "inverted": inverted(),
    "inverted, plain difference": inverted(memory=0.0),
    "swing-free": swing_free(),
    "PI that stands still at its limit": pid(),
    "PI that stands still at the rig's limit": replace(pid(), limit=math.inf, C=20 * pid().C, D=20 * pid().D),
    "one reading by name": replace(
        state_feedback([3.0, 0.2], PERIOD, measured=("theta",)), initial=[0.01], begin=None, limit=math.inf
    ),
    "every third tick": state_feedback([3.0, 0.2, -5.0, -0.4], 3 * PERIOD, memory=0.5),
}


def readings(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Counts of a swing that a drive's limits cut, and references."""
    t = np.arange(samples) * PERIOD
    q = np.column_stack([0.6 * np.sin(7 * t) + 0.2 * np.sin(31 * t), 0.3 * np.cos(9 * t) - 0.25])
    return np.floor(q * COUNTS + 0.5).astype(int), np.round(0.4 * np.sign(np.sin(3 * t)), 3)


def told(host, law, q, references):
    """Commands of the firmware's loop in steps for encoders that are moved by hand."""
    board = host()
    rig = board.rig()
    rig.open()
    rig.clear_fault()
    rig.configure(FREE)
    rig.arm()
    rig.start(Mode.MCU, law)
    out = []
    for (first, second), r in zip(q.tolist(), references.tolist(), strict=True):
        board.do(f"counts {first} {second}")
        tick = rig.exchange(r)
        assert tick.mode == Mode.MCU
        out.append(round(tick.applied / STEP))
    out.append(round(rig.exchange(0.0).applied / STEP))
    return np.array(out[1:])  # a sample tells the command that was put out until then


def in_float32(law, q, references, most, about=ABOUT):
    """The law written out, every product and sum rounded to float32, entries that are zero skipped."""
    f, b = np.float32, onboard(law, about, PERIOD)
    z, out, u = None, [], 0
    limit = min(f(b.limit), f(most))
    with np.errstate(over="ignore"):
        for k, (counts, r) in enumerate(zip(q, references, strict=True)):
            if k % b.every == 0:
                w = [f(c) - t for c, t in zip(counts, b.target, strict=True)]
                if z is None:
                    z = [f(v) for v in b.initial]
                    for i in range(4):
                        for j in range(2):
                            z[i] = z[i] + b.begin[i, j] * w[j]
                given, new = [*z, *w, f(r)], []
                for row in b.matrix:
                    total = f(0.0)
                    for entry, value in zip(row, given, strict=True):
                        if entry:
                            total = total + entry * value
                    new.append(total)
                asked = math.floor(new[4] + f(0.5))
                z = [
                    old if abs(asked) > limit and b.held_sums >> i & 1 else v
                    for i, (old, v) in enumerate(zip(z, new[:4], strict=True))
                ]
                u = max(-int(limit), min(int(limit), asked))
            out.append(u)
    return np.array(out)


@pytest.mark.parametrize("name", LAWS)
def test_commands_are_those_of_the_law_in_float32_to_the_last_step(host, name):
    law, (q, r) = LAWS[name], readings(400)
    r = r if law.signal().shape[1] else 0.0 * r
    most = math.floor(FREE.command / STEP)
    expected = in_float32(law, q, r, most)
    assert np.array_equal(told(host, law, q, r), expected)

    every = onboard(law, ABOUT, PERIOD).every
    whole = law.over(ABOUT.coordinates, 1) if law.measured else law
    limit = math.floor(min(law.limit, FREE.command) / STEP + 1e-9) * STEP
    references = r[::every] if law.signal().shape[1] else None
    double = replace(whole, command_resolution=STEP, limit=limit, references=references)
    exact, memory = double.follow(q[::every] / COUNTS)
    assert len(np.unique(exact)) > 10
    apart = np.abs(expected[::every] - exact[:, 0] / STEP).max()
    assert apart <= 1.0 + rounding(double, memory, q[::every] / COUNTS, references)


def rounding(law, memory, y, references):
    """Bound on what float32 adds to a command [steps], which besides may be tipped to the next step.

    Each of at most 8 products and sums in a row is off by 2^-24 of the sizes added; what a memory is off stays in it
    for 1/(1 - a) samples with a, the largest eigenvalue of the sizes in A, or for all of them when it is a sum.
    """
    w = np.abs(y - np.asarray(law.target))
    w = w if references is None else np.column_stack([w, np.abs(references)])
    A, B, C, D = (np.abs(M) for M in (law.A, law.B, law.C, law.D))
    command = np.abs(memory) @ C.T + w @ D.T
    kept = (np.abs(memory) @ A.T + w @ B.T) @ C.T
    a = max(np.abs(np.linalg.eigvals(A)), default=0.0)
    stays = 1.0 / (1.0 - a) if a < 0.999 else len(y)
    bound = 8 * 2.0**-24 * (command.max() + stays * kept.max()) / STEP
    assert bound < 30  # of 32767
    return bound


def test_a_law_is_compared_bit_by_bit_with_what_the_board_holds(host):
    class Forgetful:
        """A line that changes one bit of what comes back of a law, its CRC with it."""

        def __init__(self, port):
            self.name, self._line, self._parser = port, TerminalLine(port), Parser()

        def write(self, data):
            self._line.write(data)

        def read(self, patience):
            out = b""
            for f in self._parser.feed(self._line.read(patience)):
                body = f.body
                if f.answers(Kind.LAW):
                    body = body[:50] + bytes([body[50] ^ 1]) + body[51:]
                out += pack(f.kind, f.sequence, f.session, body)
            return out

        def close(self):
            self._line.close()

    board = host()
    rig = rig_on(Forgetful(board.port))
    rig.open()
    rig.clear_fault()
    rig.configure(FREE)
    rig.arm()
    with pytest.raises(RigStopped, match="another law"):
        rig.start(Mode.MCU, inverted())
    assert board.state()[5:7] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("law", "why"),
    [
        (Law(np.zeros((5, 5)), np.zeros((5, 2)), np.zeros((1, 5)), np.ones((1, 2))), "room for 4 memories"),
        (Law(np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((1, 0)), np.ones((1, 3))), "reads 3 coordinates"),
        (Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.ones((2, 2))), "room for 1 commands"),
        (
            Law(np.zeros((0, 0)), np.zeros((0, 4)), np.zeros((1, 0)), np.ones((1, 4)), reference_names=("a", "b")),
            "room for 1 references",
        ),
        (replace(inverted(), period=0.884e-3), "0.884 ms"),
        (replace(inverted(), period=0.3), "300 ms"),
        (replace(inverted(), measured=("psi", "alpha")), "reads alpha"),
        (replace(inverted(), limit=1e-5), "converter's step"),
        (state_feedback(np.ones((1, 4, 2)), PERIOD), "several lanes"),
    ],
)
def test_a_law_that_does_not_fit_is_refused_in_a_sentence(law, why):
    with pytest.raises(BadInput, match=why):
        onboard(law, ABOUT, PERIOD)


def test_counts_with_a_sign_turn_the_law_about(host):
    turned = replace(ABOUT, counts=(COUNTS, -COUNTS))
    one, other = onboard(inverted(), ABOUT, PERIOD), onboard(inverted(), turned, PERIOD)
    w = np.array([3.0, -7.0])
    assert np.array_equal(one.matrix[:, 4:6] @ w, other.matrix[:, 4:6] @ (w * [1.0, -1.0]))
