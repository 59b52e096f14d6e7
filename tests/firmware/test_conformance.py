"""Does the firmware keep the protocol that every rig keeps?"""

from __future__ import annotations

import pytest

from benchmarks.boards import plant
from benchmarks.designs import GAIN, PARAMETERS
from tests.rigs import conformance

HANGING = plant(PARAMETERS, GAIN)


@pytest.fixture(params=["host", pytest.param("avr", marks=pytest.mark.slow)])
def specimen(request):
    start, boards = request.getfixturevalue(request.param), {}

    def make():
        board = start(*HANGING)
        rig = board.rig(lockstep=True)
        boards[rig] = board
        return rig

    def silence(rig, seconds):
        boards[rig].do(f"run {round(seconds / 1e-3)}")

    return conformance.Specimen(name=request.param, make=make, silence=silence)


class TestFirmware(conformance.Conformance):
    """All rules, on the host and on the ATmega2560."""
