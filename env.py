"""The environments of `lerobot_excav` for LeRobot's EnvHub: put this file into a repository of the Hugging Face Hub.

LeRobot downloads it and calls `make_env`; the package itself must be installed (`pip install lerobot_env_excav`):

    from lerobot.envs.factory import make_env

    envs = make_env("user/repository", n_envs=2, trust_remote_code=True)
    vector_env = envs["excavator"][0]

`lerobot-eval --env.type=excavator` does the same without the Hub.
"""

from typing import Any

import gymnasium as gym
from lerobot.envs.configs import EnvConfig

import lerobot_excav.plugin  # noqa: F401 - registers the configurations
from lerobot_excav.errors import ConfigurationError


def make_env(
    n_envs: int = 1,
    use_async_envs: bool = False,  # noqa: FBT001, FBT002 - LeRobot's signature
    cfg: EnvConfig | None = None,
) -> dict[str, dict[int, gym.vector.VectorEnv[Any, Any, Any]]]:
    """Create the environment of one evaluation.

    Args:
        n_envs: Number of environments that run side by side.
        use_async_envs: Whether each gets its own process; needs `n_envs` > 1 to have an effect.
        cfg: LeRobot's `HubEnvConfig`. Only its `task` is read, for example "Scoop-v0" or "FR5Grasp-v0". None, or a
            task of None: the excavator with its default task.

    Returns:
        `{name of the environment: {0: vector environment}}`.

    Raises:
        ConfigurationError: No environment of this package has the task.
    """
    config = config_for(cfg.task if cfg is not None else None)
    envs: dict[str, dict[int, gym.vector.VectorEnv[Any, Any, Any]]] = config.create_envs(n_envs, use_async_envs)
    return envs


def config_for(task: str | None) -> EnvConfig:
    """Return the configuration of the environment that has a task; None: the excavator's default.

    Raises:
        ConfigurationError: No environment of this package has the task.
    """
    if task is None:
        return EnvConfig.get_choice_class("excavator")()
    refusals = []
    for choice in EnvConfig.get_known_choices().values():
        if choice.__module__.startswith("lerobot_excav."):
            try:
                return choice(task=task)
            except ConfigurationError as error:
                refusals.append(str(error))
    raise ConfigurationError(" ".join(refusals))
