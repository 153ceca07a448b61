"""What every environment of this package keeps to, whatever its robot and task."""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from lerobot.envs.configs import EnvConfig
from numpy.typing import NDArray

import lerobot_excav.plugin  # noqa: F401 - registers every --env.type
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

GYM_IDS = sorted(spec.gym_id for spec in TASKS.values() if spec.env_entry.startswith("lerobot_excav."))
FRAMES = 12
# What reports read of every task.
METRICS = (
    *("simulation_version", "task", "scene_set", "scene_id", "target_id", "is_success", "frames"),
    *("mask_source", "mask_condition", "mask_noise", "mask_noise_px", "target_overlay", "shown_target_id"),
    *("fps", "episode_length", "commands", "mask_missing", "mask_missing_frames"),
)

Trace = list[tuple[dict[str, NDArray[Any]], float]]


def flat(observation: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Spell out nested observations: `pixels/main`."""
    out = {}
    for key, value in observation.items():
        if isinstance(value, dict):
            out |= {f"{key}/{inner}": array for inner, array in flat(value).items()}
        else:
            out[key] = value
    return out


def play(env: gym.Env[Any, Any], *, seed: int, frames: int = FRAMES) -> Trace:
    """Play random actions, which the seed fixes."""
    rng = np.random.default_rng(seed)
    trace = [(flat(env.reset(seed=seed)[0]), 0.0)]
    for _ in range(frames):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        observation, reward, *_ = env.step(action)
        trace.append((flat(observation), float(reward)))
    return trace


def start_of(gym_id: str, **settings: Any) -> dict[str, NDArray[Any]]:
    """Return the first observation of the episode that `trace` plays, under other settings."""
    env = gym.make(gym_id, disable_env_checker=True, **settings)
    observation, _ = env.reset(seed=4)
    env.close()
    return flat(observation)


def assert_same(a: Trace, b: Trace) -> None:
    for (observation_a, reward_a), (observation_b, reward_b) in zip(a, b, strict=True):
        assert reward_a == reward_b
        for key, array in observation_a.items():
            assert np.array_equal(array, observation_b[key]), key


def config_of(gym_id: str, **settings: Any) -> EnvConfig:
    """Make the configuration that LeRobot's `--env.type` makes of a task."""
    spec = TASKS[gym_id.split("/")[1]]
    return EnvConfig.get_choice_class(spec.env_type)(task=spec.id, **settings)


@pytest.fixture(scope="module", params=GYM_IDS)
def gym_id(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def env(gym_id: str) -> Iterator[gym.Env[Any, Any]]:
    env = gym.make(gym_id, disable_env_checker=True)
    yield env
    env.close()


@pytest.fixture(scope="module")
def trace(env: gym.Env[Any, Any]) -> Trace:
    return play(env, seed=4)


def test_there_is_an_environment() -> None:
    assert GYM_IDS
    assert set(GYM_IDS) <= set(gym.registry)


# Joint velocities have no bound that a box could state.
@pytest.mark.filterwarnings("ignore:.*Box observation space minimum value is -infinity:UserWarning")
@pytest.mark.filterwarnings("ignore:.*Box observation space maximum value is infinity:UserWarning")
# An arm is commanded in radians, not in parts of its range.
@pytest.mark.filterwarnings("ignore:.*For Box action spaces, we recommend:UserWarning")
@pytest.mark.filterwarnings("error::UserWarning")
def test_gymnasium_finds_nothing_wrong(gym_id: str) -> None:
    env = gym.make(gym_id, disable_env_checker=True)
    check_env(env.unwrapped)
    env.close()


def test_observations_are_finite_and_inside_their_space(env: gym.Env[Any, Any], trace: Trace) -> None:
    spaces = flat(dict(env.observation_space.spaces))  # type: ignore[attr-defined]
    spaces = {key: space for key, space in spaces.items() if not isinstance(space, gym.spaces.Dict)} | {
        f"pixels/{key}": space
        for key, space in env.observation_space["pixels"].items()  # type: ignore[index]
    }
    for observation, reward in trace:
        assert np.isfinite(reward)
        assert set(observation) == set(spaces)
        for key, array in observation.items():
            assert spaces[key].contains(array), key
            assert np.isfinite(array).all(), key


def test_the_same_seed_and_actions_give_the_same_bits(env: gym.Env[Any, Any], trace: Trace) -> None:
    assert_same(play(env, seed=4), trace)


def test_a_fresh_environment_gives_the_same_bits(gym_id: str, trace: Trace) -> None:
    env = gym.make(gym_id, disable_env_checker=True)
    assert_same(play(env, seed=4), trace)
    env.close()


def test_starts_differ(env: gym.Env[Any, Any], trace: Trace) -> None:
    first, _ = trace[0]
    other = flat(env.reset(seed=5)[0])
    for key, array in first.items():
        assert not np.array_equal(array, other[key]), key


def test_nothing_observed_is_constant_but_the_mask(trace: Trace) -> None:
    for key, first in trace[0][0].items():
        seen = np.stack([observation[key] for observation, _ in trace])
        if key == "pixels/target_mask":
            assert (seen == first).all()
        elif key.startswith("pixels/"):
            assert (seen != first).any()
        else:
            assert (np.ptp(seen, axis=0) > 0.0).all(), key


def test_the_mask_is_black_and_white_and_shows_something(trace: Trace) -> None:
    mask = trace[0][0]["pixels/target_mask"]
    assert set(np.unique(mask)) == {0, 255}
    assert (mask == mask[..., :1]).all()


@pytest.mark.parametrize("condition", ["zero", "random", "mismatched"])
def test_a_mask_condition_changes_the_mask_alone(gym_id: str, trace: Trace, condition: str) -> None:
    shown = start_of(gym_id, mask_condition=condition)
    right = trace[0][0]
    assert not np.array_equal(shown.pop("pixels/target_mask"), right["pixels/target_mask"])
    assert all(np.array_equal(array, right[key]) for key, array in shown.items())


@pytest.mark.parametrize(("noise", "growth"), [("shift", 0), ("erode", -1), ("dilate", 1)])
def test_mask_noise_changes_the_mask_alone(gym_id: str, trace: Trace, noise: str, growth: int) -> None:
    shown = start_of(gym_id, mask_noise=noise, mask_noise_px=2)
    again = start_of(gym_id, mask_noise=noise, mask_noise_px=2)
    right = trace[0][0]
    mask, right_mask = (each["pixels/target_mask"] for each in (shown, right))
    assert not np.array_equal(mask, right_mask)
    assert np.array_equal(mask, again["pixels/target_mask"])
    assert set(np.unique(mask)) == {0, 255}
    assert np.sign((mask > 0).sum(dtype=int) - (right_mask > 0).sum(dtype=int)) == growth
    del shown["pixels/target_mask"]
    assert all(np.array_equal(array, right[key]) for key, array in shown.items())


def test_noise_of_no_size_is_refused(gym_id: str) -> None:
    without_mask = {"mask_noise": "shift", "mask_noise_px": 2, "mask_condition": "zero"}
    for settings in ({"mask_noise": "shift"}, {"mask_noise_px": 2}, without_mask):
        with pytest.raises(ConfigurationError, match="mask_noise"):
            gym.make(gym_id, **settings)


def test_scene_sets_hold_other_scenes(gym_id: str) -> None:
    starts = [start_of(gym_id, scene_set=scene_set)["pixels/main"] for scene_set in ("train", "val", "test")]
    assert len({start.tobytes() for start in starts}) == 3


def test_observations_share_no_memory(trace: Trace) -> None:
    arrays = [array for observation, _ in trace[:3] for array in observation.values()]
    for i, array in enumerate(arrays):
        assert not any(np.shares_memory(array, other) for other in arrays[i + 1 :])


def test_an_observation_can_be_changed_without_harm(env: gym.Env[Any, Any], trace: Trace) -> None:
    still = np.zeros(env.action_space.shape, np.float32)  # type: ignore[arg-type]
    ends = []
    for is_spoilt in (False, True):
        observation = flat(env.reset(seed=4)[0])
        if is_spoilt:
            for array in observation.values():
                array[...] = 1
        ends.append((flat(env.step(still)[0]), 0.0))
    assert_same(ends[:1], ends[1:])


def test_the_action_is_left_alone(env: gym.Env[Any, Any]) -> None:
    env.reset(seed=4)
    action = np.full(env.action_space.shape, 2.0, np.float32)  # type: ignore[arg-type]
    env.step(action)
    assert (action == 2.0).all()


def test_the_task_is_always_named(env: gym.Env[Any, Any]) -> None:
    # Without either, LeRobot's evaluation loses its worker processes.
    for attribute in ("task", "task_description"):
        text = env.get_wrapper_attr(attribute)
        assert isinstance(text, str)
        assert text


def test_lerobot_learns_the_length_and_the_frame_rate(env: gym.Env[Any, Any]) -> None:
    assert env.get_wrapper_attr("_max_episode_steps") >= 1
    assert env.metadata["render_fps"] >= 1
    env.reset(seed=4)
    assert env.render().dtype == np.uint8  # type: ignore[union-attr]


def test_an_episode_lasts_at_least_a_frame_and_ends_with_its_metrics(gym_id: str) -> None:
    with pytest.raises(ConfigurationError, match="episode_length=0"):
        gym.make(gym_id, episode_length=0)
    env = gym.make(gym_id, episode_length=1, disable_env_checker=True)
    _, info = env.reset(seed=4)
    assert info["is_success"] is False
    _, _, terminated, truncated, info = env.step(np.zeros(env.action_space.shape, np.float32))  # type: ignore[arg-type]
    assert (terminated, truncated) == (False, True)
    assert info["is_success"] is False
    metrics = info["episode_metrics"]
    plain = {key: value for key, value in metrics.items() if key != "commands"}
    assert all(isinstance(value, (bool, int, float, str)) for value in plain.values())
    assert metrics["commands"] == [[0, info["target_id"]]]
    assert set(METRICS) <= set(metrics)
    env.close()


def test_gym_make_plays_an_episode_to_the_length_asked_for(gym_id: str) -> None:
    env = gym.make(gym_id, episode_length=201, obs_type="agent_pos", disable_env_checker=True)
    env.reset(seed=4)
    still = np.zeros(env.action_space.shape, np.float32)  # type: ignore[arg-type]
    ends = [env.step(still)[3:] for _ in range(201)]
    assert [truncated for truncated, _ in ends] == [False] * 200 + [True]
    assert ends[-1][1]["episode_metrics"]["frames"] == 201
    env.close()


@pytest.mark.parametrize(
    "spoil",
    [lambda a: a[:-1], lambda a: a[None], lambda a: a * np.nan, lambda a: a + np.inf],
    ids=["short", "batched", "nan", "infinite"],
)
def test_an_unusable_action_is_refused(env: gym.Env[Any, Any], spoil: Callable[[Any], Any]) -> None:
    env.reset(seed=4)
    with pytest.raises(ConfigurationError, match="action"):
        env.step(spoil(np.zeros(env.action_space.shape, np.float32)))  # type: ignore[arg-type]


def test_an_impossible_target_is_refused(env: gym.Env[Any, Any]) -> None:
    with pytest.raises(ConfigurationError, match="target_id"):
        env.reset(options={"scene_id": 0, "target_id": 99})


@pytest.mark.parametrize("use_async", [False, True], ids=["one process", "own processes"])
def test_lerobots_environments_give_the_same_bits_as_one_alone(gym_id: str, trace: Trace, *, use_async: bool) -> None:
    # One frame more than is played: at the end of an episode LeRobot's wrapper repeats the last transition.
    config = config_of(gym_id, episode_length=FRAMES + 1)
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
