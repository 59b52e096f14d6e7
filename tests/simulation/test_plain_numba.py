"""Does the kernel give the same motion when it keeps to what Numba documents?"""

from __future__ import annotations

import llvmlite.ir
import numpy as np
import pytest

from tests.simulation.conftest import FURUTA
from upright.simulation import Simulator, choose
from upright.simulation.kernel.compiled import direct, source
from upright.simulation.kernel.flavour import Layout

FRICTION = {**FURUTA, "b_1c": 0.2, "b_2c": 0.02}


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [1, 20])
def test_plain_text_gives_the_same_motion(rotary, lanes):
    x0 = np.random.default_rng(7).uniform(-1.0, 1.0, (4, lanes))
    x0[3] = 0.0
    flavour = choose(rotary, FRICTION)
    paths = []
    for plain in (False, True):
        s = Simulator(derived=rotary, flavour=flavour, dt=1e-3, substeps=2, plain=plain)
        paths.append(s.run(s.table(FRICTION, lanes), x0, samples=401))
    assert (paths[0][200:, 1::2] == 0.0).any()  # something stuck meanwhile
    # the order of additions may differ: rounding, amplified over 0.4 s
    assert np.allclose(*paths, rtol=0, atol=1e-11)


def test_plain_text_does_not_touch_the_code_generator(rotary):
    text = source(Layout(derived=rotary, flavour=choose(rotary, FRICTION), plain=True))
    assert not any(word in text for word in ("llvmlite", "intrinsic", "ctypes", "address"))


def test_another_code_generator_is_noticed(monkeypatch):
    assert isinstance(direct(), bool)
    try:
        direct.cache_clear()
        monkeypatch.delattr(llvmlite.ir.IRBuilder, "inttoptr")
        assert not direct()
    finally:
        direct.cache_clear()
