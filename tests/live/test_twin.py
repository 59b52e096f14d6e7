"""Does the twin in a page do what the rig's own simulation does, and tell the share that `chance` tells?"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from scipy.signal import place_poles

import upright as up
from tests.live.node import in_node, needs_node
from tests.physics.specimens import SPECIMENS
from upright.control.preflight import Task
from upright.control.score import outcomes
from upright.control.trial import trial
from upright.designing.run import velocities
from upright.gains import feedback
from upright.live import SCRIPTS
from upright.live.twin import Loop, moving
from upright.physics.outline import in_javascript
from upright.rig.completion import completed
from upright.rig.variation import allowed

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=0.003, b_2=2e-4, b_1c=0.008, b_2c=3e-4)
RIG = completed(up.Rig.known(ARM, gain="0.65 N m/V", limit="3 V", period="2 ms", counts=4096, travel="120 deg"))
POLES = [-4 + 2j, -4 - 2j, -17, -3]


def loop(rig, poles):
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, rig.delay / rig.period)
    K = place_poles(model.A, model.B, poles).gain_matrix
    way = velocities(model, sampled, "filtered", 0.5, rig.limit, rig.resolution)
    return Loop(estimator=way, K=K, law=feedback(way, K))


def page(rig, start, *, lanes=40, seed=3, seconds=2.0):
    task = Task(start=start, seconds=seconds, hand=(0.0, 0.0, 0.02, 0.1))
    others = allowed(rig, lanes, seed)
    return task, others, moving(rig, loop(rig, POLES), task, others=others, lanes=lanes, seed=seed)


@needs_node
def test_the_twin_moves_as_a_trial_of_the_same_law():
    start = (0.0, 0.0, math.radians(8), 0.0)
    _, _, data = page(RIG, start)
    body = "const t = new Twin(given); result = [37, 200, 263].flatMap((n) => t.advance(n)).map((r) => [...r]);"
    there = np.array(in_node(SCRIPTS, body, data))
    here = trial(RIG, loop(RIG, POLES).law, at="inverted", start=start, seconds=1.2)
    # machine code here fuses multiply and add, and counts amplify rounding: half a second is compared
    assert np.allclose(there[:250, :4], here.x[:250], rtol=0.0, atol=1e-9)
    assert np.allclose(there[:250, 4], here.u[:250], rtol=0.0, atol=1e-6)
    assert np.abs(here.u[:250]).max() > 0.1


@needs_node
@pytest.mark.parametrize(
    ("fast", "tilt", "least", "most"),
    [(None, 4.0, 1.0, 1.0), (None, 26.0, 0.05, 0.95), ("6 rad/s", 4.0, 1.0, 1.0), ("6 rad/s", 20.0, 0.05, 0.95)],
)
def test_the_share_of_rigs_is_that_of_outcomes(fast, tilt, least, most):
    rig = RIG if fast is None else RIG.replace(speed_limit=fast)
    task, others, data = page(rig, (0.0, 0.0, math.radians(tilt), 0.0))
    starts = task.starts(40, np.random.default_rng([3, 52]))
    held = outcomes(
        rig, loop(rig, POLES).law, at="inverted", starts=starts, seconds=task.seconds, parameters=others
    ).held
    words = in_node(
        SCRIPTS, "const t = new Twin(given); result = new Ensemble(given).words(t.settings, t.gains);", data
    )
    assert [w != "falls" for w in words] == held.tolist()
    assert least <= held.mean() <= most


@needs_node
def test_gains_of_dragged_poles_are_scipys():
    _, _, data = page(RIG, (0.0, 0.0, 0.05, 0.0))
    wanted = [[-5, 3], [-5, -3], [-12, 0], [-2.5, 0]]
    K = in_node(SCRIPTS, "result = ackermann(given.A, given.B, given.poles);", {**data, "poles": wanted})
    model = RIG.linear("inverted")
    there = place_poles(model.A, model.B, [complex(*z) for z in wanted]).gain_matrix[0]
    assert np.allclose(K, there, rtol=1e-8)


@needs_node
def test_a_changed_setting_does_not_disturb_the_motion():
    """With the same value set again nothing changes; without its law the pendulum falls."""
    _, _, data = page(RIG, (0.0, 0.0, math.radians(5), 0.0))
    body = """
    const a = new Twin(given), b = new Twin(given);
    for (const t of [a, b]) t.advance(100);
    b.set({friction: 1}); b.place(given.poles.map((z) => [...z])); b.gains = a.gains; b.set({});
    for (const t of [a, b]) t.advance(100);
    const c = new Twin(given); c.set({holding: false}); c.advance(800);
    result = [a.state(), b.state(), c.state()];
    """
    a, b, c = in_node(SCRIPTS, body, data)
    assert a == b
    assert abs(a[2] - math.pi) < 0.1 < abs(c[2] - math.pi)


@needs_node
def test_a_push_frees_a_stuck_joint():
    _, _, data = page(RIG, (0.0, 0.0, 0.0, 0.0))
    body = """
    const t = new Twin(given); t.set({holding: false, friction: 20}); t.restart(given.away, [0, 0, 0, 0]);
    t.advance(50); const before = t.state(); t.push(1, 2.0); t.advance(50); result = [before, t.state()];
    """
    before, after = in_node(SCRIPTS, body, data)
    assert before == [0.0, 0.0, 0.0, 0.0]
    assert after[2] > 0.005


@pytest.mark.parametrize("name", ["pendulum", "cart-pendulum", "furuta", "double-pendulum"])
def test_rods_are_drawn_where_their_weight_is(name):
    """Height of the middle of a uniform rod, times its weight, is the potential energy; of a quarter turn, m g l."""
    plant = next(s.plant for k, s in SPECIMENS.items() if type(s.plant).__name__ == up.physics.find(name).__name__)
    moved = plant.coordinates[-1].name
    rng = np.random.default_rng(2)
    lowest = dict.fromkeys((c.name for c in plant.coordinates), 0.0)
    for _ in range(3):
        q = lowest | {moved: float(rng.uniform(-3, 3))}
        line = dict(plant.outline(plant, list(q.values())))[moved]
        middle = float((line[0][2] + line[1][2]) / 2)
        x = np.array([v for value in q.values() for v in (value, 0.0)])
        still = dict(plant.outline(plant, list(lowest.values())))[moved]
        rise = middle - float((still[0][2] + still[1][2]) / 2)
        mass = getattr(plant, "m_p", None) or plant.m_2
        level = {n: 0.0 for n in ("tilt_x", "tilt_y") if n in plant.names()}
        energy = plant.replace(**level).energy(np.stack([x, np.zeros_like(x)]))
        assert mass * plant.g * rise == pytest.approx(float(energy[0] - energy[1]), abs=1e-9)


@pytest.mark.parametrize("specimen", SPECIMENS.values(), ids=SPECIMENS)
def test_every_part_of_a_drawing_keeps_its_lengths_wherever_it_moves(specimen):
    plant = specimen.plant
    if not type(plant).__module__.startswith("upright."):
        return
    rng, lengths = np.random.default_rng(3), list[np.ndarray]()
    for q in (np.zeros(len(plant.coordinates)), *rng.uniform(-3, 3, (3, len(plant.coordinates)))):
        lines = [np.array(points, dtype=float) for _, points in plant.outline(plant, q.tolist())]
        lengths.append(np.concatenate([np.linalg.norm(np.diff(line, axis=0), axis=1) for line in lines]))
    np.testing.assert_allclose(lengths, np.tile(lengths[0], (4, 1)), atol=1e-12)


@pytest.mark.parametrize("specimen", SPECIMENS.values(), ids=SPECIMENS)
def test_every_shipped_plant_is_drawn(specimen):
    if type(specimen.plant).__module__.startswith("upright."):
        drawn = in_javascript(partial(specimen.plant.outline, specimen.plant), len(specimen.plant.coordinates))
        assert all(f'"{c.name}"' in drawn for c in specimen.plant.coordinates)
