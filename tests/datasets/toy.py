"""Small datasets of the example task `examples/toy_reach`: a disc slides to one of four spots."""

import toy_reach.env
from lerobot.datasets import LeRobotDataset

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations

STATE, MAIN, MASK = "observation.state", "observation.images.main", "observation.images.target_mask"
SMALL = {"observation_height": 32, "observation_width": 48}

CHANGE_FRAME = 4
"""Before any disc has been on its spot for long enough."""


def toy_settings(env=None, **settings):
    """Make settings of three scenes and small pictures; `env` and keywords change them."""
    return DemonstrationSettings.of("toy_reach", {**SMALL, **(env or {})}, **{"scenes": 3, **settings})


def record_toy(out, *, resume=False, **settings):
    """Record a dataset in this process."""
    return record_demonstrations(toy_settings(**settings), out, workers=0, resume=resume, show_progress=False)


def command_next_spot(patch):
    """Let the task command the next spot within every episode."""
    patch.setattr(
        toy_reach.env.ReachEnv,
        "_next_target",
        lambda env: (env.target_id + 1) % 4 if env._frame == CHANGE_FRAME else None,
    )


def load(root, episodes=None):
    """Open a dataset by LeRobot's own class."""
    return LeRobotDataset(f"local/{root.name}", root=root, episodes=episodes, video_backend="pyav")
