"""Vector environments in which LeRobot's evaluation scores every episode once.

`lerobot-eval` sums rewards and looks for success up to one step after the end of an episode. With several
environments that step belongs to the next episode, which an automatic reset has already begun. Here an
environment whose episode has ended repeats its last transition with reward 0, at no cost, until LeRobot
starts the next batch. The result of an episode then depends neither on the number of environments nor on
whether they live in processes of their own.
"""

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium as gym
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from lerobot.envs.utils import NEW_ROLLOUT_OPTION, freeze_after_episode_end

from lerobot_excav.envs.configs.metrics_log import MetricsLog
from lerobot_excav.errors import require


def make_vector_env(
    make_env: Callable[[], gym.Env[Any, Any]],
    n_envs: int,
    *,
    use_async: bool = False,
    metrics_log: MetricsLog | None = None,
) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Create a vector environment for `lerobot-eval`, whose metrics log hears of the last step of every episode.

    With `use_async` each environment gets a process of its own (a fork server's, so no simulator is inherited), and
    `make_env` must be picklable. One environment always stays in this process.

    Raises:
        ConfigurationError: `n_envs` is below 1.
    """
    require(n_envs >= 1, f"n_envs={n_envs} is not possible; give --eval.batch_size a number from 1 on.")
    makers = [freeze_after_episode_end(make_env) for _ in range(n_envs)]
    vector: _LoggedVectorEnv
    if use_async and n_envs > 1:
        vector = LoggedAsyncVectorEnv(makers, context="forkserver", autoreset_mode=AutoresetMode.SAME_STEP)
    else:
        vector = LoggedSyncVectorEnv(makers, autoreset_mode=AutoresetMode.SAME_STEP)
    vector.metrics_log = metrics_log
    return vector


class _LoggedVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """Report the end of every episode to a metrics log, in the main process."""

    metrics_log: MetricsLog | None = None

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset every environment, ended or not; begins a batch of the metrics log."""
        if self.metrics_log is not None:
            self.metrics_log.begin_batch(_seed_of_each(seed, self.num_envs))
        return super().reset(seed=seed, options={**(options or {}), NEW_ROLLOUT_OPTION: True})

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step every environment; hands the episodes that end to the metrics log."""
        observations, rewards, terminated, truncated, info = super().step(actions)
        if self.metrics_log is not None and "final_info" in info:
            for index in range(self.num_envs):
                if info["_final_info"][index]:
                    self.metrics_log.finish_episode(index, info_of_env(info["final_info"], index))
        return observations, rewards, terminated, truncated, info


class LoggedSyncVectorEnv(_LoggedVectorEnv, SyncVectorEnv):
    """Environments that share this process."""


class LoggedAsyncVectorEnv(_LoggedVectorEnv, AsyncVectorEnv):
    """Environments in processes of their own."""


def info_of_env(infos: Mapping[str, Any], index: int) -> dict[str, Any]:
    """Pick one environment's information out of Gymnasium's arrays, which say under `_key` who has a value of `key`."""
    return {
        key: info_of_env(values, index) if isinstance(values, Mapping) else values[index]
        for key, values in infos.items()
        if f"_{key}" in infos and infos[f"_{key}"][index]
    }


def _seed_of_each(seed: Any, n_envs: int) -> list[int | None]:
    """Spell a seed out for every environment, as Gymnasium's `reset` does."""
    if seed is None:
        return [None] * n_envs
    return [seed + i for i in range(n_envs)] if isinstance(seed, int) else list(seed)
