"""What every environment of this package keeps to, whatever its robot and task."""

import json

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from lerobot.envs.configs import EnvConfig

import lerobot_excav.plugin  # noqa: F401 - registers every --env.type
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

GYM_IDS = sorted(spec.gym_id for spec in TASKS.values() if spec.env_entry.startswith("lerobot_excav."))
FRAMES = 12
# What reports read of every task.
METRICS = (
    *("simulation_version", "task", "scene_set", "scene_id", "stage", "target_id", "is_success", "frames"),
    *("mask_source", "mask_condition", "mask_noise", "mask_noise_px", "mask_dropout", "mask_snap", "target_overlay"),
    "shown_target_id",
    *("fps", "episode_length", "camera_every", "commands", "mask_missing", "mask_missing_frames", "mask_fallbacks"),
    "mask_iou",
)


def flat(observation):
    """Spell out nested observations: `pixels/main`."""
    pixels = {f"pixels/{camera}": array for camera, array in observation["pixels"].items()}
    return {key: array for key, array in observation.items() if key != "pixels"} | pixels


def play(env):
    """Play the same random actions in the same scene."""
    rng = np.random.default_rng(4)
    trace = [(flat(env.reset(seed=4)[0]), 0.0)]
    for _ in range(FRAMES):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        observation, reward, *_ = env.step(action)
        trace.append((flat(observation), float(reward)))
    return trace


def made(gym_id, **settings):
    return gym.make(gym_id, disable_env_checker=True, **settings)


def still(env):
    return np.zeros(env.action_space.shape, np.float32)


def start_of(gym_id, **settings):
    """Return the first observation of the episode that `trace` plays, under other settings."""
    env = made(gym_id, **settings)
    observation, _ = env.reset(seed=4)
    env.close()
    return flat(observation)


def assert_same(a, b):
    for (observation_a, reward_a), (observation_b, reward_b) in zip(a, b, strict=True):
        assert reward_a == reward_b
        for key, array in observation_a.items():
            assert np.array_equal(array, observation_b[key]), key


def assert_only_mask_differs(shown, right):
    assert [key for key, array in shown.items() if not np.array_equal(array, right[key])] == ["pixels/target_mask"]


# The masks and scenes of Clear-v0 are made by the code of Scoop-v0, where the quick tier tests them.
of_masks_and_scenes = pytest.mark.parametrize(
    "gym_id",
    [pytest.param(each, marks=pytest.mark.slow if each.endswith("/Clear-v0") else ()) for each in GYM_IDS],
    indirect=True,
)


@pytest.fixture(scope="module", params=GYM_IDS)
def gym_id(request):
    return request.param


@pytest.fixture(scope="module")
def env(gym_id):
    env = made(gym_id)
    yield env
    env.close()


@pytest.fixture(scope="module")
def trace(env):
    return play(env)


@pytest.fixture(scope="module")
def right(trace):
    """The first observation."""
    return trace[0][0]


def test_there_is_an_environment():
    assert GYM_IDS
    assert set(GYM_IDS) <= set(gym.registry)


# Joint velocities have no bound that a box could state.
@pytest.mark.filterwarnings("ignore:.*Box observation space minimum value is -infinity:UserWarning")
@pytest.mark.filterwarnings("ignore:.*Box observation space maximum value is infinity:UserWarning")
# An arm is commanded in radians, not in parts of its range.
@pytest.mark.filterwarnings("ignore:.*For Box action spaces, we recommend:UserWarning")
@pytest.mark.filterwarnings("error::UserWarning")
def test_gymnasium_finds_nothing_wrong(gym_id):
    env = made(gym_id)
    check_env(env.unwrapped)
    env.close()


def test_observations_are_finite_and_inside_their_space(env, trace):
    spaces = flat(env.observation_space)
    for observation, reward in trace:
        assert np.isfinite(reward)
        assert set(observation) == set(spaces)
        for key, array in observation.items():
            assert spaces[key].contains(array), key
            assert np.isfinite(array).all(), key


def test_the_same_seed_and_actions_give_the_same_bits_also_in_a_fresh_environment(gym_id, env, trace):
    assert_same(play(env), trace)
    fresh = made(gym_id)
    assert_same(play(fresh), trace)
    fresh.close()


def test_starts_differ(env, right):
    other = flat(env.reset(seed=5)[0])
    for key, array in right.items():
        assert not np.array_equal(array, other[key]), key


def test_nothing_observed_is_constant_but_the_mask(trace, right):
    for key, first in right.items():
        seen = np.stack([observation[key] for observation, _ in trace])
        if key == "pixels/target_mask":
            assert (seen == first).all()
        elif key.startswith("pixels/"):
            assert (seen != first).any()
        else:
            assert (np.ptp(seen, axis=0) > 0.0).all(), key


def test_held_pictures_are_those_of_every_third_frame_and_all_else_goes_on(gym_id, trace):
    env = made(gym_id, camera_every=3)
    held = [observation for observation, _ in play(env)]
    env.close()
    for number, observation in enumerate(held):
        drawn = trace[number - number % 3][0]
        for key, array in observation.items():
            expected = drawn if key.startswith("pixels/") else trace[number][0]
            assert np.array_equal(array, expected[key]), (number, key)


def test_the_mask_is_black_and_white_and_shows_something(right):
    mask = right["pixels/target_mask"]
    assert set(np.unique(mask)) == {0, 255}
    assert (mask == mask[..., :1]).all()


@of_masks_and_scenes
@pytest.mark.parametrize("condition", ["zero", "random", "mismatched"])
def test_a_mask_condition_changes_the_mask_alone(gym_id, right, condition):
    assert_only_mask_differs(start_of(gym_id, mask_condition=condition), right)


@of_masks_and_scenes
@pytest.mark.parametrize(("noise", "growth"), [("shift", 0), ("erode", -1), ("dilate", 1)])
def test_mask_noise_changes_the_mask_alone(gym_id, right, noise, growth):
    shown, again = (start_of(gym_id, mask_noise=noise, mask_noise_px=2) for _ in range(2))
    mask, again_mask, right_mask = (each["pixels/target_mask"] for each in (shown, again, right))
    assert np.array_equal(mask, again_mask)
    assert set(np.unique(mask)) == {0, 255}
    assert np.sign((mask > 0).sum(dtype=int) - (right_mask > 0).sum(dtype=int)) == growth
    assert_only_mask_differs(shown, right)


def some_masks(gym_id, **settings):
    """Return the masks of some frames of the episode that `trace` plays."""
    env = made(gym_id, **settings)
    masks = [observation["pixels/target_mask"] for observation, _ in play(env)]
    env.close()
    return masks


@of_masks_and_scenes
def test_a_mask_that_flickers_lies_elsewhere_at_every_frame_and_is_the_same_again(gym_id, trace):
    masks, again = (some_masks(gym_id, mask_noise="flicker", mask_noise_px=3) for _ in range(2))
    assert all(map(np.array_equal, masks, again))
    assert len({mask.tobytes() for mask in masks}) > FRAMES // 2
    right = trace[0][0]["pixels/target_mask"]
    assert {int((mask > 0).sum()) for mask in masks} == {int((right > 0).sum())}


@of_masks_and_scenes
def test_a_mask_that_drops_out_is_whole_or_empty_and_the_same_again(gym_id, trace):
    masks, again = (some_masks(gym_id, mask_dropout=0.5) for _ in range(2))
    assert all(map(np.array_equal, masks, again))
    right = trace[0][0]["pixels/target_mask"]
    missing = [not mask.any() for mask in masks]
    assert all(is_missing or np.array_equal(mask, right) for is_missing, mask in zip(missing, masks, strict=True))
    assert 0 < sum(missing) < len(masks)


def overlap_of(gym_id, **settings):
    """Return the overlap of mask and target that an episode of a few frames tells."""
    env = made(gym_id, episode_length=FRAMES, **settings)
    env.reset(seed=4)
    is_over = False
    while not is_over:
        _, _, terminated, truncated, info = env.step(np.zeros(env.action_space.shape, np.float32))
        is_over = terminated or truncated
    env.close()
    return info["episode_metrics"]["mask_iou"]


@of_masks_and_scenes
def test_metrics_tell_how_well_the_mask_fits_its_target(gym_id):
    assert overlap_of(gym_id) == 1.0
    assert 0.0 < overlap_of(gym_id, mask_noise="shift", mask_noise_px=2) < 1.0
    assert overlap_of(gym_id, mask_condition="zero") == 0.0
    dropped = [not mask.any() for mask in some_masks(gym_id, mask_dropout=0.5)]
    assert overlap_of(gym_id, mask_dropout=0.5) == pytest.approx(1.0 - np.mean(dropped))


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"mask_noise": "shift"}, "mask_noise"),
        ({"mask_noise_px": 2}, "mask_noise"),
        ({"mask_noise": "shift", "mask_noise_px": 2, "mask_condition": "zero"}, "mask_noise"),
        ({"mask_snap": True, "mask_condition": "zero"}, "mask_snap"),
        ({"mask_dropout": 0.5, "mask_condition": "zero"}, "mask_dropout"),
        ({"mask_dropout": 1.0}, "mask_dropout"),
        ({"mask_snap": True, "mask_condition": "random"}, "mask_snap"),
        ({"camera_every": 2, "obs_type": "agent_pos"}, "camera_every=2"),
        ({"camera_every": 2, "depth_info": True}, "camera_every=2"),
        ({"episode_length": 0}, "episode_length=0"),
        ({"camera_every": 0}, "camera_every=0"),
    ],
)
def test_impossible_settings_are_refused(gym_id, settings, named):
    with pytest.raises(ConfigurationError, match=named):
        gym.make(gym_id, **settings)


@of_masks_and_scenes
def test_scene_sets_hold_other_scenes(gym_id):
    starts = [start_of(gym_id, scene_set=scene_set)["pixels/main"] for scene_set in ("train", "val", "test")]
    assert len({start.tobytes() for start in starts}) == 3


def test_observations_share_no_memory(trace):
    arrays = [array for observation, _ in trace[:3] for array in observation.values()]
    for i, array in enumerate(arrays):
        assert not any(np.shares_memory(array, other) for other in arrays[i + 1 :])


def test_observations_can_be_changed_without_harm_and_actions_are_left_alone(env):
    ends = []
    for spoilt in ({}, {"agent_pos", "pixels/main", "pixels/target_mask"}):
        observation = flat(env.reset(seed=4)[0])
        for key in spoilt:
            observation[key][...] = 1
        action = still(env) + 2.0
        ends.append([(flat(env.step(action)[0]), 0.0)])
        assert (action == 2.0).all()
    assert_same(*ends)


def test_lerobot_learns_task_length_and_frame_rate(env):
    # Without either text, LeRobot's evaluation loses its worker processes.
    texts = [env.get_wrapper_attr(attribute) for attribute in ("task", "task_description")]
    assert all(isinstance(text, str) and text for text in texts)
    assert env.get_wrapper_attr("_max_episode_steps") >= 1
    assert env.metadata["render_fps"] >= 1
    env.reset(seed=4)
    assert env.render().dtype == np.uint8


def test_the_stage_is_told_and_is_0_unless_asked_for(env):
    info = env.reset(seed=4)[1]
    assert (info["scene_id"], info["stage"]) == (4, 0)


def test_an_episode_ends_with_its_metrics(gym_id):
    env = made(gym_id, episode_length=1)
    assert env.reset(seed=4)[1]["is_success"] is False
    *_, terminated, truncated, info = env.step(still(env))
    assert (terminated, truncated) == (False, True)
    assert info["is_success"] is False
    metrics = info["episode_metrics"]
    plain = {key: value for key, value in metrics.items() if not isinstance(value, list)}
    assert all(isinstance(value, (bool, int, float, str)) for value in plain.values())
    json.dumps([value for value in metrics.values() if isinstance(value, list)], allow_nan=False)
    assert metrics["commands"] == [[0, info["target_id"]]]
    assert set(METRICS) <= set(metrics)
    env.close()


def test_gym_make_plays_an_episode_to_the_length_asked_for(gym_id):
    env = made(gym_id, episode_length=201, obs_type="agent_pos")
    env.reset(seed=4)
    ends = [env.step(still(env))[3:] for _ in range(201)]
    assert [truncated for truncated, _ in ends] == [False] * 200 + [True]
    assert ends[-1][1]["episode_metrics"]["frames"] == 201
    env.close()


@pytest.mark.parametrize(
    "spoil",
    [lambda a: a[:-1], lambda a: a[None], lambda a: a * np.nan, lambda a: a + np.inf],
    ids=["short", "batched", "nan", "infinite"],
)
def test_an_unusable_action_is_refused(env, spoil):
    env.reset(seed=4)
    with pytest.raises(ConfigurationError, match="action"):
        env.step(spoil(still(env)))


def test_an_impossible_target_is_refused(env):
    with pytest.raises(ConfigurationError, match="target_id"):
        env.reset(options={"scene_id": 0, "target_id": 99})


@pytest.mark.parametrize(
    "use_async",
    [pytest.param(False, id="one process"), pytest.param(True, id="own processes", marks=pytest.mark.slow)],
)
def test_lerobots_environments_give_the_same_bits_as_one_alone(gym_id, trace, *, use_async):
    # One frame more than is played: at the end of an episode LeRobot's wrapper repeats the last transition.
    spec = TASKS[gym_id.split("/")[1]]
    config = EnvConfig.get_choice_class(spec.env_type)(task=spec.id, episode_length=FRAMES + 1)
    ((vector,),) = ([*tasks.values()] for tasks in config.create_envs(2, use_async_envs=use_async).values())
    assert isinstance(vector, gym.vector.AsyncVectorEnv) is use_async
    rng = np.random.default_rng(4)
    played = [(flat(vector.reset(seed=[4, 5])[0]), np.zeros(2))]
    for _ in range(FRAMES):
        action = rng.uniform(-1.0, 1.0, vector.single_action_space.shape).astype(np.float32)
        observation, reward, *_ = vector.step(np.stack([action, action]))
        played.append((flat(observation), reward))
    vector.close()
    of_seed_4 = [
        ({key: array[0] for key, array in observation.items()}, float(reward[0])) for observation, reward in played
    ]
    assert_same(of_seed_4, trace)


@pytest.mark.parametrize("number", [np.int64(-5), np.int64(0), np.float32(3.5)])
@pytest.mark.parametrize("spec", TASKS.values(), ids=lambda spec: spec.id)
def test_numbers_of_numpy_keep_the_limits(spec, number):
    with pytest.raises(ConfigurationError, match="episode_length="):
        spec.make_settings(episode_length=number)
    assert type(spec.make_settings(episode_length=np.int64(7)).episode_length) is int
