import numpy as np
import pytest

from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.operator import ScriptedOperator
from lerobot_excav.errors import ConfigurationError


@pytest.fixture(scope="module")
def env():
    env = FR5GraspEnv(obs_type="agent_pos")
    yield env
    env.close()


@pytest.fixture(scope="module")
def seeing_env():
    env = FR5GraspEnv()
    yield env
    env.close()


def hold(env):
    return np.append(env.scene.joint_pos, 1.0).astype(np.float32)


def mask_of(env, **options):
    return env.reset(options=options)[0]["pixels"]["target_mask"]


def operate(env, frames=None):
    operator = ScriptedOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    total, truncated = 0.0, False
    while not truncated and (frames is None or frames > 0):
        _, reward, _, truncated, info = env.step(operator.act(env))
        total += reward
        frames = None if frames is None else frames - 1
    return total, info


def test_seed_selects_scene_and_target(env):
    info = env.reset(seed=6)[1]
    assert (info["scene_id"], info["target_id"]) == (6, 2)


def test_options_select_scene_and_target_over_the_seed(env):
    info = env.reset(seed=6, options={"scene_id": 9, "target_id": 3})[1]
    assert (info["scene_id"], info["target_id"]) == (9, 3)


@pytest.mark.parametrize("options", [{"scene_id": -1}, {"target_id": 4}, {"scene": 1}])
def test_unusable_options_are_refused(env, options):
    with pytest.raises(ConfigurationError):
        env.reset(seed=0, options=options)


def test_an_episode_lasts_8_s_and_ends_by_truncation_alone(env):
    env.reset(seed=0)
    frames, ended = 0, False
    while not ended:
        _, _, terminated, truncated, info = env.step(hold(env))
        assert not terminated
        frames, ended = frames + 1, truncated
    assert frames == 400
    assert info["episode_metrics"]["frames"] == 400
    assert not info["is_success"]


def test_success_is_told_at_the_last_frame_only(env):
    env.reset(seed=1)
    operator = ScriptedOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    told = [env.step(operator.act(env))[4]["is_success"] for _ in range(400)]
    assert told == [False] * 399 + [True]


def test_return_is_the_sum_of_rewards(env):
    env.reset(seed=2)
    total, info = operate(env)
    assert info["episode_metrics"]["episode_return"] == total > 700


def test_frames_may_last_several_ticks():
    env = FR5GraspEnv(obs_type="agent_pos", fps=25)
    env.reset(seed=1)
    env.step(hold(env))
    assert env.workcell.data.time == pytest.approx(0.04)
    assert env.episode_length == 200
    env.reset(seed=1)
    assert operate(env)[1]["is_success"]


def test_mask_shows_the_commanded_block_while_it_moves_or_not(seeing_env):
    masks = [mask_of(seeing_env, scene_id=4, target_id=i) for i in range(4)]
    assert np.array_equal(np.stack(masks), seeing_env.renderer.block_masks())
    start = seeing_env.reset(seed=0)[0]["pixels"]["target_mask"]
    for _ in range(3):
        observation, *_ = seeing_env.step(hold(seeing_env))
        assert np.array_equal(observation["pixels"]["target_mask"], start)


def test_paired_resets_differ_in_the_mask_only(seeing_env):
    first, _ = seeing_env.reset(options={"scene_id": 5, "target_id": 0})
    other, _ = seeing_env.reset(options={"scene_id": 5, "target_id": 1})
    assert not np.array_equal(first["pixels"]["target_mask"], other["pixels"]["target_mask"])
    assert np.array_equal(first["agent_pos"], other["agent_pos"])
    for camera in ("main", "top"):
        assert np.array_equal(first["pixels"][camera], other["pixels"][camera])


def test_conditions_corrupt_the_mask():
    right = {i: mask_of(FR5GraspEnv(), scene_id=3, target_id=i) for i in range(4)}
    shown = {
        condition: mask_of(FR5GraspEnv(mask_condition=condition), scene_id=3, target_id=1)
        for condition in ("zero", "random", "mismatched")
    }
    assert not shown["zero"].any()
    assert (shown["random"] > 0).sum() == (right[1] > 0).sum()
    assert not (shown["random"] & right[1]).any()
    assert any(np.array_equal(shown["mismatched"], right[i]) for i in (0, 2, 3))


def test_without_pictures_no_block_is_shown():
    env = FR5GraspEnv(obs_type="agent_pos", episode_length=1)
    env.reset(seed=0)
    assert np.isnan(env.step(hold(env))[4]["episode_metrics"]["shown_block"])


@pytest.mark.parametrize("condition", ["correct", "zero", "random", "mismatched"])
def test_metrics_name_the_block_whose_mask_is_shown(condition):
    env = FR5GraspEnv(mask_condition=condition, episode_length=1)
    shown = mask_of(env, scene_id=3, target_id=1)
    block = env.step(hold(env))[4]["episode_metrics"]["shown_block"]
    if condition in ("zero", "random"):
        assert block == -1
    else:
        assert np.array_equal(env.renderer.block_masks()[block], shown)
        assert (block == 1) == (condition == "correct")
    env.close()


@pytest.mark.parametrize(("noise", "grows"), [("erode", -1), ("dilate", 1), ("shift", 0)])
def test_noise_changes_the_mask(seeing_env, noise, grows):
    right = mask_of(seeing_env, scene_id=3, target_id=1)
    noisy_env = FR5GraspEnv(mask_noise=noise, mask_noise_px=2)
    noisy = mask_of(noisy_env, scene_id=3, target_id=1)
    assert not np.array_equal(noisy, right)
    assert np.sign(int((noisy > 0).sum()) - int((right > 0).sum())) == grows
    assert np.array_equal(noisy, mask_of(noisy_env, scene_id=3, target_id=1))
    noisy_env.close()


def test_retargeting_changes_mask_target_and_what_success_means():
    env = FR5GraspEnv(retarget_frame=30)
    first = mask_of(env, scene_id=3, target_id=1)
    masks = first
    for frame in range(1, 31):
        observation, *_, info = env.step(hold(env))
        masks = observation["pixels"]["target_mask"]
        assert (info["target_id"] == 1) == (frame < 30)
        assert np.array_equal(masks, first) == (frame < 30)
    assert info["target_id"] != 1
    env.close()


def test_a_second_target_that_has_moved_is_marked_where_it_lies_then():
    env = FR5GraspEnv(retarget_frame=2)
    first = env.reset(options={"scene_id": 3, "target_id": 1})[0]
    env.step(hold(env))
    for i in range(4):
        env.workcell.data.joint(f"block{i}").qpos[0] += 0.05
    observation = env.step(hold(env))[0]
    assert np.array_equal(observation["pixels"]["target_mask"], env.renderer.block_masks()[env.target_id])
    assert not np.array_equal(observation["pixels"]["main"], first["pixels"]["main"])
    env.close()


def test_a_second_target_that_cannot_be_seen_is_marked_where_it_lay():
    env = FR5GraspEnv(retarget_frame=2)
    env.reset(options={"scene_id": 3, "target_id": 1})
    start = env.renderer.block_masks()
    env.step(hold(env))
    for i in range(4):
        env.workcell.data.joint(f"block{i}").qpos[0] += 2.0  # behind the camera
    mask = env.step(hold(env))[0]["pixels"]["target_mask"]
    assert np.array_equal(mask, start[env.target_id])
    env.close()


def test_the_second_target_depends_on_scene_and_first_target_alone():
    def second(env, scene_id, action):
        env.reset(options={"scene_id": scene_id, "target_id": 1})
        return env.step(action)[4]["target_id"]

    env, other = (FR5GraspEnv(obs_type="agent_pos", retarget_frame=1) for _ in range(2))
    chosen = [second(env, scene_id, np.zeros(7)) for scene_id in range(12)]
    assert set(chosen) == {0, 2, 3}
    assert chosen[::-1] == [second(other, scene_id, np.ones(7)) for scene_id in reversed(range(12))]


def test_operator_succeeds_with_the_second_target():
    env = FR5GraspEnv(obs_type="agent_pos", retarget_frame=30)
    env.reset(seed=1)
    _, info = operate(env)
    metrics = info["episode_metrics"]
    assert info["is_success"]
    assert metrics["final_target_id"] != metrics["target_id"]
    assert metrics["first_grasped_block"] == metrics["final_target_id"]
    assert metrics["retarget_frame"] == 30


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"task": "Scoop-v0"}, "task"),
        ({"fps": 30}, "fps"),
        ({"mask_noise": "shift"}, "mask_noise_px"),
        ({"retarget_frame": 400}, "retarget_frame"),
        ({"retarget_frame": 0}, "retarget_frame"),
        ({"observation_height": 8}, "observation_height"),
        ({"scene_set": "all"}, "scene_set"),
        ({"obs_type": "depth"}, "obs_type"),
    ],
)
def test_bad_settings_name_the_field(settings, named):
    with pytest.raises(ConfigurationError, match=named):
        FR5GraspEnv(**settings)


def test_step_before_reset_says_so():
    with pytest.raises(ConfigurationError, match="reset"):
        FR5GraspEnv(obs_type="agent_pos").step(np.zeros(7))
