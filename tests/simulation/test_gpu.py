"""Does a thread of a GPU step a lane as this processor does, and is what cannot be had there said in a sentence?

There is seldom a GPU at hand. The same text as one thread's work for this processor, launched through a driver made of
this machine, shows everything but what the GPU itself does with it.
"""

from __future__ import annotations

import sys
from math import exp, pi, sin

import numpy as np
import pytest

from tests.simulation.driver import Driver, code_for_here
from tests.simulation.kernel.test_interpreted import CARTS, CASES, DT, FURUTA, SAMPLES
from upright.errors import BadInput
from upright.laws import Rule, state_feedback
from upright.simulation import Simulator, choose, ensemble, gpu
from upright.simulation.kernel.compiled import Kernel
from upright.workers import Workers

CALLS = [name for name in vars(Driver) if name.startswith("cu")]
STARTS = np.column_stack([np.zeros(130), np.zeros(130), np.linspace(pi - 0.1, pi + 0.1, 130), np.zeros(130)])
LOOP = state_feedback([-0.2, -3.0, -0.1, -0.3], DT, memory=0.7, target=[0.0, pi], resolution=1e-3)


@pytest.fixture
def here(monkeypatch):
    """A driver made of this machine in place of a GPU's."""
    driver = Driver()
    monkeypatch.setattr(gpu, "door", lambda: driver)
    monkeypatch.setattr(Kernel, "ptx", code_for_here)
    return driver


def closed_loops(**more):
    """130 closed loops with dry friction and a delay, reduced: more than a block of threads holds."""
    values = {"b_1c": np.linspace(0.0, 0.02, 130), "actuator.delay": 0.003, "actuator.limit": 0.1}
    return ensemble(FURUTA, values, STARTS, None, DT, samples=SAMPLES, settle=0.02, loop=LOOP, **more)


def rows(found):
    return np.vstack([found.largest, found.error, found.saturated, found.final])


@pytest.mark.parametrize("case", CASES)
def test_a_thread_steps_a_lane_as_vectors_do(case, here):
    plant, more, loop, held = CASES[case]
    lanes = 3
    values = {**plant.parameters(), **more}
    derived = plant.derived_for(values)
    law = loop and loop(lanes)
    stepper = Simulator(
        derived=derived, flavour=choose(derived, values, held=held, loop=law), dt=DT, loop=law, held=held
    )
    x0 = np.random.default_rng(5).uniform(-0.4, 0.4, (4, lanes))
    u = 1.5 * np.sin(0.2 * np.arange(SAMPLES))[:, None]
    table = stepper.table(values, lanes)
    motions = [stepper.run(table, x0, u, samples=SAMPLES, device=device) for device in ("cpu", "gpu")]
    assert here.threads >= lanes
    assert np.ptp(motions[0], axis=0).max() > 1e-3
    # the order of additions differs: rounding, amplified a thousandfold at most over 0.12 s
    assert np.allclose(*motions, rtol=0.0, atol=1e-12)


def test_more_lanes_than_a_block_of_threads_has(here):
    cpu, there = closed_loops(), closed_loops(device="gpu")
    assert here.threads == 256
    assert rows(cpu)[4].any()  # the limit was met
    assert np.allclose(rows(cpu), rows(there), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("fails", ["", *CALLS])
def test_whatever_the_driver_refuses_is_said_and_all_memory_is_given_back(fails, here):
    here.fails = fails
    never = ("", "cuMemFree", "cuModuleUnload", "cuCtxPopCurrent")  # what only gives back
    if fails in never:
        closed_loops(device="gpu")
    else:
        with pytest.raises(BadInput, match=rf"answers CUDA_ERROR_UNKNOWN to {fails}\b.*leave device at 'cpu'\.$"):
            closed_loops(device="gpu")
    left = {"cuMemFree": len(here.memory), "cuModuleUnload": here.modules, "cuCtxPopCurrent": here.contexts}
    assert [name for name, n in left.items() if n] == [fails] * (fails in left)


def test_motions_that_do_not_fit_are_refused_with_what_to_do(here):
    here.fails, here.status = "cuMemAlloc", "CUDA_ERROR_OUT_OF_MEMORY"
    with pytest.raises(BadInput, match="give it fewer lanes at a time"):
        closed_loops(device="gpu")


def test_without_the_extra_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cuda", None)
    monkeypatch.setitem(sys.modules, "cuda.bindings", None)
    with pytest.raises(BadInput, match=r"pip install 'upright\[cuda\]', or leave device at 'cpu'\.$"):
        closed_loops(device="gpu")


def test_without_a_driver_a_gpu_is_asked_for(monkeypatch):
    class Nobody(Driver):
        def cuInit(self, flags):  # as cuda-python does where the driver's library is missing
            raise RuntimeError("libcuda.so.1 was not found.")

    monkeypatch.setattr(gpu, "door", Nobody)
    with pytest.raises(
        BadInput, match=r"needs a GPU of NVIDIA's and its driver, got: libcuda\.so\.1 was not found; or"
    ):
        closed_loops(device="gpu")


def waving(t, y, r, z, p):
    """A rule that needs the C library."""
    return (sin(t) * exp(-y[0]) ** 0.5,), ()


def test_a_rule_that_needs_the_c_library_is_refused_by_what_it_needs(monkeypatch):
    monkeypatch.setattr(gpu, "door", Driver)
    with pytest.raises(BadInput, match="a GPU has no C library, and the rule or plant needs pow of it"):
        ensemble(CARTS, {}, np.zeros(4), None, DT, samples=9, loop=Rule(function=waving), device="gpu")


def test_one_gpu_or_several_workers():
    with pytest.raises(BadInput, match="by workers or on one GPU"):
        closed_loops(device="gpu", workers=Workers(number=2))


def test_another_device_is_refused():
    with pytest.raises(BadInput, match="on device 'cpu' or 'gpu', got 'tpu'"):
        closed_loops(device="tpu")


def at_hand():
    """Whether there is a GPU with its driver, and the extra."""
    try:
        driver = gpu.door()
        return not int(driver.cuInit(0)[0]) and int(driver.cuDeviceGetCount()[1]) > 0
    except (BadInput, RuntimeError):
        return False


@pytest.mark.skipif(not at_hand(), reason="no GPU at hand")
def test_a_gpu_agrees_with_this_processor():
    cpu, there = closed_loops(), closed_loops(device="gpu")
    assert np.allclose(rows(cpu), rows(there), rtol=0.0, atol=1e-12)
