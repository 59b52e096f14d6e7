"""Does the firmware keep the protocol that every rig keeps?"""

from __future__ import annotations

import pytest

from benchmarks.boards import PicoLine, plant, rig_on
from benchmarks.designs import GAIN, PARAMETERS
from tests.firmware.test_pwm import MEGA_STEP, SUPPLY
from tests.rigs import conformance

HANGING = plant(PARAMETERS, GAIN)


SLOW = [pytest.param(drive, marks=pytest.mark.slow) for drive in ("analog", "pair", "sign")]


@pytest.fixture(params=["host", *SLOW])
def specimen(request):
    """Firmware on the host, and on the ATmega2560 in simavr."""
    start, boards = request.getfixturevalue("host" if request.param == "host" else "avr"), {}
    how, bridge = {}, request.param in ("pair", "sign")
    if request.param != "host":
        how["drive"] = request.param

    def make():
        board = start(*HANGING, *([f"step={MEGA_STEP!r}"] if bridge else []), **how)
        rig = board.rig(lockstep=True, **({"full_scale": SUPPLY} if bridge else {}))
        boards[rig] = board
        return rig

    def silence(rig, seconds):
        boards[rig].do(f"run {round(seconds / 1e-3)}")

    return conformance.Specimen(name=request.param, make=make, silence=silence)


@pytest.fixture(params=["pair", "sign"])
def on_a_pico(request, pico):
    boards = {}

    def make():
        board = pico(request.param)
        rig = rig_on(lambda: PicoLine(board), lockstep=True, full_scale=SUPPLY)
        boards[rig] = board
        return rig

    def silence(rig, seconds):
        boards[rig].do(f"run {round(seconds / 1e-3)}")

    return conformance.Specimen(name=request.param, make=make, silence=silence)


@pytest.mark.slow
class TestPico(conformance.Conformance):
    """All rules, on the Pico's own image in rp2040js."""

    @pytest.fixture
    def specimen(self, on_a_pico):
        return on_a_pico


class TestFirmware(conformance.Conformance):
    """All rules, on the host and on the ATmega2560 with a converter and with either kind of H-bridge."""
