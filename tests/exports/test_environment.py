"""Is an exported rig an environment as Gymnasium wants it, and does it move as the rig does?"""

from __future__ import annotations

import runpy
import warnings
from dataclasses import replace

import numpy as np
import pytest

from tests.exports.rigs import fit_file
from upright.errors import BadInput
from upright.exports.episodes import Episodes
from upright.exports.steps import substeps
from upright.physics import CartPendulum, Furuta, Pendulum, find
from upright.rig import Rig
from upright.simulation import simulate
from upright.study.stored_rig import read_stored_rig
from upright.verbs.export import export

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
from gymnasium.utils.env_checker import check_env  # noqa: E402

from upright.exports.environment import RigEnv, RigVectorEnv  # noqa: E402

FURUTA = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4, b_1c=2e-3, b_2c=1e-4)


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    errors = {"m_p": 0.004, "b_1c": 2e-4, "actuator.gain": 0.01}
    return fit_file(tmp_path_factory.mktemp("fit"), FURUTA, name="furuta", stderr=errors)


@pytest.mark.parametrize("task", ["balance", "swing_up"])
def test_gymnasium_s_own_checker_finds_nothing(fit, task):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*Box observation space.*infinity", category=UserWarning)
        check_env(RigEnv(fit, task=task), skip_render_check=True)


def test_a_step_is_the_motion_of_the_rig_that_was_drawn(fit):
    """A lane under its own commands is that rig simulated alone, drawn friction and gain included."""
    lanes = Episodes(read_stored_rig(fit, draws=50), 40)
    lanes.reset(np.ones(40, dtype=bool), np.random.default_rng(3))
    x0, params = lanes.x.copy(), lanes.params.copy()
    actions = np.random.default_rng(4).uniform(-1, 1, (6, 40, 1))
    for action in actions:
        lanes.step(action)
    names = lanes.simulator.names
    for lane in (0, 7, 39):
        own = dict(zip(names, params[:, lane].tolist(), strict=True))
        u = 5.0 * actions[:, lane]
        alone = simulate(FURUTA, own, x0[:, lane], u, 0.02, samples=7, substeps=lanes.simulator.substeps)
        np.testing.assert_array_equal(lanes.x[:, lane], alone[-1, :, 0])
    assert len({params[names.index("m_p"), k] for k in range(40)}) > 20


def test_a_drive_that_is_late_remembers_its_commands_from_step_to_step(fit):
    """Dead time and lag longer than a step: the same motion as in one run."""
    from upright.rig.hardware import Entry

    known = read_stored_rig(fit, draws=1)
    late = {n: Entry(value=v, unit="s", source="known") for n, v in (("delay", 0.031), ("lag", 0.012))}
    lanes = Episodes(replace(known, draws=(), hardware=known.hardware.with_entries(late)), 2)
    lanes.reset(np.ones(2, dtype=bool), np.random.default_rng(3))
    x0, actions = lanes.x.copy(), np.random.default_rng(4).uniform(-1, 1, (8, 2, 1))
    for action in actions:
        lanes.step(action)
    u = np.vstack([np.zeros((60, 1)), 5.0 * actions[:, 1]])
    drive = {"actuator.gain": 0.5, "actuator.delay": 0.031, "actuator.lag": 0.012}
    alone = simulate(FURUTA, drive, x0[:, 1], u, 0.02, samples=9, substeps=lanes.simulator.substeps, start=60)
    # the lag is settled anew at every step, on 40 time constants: e^-40 of a command; the rest is rounding
    np.testing.assert_allclose(lanes.x[:, 1], alone[-1, :, 0], rtol=0, atol=1e-9)


def test_draws_scatter_as_the_fit_says(fit):
    lanes = Episodes(read_stored_rig(fit, draws=2000), 4000)
    lanes.reset(np.ones(4000, dtype=bool), np.random.default_rng(1))
    masses = lanes.params[lanes.simulator.names.index("m_p")]
    # of 2000 normal draws the deviation's own error is 1/sqrt(4000), 1.6 %; four of them
    assert masses.std() == pytest.approx(0.004, rel=0.064)
    assert masses.mean() == pytest.approx(0.135, abs=4 * 0.004 / np.sqrt(2000))


def test_who_has_fallen_begins_anew_at_the_next_step(fit):
    env = RigVectorEnv(fit, 64, max_episode_steps=30)
    seen, _ = env.reset(seed=2)
    assert env.observation_space.contains(seen)
    lengths, steps = [], np.zeros(64, dtype=int)
    ended = np.zeros(64, dtype=bool)
    for _ in range(80):
        seen, reward, terminated, truncated, _ = env.step(np.ones((64, 1), dtype=np.float32))
        angle = np.abs(np.arctan2(seen[:, 1], seen[:, 2]))
        assert (reward == np.where(ended, 0.0, 1.0)).all()
        assert ((angle > np.radians(12)) == terminated).all()
        assert (angle[ended] <= 0.05 + 1e-6).all()  # where an episode begins
        steps = np.where(ended, 0, steps + 1)
        ended = terminated | truncated
        lengths += steps[ended].tolist()
    assert max(lengths) <= 30
    assert len(lengths) > 64


def test_the_same_seed_gives_the_same_rigs_and_motions(fit):
    one, other = (RigVectorEnv(fit, 16) for _ in range(2))
    a, b = (env.reset(seed=5)[0] for env in (one, other))
    np.testing.assert_array_equal(a, b)
    actions = np.full((16, 1), 0.3, dtype=np.float32)
    np.testing.assert_array_equal(one.step(actions)[0], other.step(actions)[0])


def test_hanging_still_is_worth_nothing_and_standing_still_one(fit):
    lanes = Episodes(read_stored_rig(fit), 2, task="swing_up")
    lanes.reset(np.ones(2, dtype=bool), np.random.default_rng(0))
    lanes.x[:] = 0.0
    lanes.x[2, 1] = np.pi
    reward, fallen = lanes.step(np.zeros((2, 1)))
    np.testing.assert_allclose(reward, [0.0, 1.0], atol=1e-9)
    assert not fallen.any()


def test_a_full_command_costs_a_hundredth_of_the_reward_and_half_of_one_a_quarter_of_that(fit):
    """The cost goes with the command's square, beside (1 + cos)/2 of the angle that is observed after the step."""
    lanes = Episodes(read_stored_rig(fit), 5, task="swing_up")
    lanes.reset(np.ones(5, dtype=bool), np.random.default_rng(0))
    reward, _ = lanes.step(np.array([[0.0], [0.5], [-0.5], [1.0], [-1.0]]))
    height = (1 + lanes.observation[:, lanes.names.index("cos theta")]) / 2
    # the cosine is observed in single precision, 6e-8
    np.testing.assert_allclose(height - reward, [0.0, 0.0025, 0.0025, 0.01, 0.01], rtol=0, atol=2e-7)


def test_the_exported_module_registers_single_and_vector(fit, tmp_path):
    done = export(fit, to="gymnasium", out=tmp_path)
    runpy.run_path(done.value[0])
    env = gymnasium.make_vec(done.numbers["environment"], num_envs=3)
    assert env.reset(seed=0)[0].shape == (3, 5)
    single = gymnasium.make(done.numbers["environment"], task="swing_up")
    single.reset(seed=0)
    assert single.step(single.action_space.sample())[4] == {}


def test_a_cart_ends_at_its_travel(tmp_path):
    plant = CartPendulum(m_c=0.5, m_p=0.2, l_cg=0.3, J_p=0.006)
    travel = {"value": 0.1, "unit": "m", "source": "known"}
    path = fit_file(tmp_path, plant, name="cart-pendulum", unit="N", travel=travel)
    env = RigVectorEnv(path, 4, task="swing_up")
    env.reset(seed=0)
    for _ in range(200):
        seen, _, terminated, _, _ = env.step(np.ones((4, 1), dtype=np.float32))
        if terminated.any():
            break
    assert (np.abs(seen[terminated, 0]) > 0.1).all()
    assert terminated.any()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"task": "jump"}, "balance or swing_up"),
        ({"at": "sideways"}, "no equilibrium 'sideways'"),
        ({"period": 0.0}, "1e-4 to 1 s"),
        ({"limit": -1.0}, "limit of an environment"),
    ],
)
def test_what_cannot_be_asked_is_refused(fit, options, words):
    with pytest.raises(BadInput, match=words):
        RigEnv(fit, **options)


def test_a_rig_that_cannot_stand_is_refused(tmp_path):
    chain = find("torsional-1")(J_1=0.01, k_1=1.0)
    path = fit_file(tmp_path, chain, name="torsional-1")
    with pytest.raises(BadInput, match="hangs or stands"):
        RigEnv(path)


def test_a_rig_without_a_limit_is_asked_for_one(tmp_path):
    path = fit_file(tmp_path, Pendulum(m_p=0.2, l_cg=0.2, J_p=1e-3), name="pendulum", limit={})
    path.write_text(path.read_text().replace('"limit": {}', ""))
    with pytest.raises(BadInput, match="largest command"):
        export(path, to="gymnasium", out=tmp_path)
    assert export(path, to="gymnasium", out=tmp_path, limit=2.0).numbers["draws"] == 0


def furuta_rig(fit, **entries):
    from upright.rig.hardware import Entry

    known = read_stored_rig(fit)
    given = {n: Entry(value=v, unit="", source="known") for n, v in entries.items()}
    return replace(known, draws=(), hardware=replace(known.hardware, entries=given))


def test_an_observation_is_deviations_then_speeds_and_of_what_turns_over_sine_and_cosine(fit):
    lanes = Episodes(read_stored_rig(fit), 2)
    assert lanes.names == ["psi", "sin theta", "cos theta", "psi_dot", "theta_dot"]
    lanes.x[:] = [[0.3, -0.1], [4.0, 5.0], [np.pi + 0.2, np.pi - 0.4], [6.0, 7.0]]
    expected = [[0.3, np.sin(0.2), np.cos(0.2), 4, 6], [-0.1, np.sin(-0.4), np.cos(0.4), 5, 7]]
    np.testing.assert_allclose(lanes.observation, expected, atol=1e-6)
    assert Episodes(read_stored_rig(fit), 1, at="hanging").target.tolist() == [0, 0]
    assert lanes.target.tolist() == [0, pytest.approx(np.pi)]


@pytest.mark.parametrize(("task", "theta"), [("balance", np.pi), ("swing_up", 0.0)])
def test_an_episode_begins_within_a_twentieth_of_where_its_task_does(fit, task, theta):
    lanes = Episodes(read_stored_rig(fit), 400, task=task)
    lanes.reset(np.ones(400, dtype=bool), np.random.default_rng(2))
    off = lanes.x - np.array([0.0, 0.0, theta, 0.0])[:, None]
    assert np.abs(off).max() <= 0.05
    assert (off.min(axis=1) < -0.045).all()
    assert (off.max(axis=1) > 0.045).all()
    assert not lanes.done.any()


def test_only_those_that_are_asked_begin_anew(fit):
    lanes = Episodes(read_stored_rig(fit, draws=4), 3)
    lanes.reset(np.ones(3, dtype=bool), np.random.default_rng(2))
    lanes.step(np.zeros((3, 1)))
    before, steps = lanes.x.copy(), lanes.steps.copy()
    lanes.reset(np.array([False, True, False]), np.random.default_rng(5))
    assert (lanes.x[:, [0, 2]] == before[:, [0, 2]]).all()
    assert (lanes.x[:, 1] != before[:, 1]).all()
    assert (steps.tolist(), lanes.steps.tolist()) == ([1, 1, 1], [1, 0, 1])
    lanes.reset(np.zeros(3, dtype=bool), np.random.default_rng(5))
    assert lanes.steps.tolist() == [1, 0, 1]


def test_a_command_is_cut_at_its_limit_and_both_signs_push_their_own_way(fit):
    lanes = Episodes(furuta_rig(fit, limit=5.0), 4, at="hanging")
    lanes.x[:] = 0.0
    lanes.step(np.array([[1.0], [3.0], [-1.0], [-2.0]]))
    np.testing.assert_array_equal(lanes.x[:, 0], lanes.x[:, 1])
    np.testing.assert_array_equal(lanes.x[:, 2], lanes.x[:, 3])
    np.testing.assert_allclose(lanes.x[:, 0], -lanes.x[:, 2], atol=1e-15)
    assert lanes.x[1, 0] > 0


@pytest.mark.parametrize(
    ("entries", "options", "limit"),
    [
        ({"limit": 5.0}, {}, 5.0), ({"limit": 5.0}, {"limit": 7.0}, 7.0),
        ({"limit": 5.0, "force_limit": 1.0}, {}, 2.0),  # half a N m for each volt
    ],
)  # fmt: skip
def test_full_command_is_what_is_asked_or_what_the_drive_can(fit, entries, options, limit):
    lanes = Episodes(furuta_rig(fit, **entries), 1, **options)
    assert lanes.limit == pytest.approx(limit)


def test_an_arm_ends_at_its_travel_and_a_pendulum_at_twelve_degrees_on_either_side(fit):
    lanes = Episodes(furuta_rig(fit, limit=5.0), 6, travel=0.5, period=1e-4)
    lanes.x[:] = np.array([0.0, 0.0, np.pi, 0.0])[:, None]
    lanes.x[0, :3] = [0.49, 0.51, -0.51]
    lanes.x[2, 3:] = np.pi + np.radians([11.9, 12.1, -12.1])
    reward, fallen = lanes.step(np.zeros((6, 1)))
    assert fallen.tolist() == [False, True, True, False, True, True]
    assert reward.tolist() == [1.0] * 6
    free = Episodes(furuta_rig(fit, limit=5.0), 2, task="swing_up", period=1e-4)
    free.x[:] = np.array([[9.0, -9.0], [0.0, 0.0], [1.0, 2.0], [0.0, 0.0]])
    assert not free.step(np.zeros((2, 1)))[1].any()  # nobody said how far the arm may go
    said = Episodes(furuta_rig(fit, limit=5.0, travel=0.5), 2, task="swing_up", period=1e-4)
    said.x[:] = np.array([[0.49, -0.51], [0.0, 0.0], [1.0, 2.0], [0.0, 0.0]])
    assert said.step(np.zeros((2, 1)))[1].tolist() == [False, True]


def test_a_motion_that_left_all_numbers_ends_where_it_was(fit):
    lanes = Episodes(furuta_rig(fit, limit=5.0), 2)
    lanes.x[:] = np.array([0.0, 0.0, np.pi, 0.0])[:, None]
    lanes.x[1, 1] = np.inf
    _, fallen = lanes.step(np.zeros((2, 1)))
    assert fallen.tolist() == [False, True]
    assert lanes.x[1, 1] == np.inf
    assert np.isfinite(lanes.x[:, 0]).all()


@pytest.mark.parametrize(("period", "taken"), [(1e-4, True), (1.0, True), (0.9e-4, False), (1.01, False)])
def test_a_command_is_held_for_a_tenth_of_a_millisecond_to_a_second(fit, period, taken):
    rig = furuta_rig(fit, limit=5.0)
    if taken:
        assert Episodes(rig, 1, period=period).period == period
    else:
        with pytest.raises(BadInput, match="1e-4 to 1 s"):
            Episodes(rig, 1, period=period)


@pytest.mark.parametrize(
    ("lanes", "options", "words"),
    [
        (0, {}, "at least one rig, got 0"), (1, {"travel": 0.0}, "travel of an environment must be above 0"),
        (1, {"limit": 1e9}, r"limit of an environment must be above 0 and below 1e9, got 1e\+09"),
    ],
)  # fmt: skip
def test_numbers_out_of_reach_are_refused(fit, lanes, options, words):
    with pytest.raises(BadInput, match=words):
        Episodes(furuta_rig(fit, limit=5.0), lanes, **options)


def test_braking_that_builds_up_is_refused_and_what_does_not_is_taken(fit):
    with pytest.raises(BadInput, match=r"actuator\.relaxation"):
        Episodes(furuta_rig(fit, limit=5.0, relaxation=0.1), 1)
    assert Episodes(furuta_rig(fit, limit=5.0, relaxation=0.0), 1)


def test_an_episode_is_cut_after_five_hundred_steps_unless_another_number_is_asked(fit):
    rig = furuta_rig(fit, limit=5.0)
    assert RigVectorEnv(rig).max_episode_steps == 500
    assert RigVectorEnv(rig).num_envs == 1
    env = RigVectorEnv(rig, 2, max_episode_steps=2, at="hanging")
    env.reset(seed=1)
    cut = [env.step(np.zeros((2, 1)))[3].tolist() for _ in range(4)]
    assert cut == [[False] * 2, [True] * 2, [False] * 2, [False] * 2]  # the third begins anew


def test_actions_and_observations_have_a_number_for_each_input_and_signal(fit):
    env = RigEnv(furuta_rig(fit, limit=5.0))
    assert (env.action_space.low.tolist(), env.action_space.high.tolist()) == ([-1.0], [1.0])
    assert env.observation_space.shape == (5,)
    assert RigVectorEnv(furuta_rig(fit, limit=5.0), 3).action_space.shape == (3, 1)
    seen, about = env.reset(seed=3)
    assert (seen.shape, about) == ((5,), {})
    assert env.step(np.zeros(1))[1:] == (1.0, False, False, {})


def test_steps_are_as_short_as_the_fastest_mode_needs():
    """A quarter of a radian of it: w = sqrt(m g l/(J + m l^2)) of a pendulum without friction, hanging or not."""
    plant = Pendulum(m_p=0.2, l_cg=0.25, J_p=0.0, g=9.0)  # w = sqrt(g/l) = 6 rad/s
    rig = Rig(plant=plant, gain=1.0)
    assert substeps(rig, 0.02) == 1
    assert substeps(rig, 0.0416) == 1  # 0.2496 rad
    assert substeps(rig, 0.0418) == 2
    assert substeps(rig, 1.0) == 24


def test_a_new_episode_knows_nothing_of_the_commands_of_the_last(fit):
    """A drive that is 50 ms late: what was commanded before the reset never arrives, in that lane alone."""
    lanes = Episodes(furuta_rig(fit, limit=5.0, delay=0.05), 2)
    rest = np.array([0.0, 0.0, np.pi, 0.0])
    lanes.x[:] = rest[:, None]
    lanes.step(np.ones((2, 1)))
    lanes.reset(np.array([True, False]), np.random.default_rng(0))
    lanes.x[:] = rest[:, None]
    for _ in range(4):
        lanes.step(np.zeros((2, 1)))
    assert np.abs(lanes.x[0]).tolist()[0] < 1e-12
    assert lanes.x[0, 1] > 1e-4
