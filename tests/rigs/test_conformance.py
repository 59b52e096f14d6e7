"""Do all rigs keep the protocol? The twin and a replay; firmware and boards join the list."""

from __future__ import annotations

import numpy as np
import pytest

from tests.rigs.conformance import Conformance, Specimen
from upright.records import Record
from upright.rig.makes import make_rig
from upright.rigs import Board, ReplayPort, TwinPort

FURUTA, SHAFT, CART = (make_rig(key) for key in ("furuta", "torsional", "linear"))


def replay():
    t = np.arange(3000) * FURUTA.period
    psi = 0.05 * np.sin(8 * t)
    record = Record(t=t, signals={"u": 0 * t, "psi": psi, "theta": -psi}, units={"u": "V"}, inputs=("u",),
                    outputs=("psi", "theta"))  # fmt: skip
    return Board(ReplayPort(record, FURUTA.counts, full_scale=10.0, step=FURUTA.converter))


def twin(rig):
    return Specimen(name=rig.name, make=lambda: Board(TwinPort(rig)), silence=lambda r, s: r.alone(s))


SPECIMENS = [twin(FURUTA), twin(SHAFT), twin(CART), Specimen(name="replay", make=replay, moves=False)]


@pytest.fixture(params=SPECIMENS, ids=lambda s: s.name)
def specimen(request):
    return request.param


class TestEveryRig(Conformance):
    """All rules on all rigs."""
