"""`env.py` as LeRobot's EnvHub loads it: from the local cache of the Hub, so without a network."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from lerobot.envs.configs import HubEnvConfig
from lerobot.envs.factory import make_env
from lerobot.envs.utils import close_envs

import lerobot_excav.plugin  # noqa: F401
from lerobot_excav.errors import ConfigurationError

ENV_FILE = Path(__file__).parents[1] / "env.py"
COMMIT = "0" * 40


@pytest.fixture
def hub_cache(tmp_path):
    """The folder that a download of the repository `user/digging` leaves."""
    repository = tmp_path / "models--user--digging"
    (repository / "refs").mkdir(parents=True)
    (repository / "refs" / "main").write_text(COMMIT)
    (repository / "snapshots" / COMMIT).mkdir(parents=True)
    shutil.copy(ENV_FILE, repository / "snapshots" / COMMIT / "env.py")
    return str(tmp_path)


@pytest.mark.parametrize(
    ("cfg", "name", "state_size"),
    [("user/digging", "excavator", 8), ({"task": None}, "excavator", 8), ({"task": "FR5Grasp-v0"}, "fr5_grasp", 7)],
)
def test_the_hub_gives_an_environment_that_runs(hub_cache, cfg, name, state_size):
    if isinstance(cfg, dict):
        cfg = HubEnvConfig(hub_path="user/digging@main:env.py", **cfg)
    envs = make_env(cfg, n_envs=2, hub_cache_dir=hub_cache, trust_remote_code=True)
    assert {suite: list(tasks) for suite, tasks in envs.items()} == {name: [0]}
    vector = envs[name][0]
    observation, _ = vector.reset(seed=[1, 2])
    assert observation["agent_pos"].shape == (2, state_size)
    observation, *_ = vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert observation["pixels"]["target_mask"].shape == (2, 96, 128, 3)
    close_envs(envs)


def test_an_unknown_task_is_refused_with_what_is_allowed(hub_cache):
    cfg = HubEnvConfig(hub_path="user/digging", task="Dance-v0")
    with pytest.raises(ConfigurationError, match=r"'Dance-v0'.*Scoop-v0.*FR5Grasp-v0"):
        make_env(cfg, hub_cache_dir=hub_cache, trust_remote_code=True)
