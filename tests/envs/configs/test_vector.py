"""LeRobot's own evaluation loop counts every episode once, whatever the number of environments.

Most tests use a stand-in environment with episodes of different lengths.
"""

import json
from unittest.mock import create_autospec

import gymnasium as gym
import numpy as np
import pytest
from lerobot.envs.configs import EnvConfig
from lerobot.policies.pretrained import PreTrainedPolicy
from lerobot.scripts.lerobot_eval import eval_policy

import lerobot_excav.plugin  # noqa: F401 - registers every --env.type
from lerobot_excav.envs.configs.excavator import ExcavatorEnvConfig
from lerobot_excav.envs.configs.metrics_log import MetricsLog
from lerobot_excav.envs.configs.vector import info_of_env, make_vector_env
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

EPISODES = 5
ARM_STATE_SIZE = 7  # its actions are as long as its states


def episode_length(seed):
    return 3 + seed % 4


def countdown_maker():
    # Returns a local class, so that worker processes receive the class itself: they cannot import this file.
    class Countdown(gym.Env):
        observation_space = gym.spaces.Dict({"agent_pos": gym.spaces.Box(-np.inf, np.inf, (1,), np.float32)})
        action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        task = task_description = "count down"
        _max_episode_steps = 20

        def reset(self, *, seed=None, options=None):
            super().reset(seed=seed)
            self.seed_given = -1 if seed is None else seed
            self.left = 3 + self.seed_given % 4
            return self.observe(), {"is_success": False}

        def observe(self):
            return {"agent_pos": np.array([self.left], np.float32)}

        def step(self, action):
            self.left -= 1
            done, seed = self.left == 0, self.seed_given
            info = {"is_success": done and seed % 2 == 1}
            if done:
                metrics = {**info, "scene_id": seed, "command": float(action[0]), "note": f"seed {seed}"}
                info["episode_metrics"] = metrics
            return self.observe(), 1.0 + action[0], done, False, info

    return Countdown


def tenth(batch):
    """Answer every observation with a tenth of its state."""
    state = batch["observation.state"]
    return 0.1 * (state if state.shape[1] == ARM_STATE_SIZE else state[:, :4])


def evaluate(env, path, start_seed=100):
    """Return what LeRobot counts, and the lines of the metrics file."""
    processors = 4 * [lambda unchanged: unchanged]
    policy = create_autospec(PreTrainedPolicy, instance=True, training=False)
    policy.select_action.side_effect = tenth
    try:
        counted = eval_policy(env, policy, *processors, n_episodes=EPISODES, start_seed=start_seed)["per_episode"]
    finally:
        env.close()
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert len({line.pop("evaluation") for line in lines}) == 1
    return counted, lines


@pytest.fixture
def run(tmp_path):
    def run(n_envs, *, use_async=False, max_episodes=EPISODES):
        log = MetricsLog(tmp_path / f"{n_envs}{use_async}.jsonl", n_envs=n_envs, max_episodes=max_episodes)
        env = make_vector_env(countdown_maker(), n_envs, use_async=use_async, metrics_log=log)
        # One environment stays in this process.
        assert isinstance(env, gym.vector.AsyncVectorEnv) == (use_async and n_envs > 1)
        return evaluate(env, log.path)

    return run


def test_one_environment_counts_the_truth(run):
    counted, lines = run(1, use_async=True)
    for seed, episode, line in zip(range(100, 100 + EPISODES), counted, lines, strict=True):
        steps = episode_length(seed)
        assert episode["seed"] == line["seed"] == line["scene_id"] == seed
        assert episode["success"] == line["is_success"] == (seed % 2 == 1)
        assert episode["sum_reward"] == pytest.approx(steps + 0.1 * sum(range(1, steps + 1)))
        assert line["note"] == f"seed {seed}"


@pytest.mark.parametrize(("n_envs", "use_async"), [(3, False), pytest.param(2, True, marks=pytest.mark.slow)])
def test_several_environments_count_the_same_also_in_processes_of_their_own(run, n_envs, use_async):
    assert run(n_envs, use_async=use_async) == run(1)


@pytest.mark.slow
@pytest.mark.parametrize("task", ["Scoop-v0", "FR5Grasp-v0"])
def test_a_task_gives_the_same_alone_and_beside_others(tmp_path, task):
    spec, results = TASKS[task], []
    own = {"mask_noise": "shift", "mask_noise_px": 2, "scene_set": "test", "episode_length": 4}
    for n_envs in (1, 3):
        path = tmp_path / f"{n_envs}.jsonl"
        config = EnvConfig.get_choice_class(spec.env_type)(**own, metrics_path=path, metrics_episodes=EPISODES)
        results.append(evaluate(config.create_envs(n_envs)[spec.env_type][0], path, start_seed=1000))
    assert results[0] == results[1]
    _, lines = results[0]
    assert [(line["seed"], line["scene_id"], line["target_id"]) for line in lines] == [
        (1000 + i, 1000 + i, i % 4) for i in range(EPISODES)
    ]
    expected = {**config.task_spec.make_settings(**own).as_dict(), "simulation_version": spec.simulation_version}
    assert lines[0].items() >= {k: v for k, v in expected.items() if v is not None}.items()
    assert lines[0].items() >= {"frames": 4, "is_success": False, "commands": [[0, 0]], "shown_target_id": 0}.items()
    # What reports read of the task is there, with the right types.
    assert spec.measures.record.model_validate_json(path.read_text().splitlines()[0])


def test_surplus_episodes_are_recognisable(run):
    counted, lines = run(3, max_episodes=None)
    assert [line["episode_ix"] for line in lines] == [0, 1, 2, 3, 4, 5]
    assert len(counted) == EPISODES


def test_a_finished_environment_costs_nothing_and_repeats_its_end():
    env = make_vector_env(countdown_maker(), 2)
    env.reset(seed=[100, 103], options={"lerobot_new_rollout": True})
    steps = [env.step(np.zeros((2, 1), np.float32)) for _ in range(6)]
    env.close()
    assert [reward[0] for _, reward, *_ in steps] == [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    assert [observation["agent_pos"][0, 0] for observation, *_ in steps] == [2.0, 1.0, 0.0, 0.0, 0.0, 0.0]


def test_a_plain_reset_begins_a_new_batch(tmp_path):
    path = tmp_path / "metrics.jsonl"
    config = ExcavatorEnvConfig(observation_height=32, observation_width=48, episode_length=2, metrics_path=path)
    env = config.create_envs(1)["excavator"][0]
    still, scenes = np.zeros((1, 4), np.float32), []
    for batch in range(2):
        _, info = env.reset()
        scenes.append(int(info["scene_id"][0]))
        env.step(still)
        assert len(path.read_text().splitlines()) == batch
        env.step(still)
    env.close()
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert scenes[0] != scenes[1]
    assert [(line["episode_ix"], line["scene_id"]) for line in lines] == list(enumerate(scenes))


def test_info_of_env_leaves_out_what_another_environment_said():
    infos = {"a": np.array([1, 0]), "_a": np.array([True, False]), "_b": np.array([False, True])}
    infos["b"] = {"c": np.array([0, 2]), "_c": np.array([False, True])}
    assert [info_of_env(infos, i) for i in range(2)] == [{"a": 1}, {"b": {"c": 2}}]


def test_no_environment_at_all_is_refused():
    with pytest.raises(ConfigurationError, match="n_envs=0"):
        make_vector_env(countdown_maker(), 0)
