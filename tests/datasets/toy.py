"""Small datasets of the example task `examples/toy_reach`: a disc slides to one of four spots."""

import toy_reach.env
from lerobot.datasets import LeRobotDataset
from toy_reach.spec import REACH

from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.format.schema import (
    ACTION_KEY,
    COMMAND_KEY,
    PAIR_KEY,
    SCENE_KEY,
    STAGE_KEY,
    STATE_KEY,
    TARGET_KEY,
)
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.robots.session_log import SessionLog

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


def record_small(folder):
    """Record two scenes with two targets, by storage."""
    for storage in STORAGES:
        record_toy(folder / storage, scenes=2, targets=2, storage=storage)
    return {storage: folder / storage for storage in STORAGES}


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


def write_session(dataset, path, env=None, episodes=None):
    """Write the session log of a robot that recorded a dataset."""
    log = SessionLog(path, REACH, toy_settings(env=env).env)
    log.start()
    keys = (PAIR_KEY, SCENE_KEY, STAGE_KEY, TARGET_KEY, COMMAND_KEY, STATE_KEY, ACTION_KEY)
    for episode in iterate_episodes(dataset, keys, episodes=episodes):
        log.begin(episode.index, **episode.pair.reset_options)
        since = episode.array(COMMAND_KEY)
        targets, since = ([*column[1:].tolist(), int(column[-1])] for column in (episode.target_id, since))
        for state, action, *command in zip(episode.state, episode.action, targets, since, strict=True):
            log.note_action(state.tolist(), action.tolist(), *command)
        log.end()
    log.close()
