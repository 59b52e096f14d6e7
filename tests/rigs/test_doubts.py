"""Does a doubt name what is likeliest and what to look at, and is the driven body trusted only where its encoder is?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.control.watch import Suspicion
from upright.rig.makes import make_rig
from upright.rigs import Fault
from upright.rigs.doubts import Doubts

RIG = make_rig("furuta")
TURNED, SLOW = Suspicion(name="theta", factor=-1.0), Suspicion(name="psi", factor=0.5)
WEAK = Suspicion(name="the drive", factor=0.5)


@pytest.fixture
def doubts(monkeypatch):
    """Doubts of a rig whose watch and counters say what they are told."""

    def of(*, drive=False, pendulum=False, rests=False, speaks=False, likely=()):
        class Told:
            name, which = "psi", 0

            def __init__(self, model, at):
                assert (model, at) == (RIG, "inverted")

            def see(self, readings, command):
                assert (readings, command) == ([[0.1, 0.2]], 1.5)

            def sees(self, reading, away, command):
                assert (reading, away, command) == (0.3, [0.1, 0.2], 1.5)
                return drive

            @property
            def rests(self):
                return rests

            def speaks(self):
                return np.array([speaks]), np.array([0])

            def likely(self):
                return likely

        class Pendulum(Told):
            name = "theta"

            def sees(self, away):
                return pendulum

        for name, stand_in in (("Watch", Told), ("StillDrive", Told), ("StillPendulum", Pendulum)):
            monkeypatch.setattr(f"upright.rigs.doubts.{name}", stand_in)
        return Doubts(RIG, "inverted", "bench 3")

    return of


def said(doubts):
    return doubts.sees([0.3, 0.4], [0.1, 0.2], 1.5)


def test_what_moves_as_it_should_is_not_doubted(doubts):
    sound = doubts(rests=True, likely=(TURNED,))
    assert said(sound) is None
    assert not sound.body_trusted


@pytest.mark.parametrize(
    ("seen", "fault", "sentence", "trusted"),
    [
        ({"drive": True, "rests": True}, Fault.MODEL,
         "psi does not move as its command must have moved it; likeliest is that the drive gives too little, or "
         "something holds it fast. Check supply, cable and current limit.", False),
        ({"pendulum": True, "rests": True}, Fault.ENCODER,
         "theta shows not a single count although what carries it was accelerated: its encoder is dead, or something "
         "holds it fast.", True),
        ({"drive": True, "pendulum": True}, Fault.ENCODER,
         "psi shows not a single count although its command must have moved it: its encoder is dead, or something "
         "holds it fast.", False),
        ({"speaks": True, "likely": (TURNED,)}, Fault.MODEL,
         "bench 3 does not move as its model does; likeliest is theta shown the wrong way round. Check that encoder's "
         "wiring and counts (upright rig doctor); if a hand pushed it, start again.", True),
        ({"speaks": True, "likely": (WEAK, TURNED)}, Fault.MODEL,
         "bench 3 does not move as its model does; not sure why: the drive giving 0.5 times what is asked or theta "
         "shown the wrong way round. Check its supply, its cable and its current limit; if a hand pushed it, start "
         "again.", False),
        ({"speaks": True, "likely": (TURNED, SLOW)}, Fault.MODEL,
         "bench 3 does not move as its model does; not sure why: theta shown the wrong way round or psi shown 0.5 "
         "times what is true. Check that encoder's wiring and counts (upright rig doctor); if a hand pushed it, start "
         "again.", False),
        ({"speaks": True}, Fault.MODEL,
         "bench 3 does not move as its model does; not sure why. Look at supply, cables and encoders (upright rig "
         "doctor).", False),
    ],
)  # fmt: skip
def test_a_doubt_is_a_sentence_with_its_fault_and_whether_the_body_is_seen(doubts, seen, fault, sentence, trusted):
    made = doubts(**seen)
    assert said(made) == (fault, sentence)
    assert made.body_trusted == trusted


def test_behind_another_reason_stands_what_is_likeliest_or_nothing(doubts):
    assert doubts().likeliest == ""
    assert doubts(likely=(TURNED,)).likeliest.startswith(" Likeliest is theta shown the wrong way round. Check that")


def test_an_arm_that_something_holds_fast_is_not_taken_for_a_dead_encoder():
    """3 V, the arm at its count, and a pendulum that falls as one on a wall does."""
    fixed, made = RIG.plant, Doubts(RIG, "inverted", "bench 3")
    growth = math.sqrt(fixed.m_p * fixed.g * fixed.l_cg / (fixed.J_p + fixed.m_p * fixed.l_cg**2))
    count = 1 / RIG.per_unit[1]
    for k in range(round(0.5 / RIG.period)):
        lean = round(1.5 * math.exp(growth * k * RIG.period)) * count
        if told := made.sees([0.0, lean], [0.0, lean], 3.0):
            break
    assert told[0] == Fault.MODEL
    assert (
        "psi does not move as its command must have moved it; likeliest is that the drive gives too little" in told[1]
    )
