"""Does a kernel in a page compute what the processor does, to the last bit where both round every operation?"""

from __future__ import annotations

import base64
from math import pi

import numpy as np
import pytest

import upright as up
from tests.live.node import in_node, needs_node
from tests.physics.specimens import SPECIMENS
from tests.simulation.kernel.test_interpreted import CASES, DT, FURUTA, LATE, SAMPLES, linear
from upright.errors import BadInput
from upright.laws import Law, Rule, state_feedback
from upright.live.kernel import SCRIPT, described
from upright.simulation import Simulator, choose
from upright.simulation.lowering import machine, webassembly

STEPPED = """
const k = new Kernel(given.kernel), parts = [], columns = given.columns;
if (!given.spans.length) { k.run(); parts.push(...k.arrays[given.output]); }
for (const [first, end] of given.spans) {
  k.frame(first, end);
  parts.push(...k.arrays.OUT.slice(0, (end - first) * columns));
}
const out = Float64Array.from(parts);
result = Buffer.from(out.buffer).toString("base64");
"""


def stepped_in_node(simulator, params, x0, u, *, spans=()):
    """The motion (samples, columns, lanes), or what it reduces to, as Node steps it; in several spans for one lane."""
    lanes = params.shape[1]
    width = 1 if lanes == 1 else 16
    call = simulator.call(params, x0, u, samples=SAMPLES, width=width)
    out = call.out if simulator.flavour.record else call.reduced
    given = {
        "kernel": described(simulator, call, width=width), "spans": spans, "columns": out.shape[1],
        "output": "OUT" if simulator.flavour.record else "STAT",
    }  # fmt: skip
    return np.frombuffer(base64.b64decode(in_node([SCRIPT], STEPPED, given))).reshape(out.shape)[..., :lanes]


def ready(plant, more, *, loop=None, held=(), lanes=1, **choice):
    """A simulator, its table, start and input."""
    values = {**plant.parameters(), **more}
    derived = plant.derived_for(values)
    flavour = choose(derived, values, held=held, loop=loop, **choice)
    simulator = Simulator(derived=derived, flavour=flavour, dt=DT, loop=loop, held=dict(held))
    n = len(derived.coordinates)
    x0 = np.random.default_rng(5).uniform(-0.4, 0.4, (2 * n, lanes))
    x0[1] = 0.0
    u = np.where(np.arange(SAMPLES) < 40, 1.5 * np.sin(0.2 * np.arange(SAMPLES)), 0.0)
    return simulator, simulator.table(values, lanes), x0, np.repeat(u[:, None], len(derived.inputs), axis=1)


@needs_node
@pytest.mark.parametrize("lanes", [1, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("case", CASES)
def test_a_strict_kernel_gives_the_same_bits_in_a_page(case, lanes):
    plant, more, loop, held = CASES[case]
    simulator, params, x0, u = ready(plant, more, loop=loop and loop(lanes), held=held, lanes=lanes, strict=True)
    here, there = simulator.run(params, x0, u, samples=SAMPLES), stepped_in_node(simulator, params, x0, u)
    assert np.ptp(here, axis=0).max() > 1e-3
    if simulator.wasm(16).imports:  # exp and its kin are the browser's own, right to their last bit or two
        assert np.allclose(here, there, rtol=0.0, atol=1e-12)
    else:
        assert np.array_equal(here, there)


@pytest.mark.slow
@needs_node
@pytest.mark.parametrize("case", CASES)
def test_the_usual_kernel_differs_in_a_page_by_rounding_only(case):
    plant, more, loop, held = CASES[case]
    simulator, params, x0, u = ready(plant, more, loop=loop and loop(3), held=held, lanes=3)
    here, there = simulator.run(params, x0, u, samples=SAMPLES), stepped_in_node(simulator, params, x0, u)
    assert np.allclose(here, there, rtol=0.0, atol=1e-12)


@pytest.mark.slow
@needs_node
@pytest.mark.parametrize("specimen", SPECIMENS.values(), ids=SPECIMENS)
def test_every_shipped_plant_with_dry_friction_law_and_delay_gives_the_same_bits(specimen):
    plant = specimen.plant
    derived = plant.derived_for(plant.parameters())
    n, nu = len(derived.coordinates), len(derived.inputs)
    law = None
    if nu:
        gains = np.full((nu, n), -0.3)
        law = Law(
            A=0.5 * np.eye(1), B=np.full((1, n), 0.1), C=np.full((nu, 1), 0.2), D=gains,
            limit=0.4, delay=1.3, resolution=1e-3,
        )  # fmt: skip
    friction = {j.coulomb: 0.02 for j in derived.joints if j.coulomb}
    drive = {"actuator.delay": 0.0037, "actuator.lag": 0.006} if nu else {}
    simulator, params, x0, u = ready(plant, friction | drive, loop=law, strict=True)
    assert simulator.flavour.dry
    assert np.array_equal(simulator.run(params, x0, u, samples=SAMPLES), stepped_in_node(simulator, params, x0, u))


@needs_node
@pytest.mark.parametrize("case", [name for name, (_, _, _, held) in CASES.items() if not held])
def test_a_motion_that_goes_on_frame_by_frame_is_the_motion_in_one(case):
    plant, more, loop, _ = CASES[case]
    simulator, params, x0, u = ready(plant, more, loop=loop and loop(1), strict=True)
    whole = stepped_in_node(simulator, params, x0, u)
    frames = stepped_in_node(simulator, params, x0, u, spans=((0, 17), (17, 18), (18, SAMPLES)))
    assert np.array_equal(whole, frames)


@needs_node
def test_a_reduced_ensemble_is_the_processors():
    law = state_feedback([-0.2, -3.0, -0.1, -0.3], DT, memory=0.7, target=[0.0, pi], resolution=1e-3)
    simulator, params, x0, u = ready(FURUTA, {**LATE, "b_1c": 0.02}, loop=law, lanes=19, record=False, strict=True)
    assert np.array_equal(simulator.run(params, x0, u, samples=SAMPLES), stepped_in_node(simulator, params, x0, u))


@needs_node
@pytest.mark.parametrize("law", [None, linear(1)], ids=["free", "law"])
def test_a_log_that_says_strict_has_the_samples_of_a_page(law, tmp_path):
    """Another compiler's machine, without fused operations: 400 ms with dry friction and an arm that sticks."""
    plant = FURUTA.replace(b_1c=0.02)
    aside = {"theta": 0.7, "psi_dot": 0.4}
    log = up.simulate(plant, law, start=aside, seconds=(SAMPLES - 1) * DT, dt=DT, at="hanging", strict=True)
    values = plant.parameters()
    derived = plant.derived_for(values)
    simulator = Simulator(derived=derived, flavour=choose(derived, values, loop=law, strict=True), dt=DT, substeps=2,
                          loop=law)  # fmt: skip
    x0 = plant.state("hanging")[:, None] + np.array([[0.0], [0.4], [0.7], [0.0]])
    there = stepped_in_node(simulator, simulator.table(values, 1), x0, None)[:, :4, 0]
    assert np.array_equal(np.column_stack([log[name] for name in plant.state_names()]), there)
    assert "every processor gives the same samples" in log.provenance.notes[-1]
    log.to_csv(tmp_path / "log.csv")
    assert "every processor gives the same samples" in (tmp_path / "log.csv").read_text(encoding="utf-8")
    usual = up.simulate(plant, law, start=aside, seconds=0.1, dt=DT, at="hanging")
    assert not any("same samples" in note for note in usual.provenance.notes)


def test_a_motion_that_needs_the_c_library_is_not_called_strict():
    def root(t, y, r, z, p):
        return (-(abs(y[1]) ** 0.7),), ()

    with pytest.raises(BadInput, match="the C library's pow are each system's own"):
        up.simulate(FURUTA, Rule(function=root), at="hanging", seconds=0.1, dt=DT, strict=True)
    with pytest.raises(BadInput, match="strict belongs to a rig"):
        up.simulate(FURUTA.linear("hanging"), strict=True)


def test_functions_of_the_c_library_are_named():
    plant = CASES["elementary functions and kinks"][0]
    simulator, *_ = ready(plant, {})
    assert set(simulator.wasm(1).imports) <= set(webassembly.MATH)
    assert ready(FURUTA, {"b_1c": 0.02}, loop=linear(1))[0].wasm(1).imports == ()


def made(text):
    platform = machine.page_platform()
    head = f'target triple = "{platform.triple}"\ntarget datalayout = "{platform.layout}"\n'
    return machine.wasm(head + text)


def test_a_table_of_constants_is_refused():
    table = made(
        "@t = internal constant [4 x double] [double 1.0, double 5.0, double 2.0, double 9.0]\n"
        "define double @run(i32 %k) {\n  %a = getelementptr [4 x double], ptr @t, i32 0, i32 %k\n"
        "  %x = load double, ptr %a\n  ret double %x\n}\n"
    )
    with pytest.raises(BadInput, match="table of constants"):
        webassembly.linked(table, "run")


def test_a_function_that_javascript_lacks_is_refused():
    code = made("declare double @erf(double)\ndefine double @run(double %x) {\n  %y = call double @erf(double %x)\n"
                "  ret double %y\n}\n")  # fmt: skip
    with pytest.raises(BadInput, match="a page has no erf"):
        webassembly.linked(code, "run")


@needs_node
def test_a_linked_module_calls_what_it_imports():
    code = made("declare double @exp(double)\ndefine double @run(double %x) {\n  %y = call double @exp(double %x)\n"
                "  ret double %y\n}\n")  # fmt: skip
    linked = webassembly.linked(code, "run")
    assert linked.imports == ("exp",)
    body = """
    const m = new WebAssembly.Module(Buffer.from(given, "base64"));
    const env = {exp: Math.exp, __linear_memory: new WebAssembly.Memory({initial: 1}),
      __stack_pointer: new WebAssembly.Global({value: "i32", mutable: true}, 65536)};
    result = new WebAssembly.Instance(m, {env}).exports.run(1.0);
    """
    assert in_node([], body, base64.b64encode(linked.code).decode()) == pytest.approx(np.e, rel=1e-15)
