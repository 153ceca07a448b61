"""Many worlds in one process: each is the world that it would be alone, and they step at the same time."""

import threading

import gymnasium as gym
import numpy as np
import pytest

import lerobot_excav  # noqa: F401 - registers the tasks
from lerobot_excav.envs.tasks.many_worlds import ManyWorlds
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

WORLDS, FRAMES, LENGTH = 3, 9, 4
OWN = [spec for spec in TASKS.values() if spec.env_entry.startswith("lerobot_excav.")]
FAST = {"fidelity": "fast"}


def settings_of(spec, **others):
    return {"episode_length": LENGTH, **(FAST if spec.env_type == "excavator" else {}), **others}


def actions_of(env):
    rng = np.random.default_rng(7)
    return [rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32) for _ in range(FRAMES)]


def assert_same(mine, other):
    """Compare bit by bit what may hold dictionaries and arrays of objects, and NaN for what has not been measured."""
    if isinstance(mine, dict):
        assert list(mine) == list(other)
        mine, other = list(mine.values()), list(other.values())
    if isinstance(mine, list | tuple) or (isinstance(mine, np.ndarray) and mine.dtype.hasobject):
        for inner, others_inner in zip(mine, other, strict=True):
            assert_same(inner, others_inner)
    else:
        np.testing.assert_array_equal(mine, other, strict=True)


def played(vector, seed=3):
    """Play past the end of an episode; return all that came back."""
    steps = [vector.reset(seed=seed)]
    steps += [vector.step(action) for action in actions_of(vector)]
    vector.close()
    return steps


@pytest.mark.parametrize("autoreset_mode", ["NextStep", pytest.param("SameStep", marks=pytest.mark.slow)])
@pytest.mark.parametrize("obs_type", ["agent_pos", pytest.param("pixels_agent_pos", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "spec",
    [pytest.param(s, marks=pytest.mark.slow, id=s.id) if "Clear" in s.id else pytest.param(s, id=s.id) for s in OWN],
)
def test_each_world_is_bit_by_bit_the_one_that_it_would_be_alone(spec, obs_type, autoreset_mode):
    settings = settings_of(spec, obs_type=obs_type)
    ours = gym.make_vec(spec.gym_id, WORLDS, autoreset_mode=autoreset_mode, threads=2, **settings)
    theirs = gym.make_vec(
        spec.gym_id, WORLDS, vectorization_mode="sync", vector_kwargs={"autoreset_mode": autoreset_mode}, **settings
    )
    assert_same(played(ours), played(theirs))


def make(task="Scoop-v0", **settings):
    return ManyWorlds(WORLDS, task=task, obs_type="agent_pos", episode_length=LENGTH, **settings)


def test_worlds_step_at_the_same_time():
    vector = make(threads=WORLDS, **FAST)
    vector.reset(seed=0)
    together = threading.Barrier(WORLDS, timeout=60.0)
    for env in vector.envs:
        step = env.env.step
        env.env.step = lambda action, step=step: (together.wait(), step(action))[1]
    vector.step(np.zeros(vector.action_space.shape, np.float32))
    vector.close()


def test_no_more_worlds_step_at_the_same_time_than_there_are_threads():
    vector = make(threads=1, **FAST)
    vector.reset(seed=0)
    names = set()
    for env in vector.envs:
        step = env.env.step
        env.env.step = lambda action, step=step: (names.add(threading.current_thread().name), step(action))[1]
    vector.step(np.zeros(vector.action_space.shape, np.float32))
    vector.close()
    assert names == {"world_0"}


def test_seeds_may_be_one_for_each_world_and_some_worlds_may_be_reset_alone():
    vector = make("FR5Grasp-v0")
    vector.reset(seed=[5, 9, 2])
    assert [env.get_wrapper_attr("scene_id") for env in vector.envs] == [5, 9, 2]
    kept = vector.step(np.zeros(vector.action_space.shape, np.float32))[0]["agent_pos"][[0, 2]]
    observation, _ = vector.reset(seed=7, options={"reset_mask": np.array([False, True, False])})
    assert [env.get_wrapper_attr("scene_id") for env in vector.envs] == [5, 8, 2]
    assert np.array_equal(observation["agent_pos"][[0, 2]], kept)
    vector.close()


def test_options_reach_every_world():
    vector = make("FR5Grasp-v0")
    vector.reset(options={"scene_id": 4, "target_id": 2})
    assert [env.get_wrapper_attr("target_id") for env in vector.envs] == [2] * WORLDS
    vector.close()


def frames_of(vector):
    return [env.unwrapped._frame for env in vector.envs]


def wrong_actions(vector):
    """Return actions that a world refuses, and too few of them."""
    bad = np.zeros(vector.action_space.shape, np.float32)
    bad[0] = np.nan
    return bad, bad[1:]


@pytest.mark.parametrize("which", [0, 1], ids=["one is not a number", "one is missing"])
def test_after_a_step_that_fails_the_worlds_step_as_before(which):
    vector = make("FR5Grasp-v0")
    vector.reset(seed=0)
    with pytest.raises(ConfigurationError, match="action"):
        vector.step(wrong_actions(vector)[which])
    assert all(env.begun is None for env in vector.envs)
    before = frames_of(vector)
    vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert frames_of(vector) == [frame + 1 for frame in before]
    vector.close()


@pytest.mark.parametrize("wrong", [{"seed": [1]}, {"options": {"reset_mask": [True, False, False]}}])
def test_a_reset_that_is_refused_leaves_nothing_behind(wrong):
    vector = make("FR5Grasp-v0")
    vector.reset(seed=0)
    for _ in range(LENGTH):
        *_, truncated, _ = vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert truncated.all()
    with pytest.raises((ValueError, TypeError)):
        vector.reset(**wrong)
    *_, truncated, _ = vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert frames_of(vector) == [0] * WORLDS  # the next episode has begun
    assert not truncated.any()
    vector.close()


def test_worlds_that_ended_wait_for_a_reset_where_none_is_made_by_itself():
    vector = make("FR5Grasp-v0", autoreset_mode="Disabled")
    vector.reset(seed=0)
    for _ in range(LENGTH):
        *_, truncated, _ = vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert truncated.all()
    with pytest.raises(ConfigurationError, match="reset_mask"):
        vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert frames_of(vector) == [LENGTH] * WORLDS
    vector.reset(seed=1, options={"reset_mask": truncated})
    assert frames_of(vector) == [0] * WORLDS
    vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert frames_of(vector) == [1] * WORLDS
    vector.close()


def test_it_can_be_closed_while_worlds_are_at_work_and_twice():
    vector = make(**FAST)
    vector.reset(seed=0)
    for world in vector.envs:
        world.begin(lambda world=world: world.env.step(np.zeros(4, np.float32)))
    vector.close()
    vector.close()


@pytest.mark.parametrize(
    ("settings", "named"),
    [({"num_envs": 0}, "num_envs=0"), ({"threads": 0}, "threads=0"), ({"autoreset_mode": "later"}, "autoreset_mode")],
)
def test_what_is_not_possible_is_named(settings, named):
    with pytest.raises(ConfigurationError, match=named):
        ManyWorlds(**{"num_envs": 2, "task": "Scoop-v0", **settings})
