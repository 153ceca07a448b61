import numpy as np
import pytest

from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.operator import GraspOperator
from lerobot_excav.errors import ConfigurationError


def blind(**settings):
    return FR5GraspEnv(obs_type="agent_pos", **settings)


@pytest.fixture
def make():
    """Make an environment; settings go to it."""
    envs = []

    def _make(**settings):
        envs.append(FR5GraspEnv(**settings))
        return envs[-1]

    yield _make
    for env in envs:
        env.close()


def hold(env):
    return np.append(env.scene.joint_pos, 1.0).astype(np.float32)


def mask_of(observation):
    return observation["pixels"]["target_mask"][..., 0] == 255


def start_mask(env, **options):
    return mask_of(env.reset(options=options)[0])


def operate(env):
    operator = GraspOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    total, truncated, told = 0.0, False, []
    while not truncated:
        _, reward, terminated, truncated, info = env.step(operator.act(env))
        assert not terminated
        told.append(info["is_success"])
        total += reward
    return total, told, info["episode_metrics"]


def test_success_is_told_at_the_end_of_8_s_and_the_return_is_the_sum_of_rewards():
    env = blind()
    env.reset(seed=1)
    total, told, metrics = operate(env)
    assert told == [False] * 399 + [True]
    assert metrics["episode_return"] == total > 700


def test_frames_may_last_several_ticks():
    env = blind(fps=25)
    env.reset(seed=1)
    env.step(hold(env))
    assert env.workcell.data.time == pytest.approx(0.04)
    assert env.episode_length == 200
    env.reset(seed=1)
    assert operate(env)[2]["is_success"]


def test_mask_shows_the_commanded_block_and_stays(make):
    env = make()
    masks = [start_mask(env, scene_id=4, target_id=i) for i in range(4)]
    assert np.array_equal(np.stack(masks), env.renderer.block_pixels())
    for _ in range(3):
        observation, *_ = env.step(hold(env))
        assert np.array_equal(mask_of(observation), masks[3])


@pytest.mark.parametrize("condition", ["correct", "zero", "random", "mismatched"])
def test_metrics_name_the_block_whose_mask_is_shown(make, condition):
    env = make(mask_condition=condition, episode_length=1)
    shown = start_mask(env, scene_id=3, target_id=1)
    block = env.step(hold(env))[4]["episode_metrics"]["shown_target_id"]
    if condition in ("zero", "random"):
        assert block == -1
        assert not (shown & env.renderer.block_pixels()[1]).any()
    else:
        assert np.array_equal(env.renderer.block_pixels()[block], shown)
        assert (block == 1) == (condition == "correct")


def test_retargeting_changes_mask_target_and_metrics(make):
    env = make(retarget_frame=30, episode_length=31)
    first = start_mask(env, scene_id=3, target_id=1)
    for frame in range(1, 31):
        observation, *_, info = env.step(hold(env))
        assert (info["target_id"] == 1) == (frame < 30)
        assert np.array_equal(mask_of(observation), first) == (frame < 30)
    metrics = env.step(hold(env))[4]["episode_metrics"]
    assert metrics["commands"] == [[0, 1], [30, env.target_id]]
    assert metrics["retarget_frame"] == 30


@pytest.mark.parametrize(("shift_m", "is_seen"), [(0.05, True), (2.0, False)])
def test_a_second_target_is_marked_where_it_lies_then_or_where_it_lay_if_out_of_sight(make, shift_m, is_seen):
    env = make(retarget_frame=2)
    env.reset(options={"scene_id": 3, "target_id": 1})
    start = env.renderer.block_pixels()
    env.step(hold(env))
    for i in range(4):
        env.workcell.data.joint(f"block{i}").qpos[0] += shift_m
    mask = mask_of(env.step(hold(env))[0])
    places = env.renderer.block_pixels() if is_seen else start
    assert np.array_equal(mask, places[env.target_id])
    assert np.array_equal(mask, start[env.target_id]) != is_seen


def test_the_second_target_depends_on_scene_and_first_target_alone():
    def second(env, scene_id, action):
        env.reset(options={"scene_id": scene_id, "target_id": 1})
        return env.step(action)[4]["target_id"]

    env, other = (blind(retarget_frame=1) for _ in range(2))
    chosen = [second(env, scene_id, np.zeros(7)) for scene_id in range(12)]
    assert set(chosen) == {0, 2, 3}
    assert chosen[::-1] == [second(other, scene_id, np.ones(7)) for scene_id in reversed(range(12))]


def test_a_schedule_goes_before_the_tasks_own_change():
    env = blind(retarget_frame=1)
    env.reset(options={"scene_id": 3, "target_id": 1, "commands": [(2, 0)]})
    assert [env.step(hold(env))[4]["target_id"] for _ in range(3)] == [1, 0, 0]


def test_the_operator_succeeds_with_the_second_target():
    env = blind(retarget_frame=30)
    env.reset(seed=1)
    _, _, metrics = operate(env)
    assert metrics["is_success"]
    assert metrics["first_grasped_block"] == metrics["commands"][-1][1] != metrics["target_id"]


def test_a_held_arm_keeps_the_block_it_has_lifted():
    env = blind(episode_length=2000)
    env.reset(seed=5)
    operator = GraspOperator(rng=np.random.default_rng(1))
    operator.reset(env)
    lifted = env.workcell.block_pos_w[env.target_id, 2] + 0.06
    while env.workcell.block_pos_w[env.target_id, 2] < lifted:
        env.step(operator.act(env))
    heights_m = []
    for _ in range(150):
        env._advance(env.holding_action())
        heights_m.append(env.workcell.block_pos_w[env.target_id, 2])
    assert min(heights_m) > lifted - 0.005
    assert np.ptp(heights_m[25:]) < 0.001  # the joints catch up with what they were told, then nothing moves


def test_a_success_is_not_undone_by_a_command_after_the_last_action():
    env = blind()
    env.reset(seed=1)
    actions = []
    operator = GraspOperator(rng=np.random.default_rng(1))
    operator.reset(env)
    for _ in range(env.episode_length):
        actions.append(operator.act(env))
        *_, info = env.step(actions[-1])
    assert info["is_success"]
    with pytest.raises(ConfigurationError, match=r"frame=400 .*from 1 to 399"):
        env.reset(seed=1, options={"commands": [(400, 2)]})
