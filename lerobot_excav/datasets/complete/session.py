"""What the simulated robot noted while `lerobot-record` recorded: which scene and targets each episode shows.

The file is JSON Lines, one object per episode; `robots.session_log` writes it.
"""

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, ValidationError

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.envs.tasks.registry import env_types, task_of_settings
from lerobot_excav.envs.tasks.selection import Schedule, checked_schedule
from lerobot_excav.envs.tasks.settings import LAST_SCENE, TaskSettings
from lerobot_excav.errors import ConfigurationError, DatasetError, require, require_choice, require_integer


class SessionEpisode(BaseModel):
    """One recorded episode, a line of the file.

    Attributes:
        episode_index: Its number when it was recorded.
        simulation_version: Version of the simulation.
        env: Name of the environment.
        settings: What the simulation was set to, by name.
        scene_id: Scene.
        commands: After how many actions which target was commanded; the first at the start.
        frames: How many actions were carried out.
        restarts: Actions after which the scene was restarted within the episode.
    """

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    episode_index: NonNegativeInt
    simulation_version: int
    env: str
    settings: dict[str, Any]
    scene_id: int = Field(ge=0, le=LAST_SCENE)
    commands: list[list[int]] = Field(min_length=1)
    frames: NonNegativeInt
    restarts: list[NonNegativeInt]

    @property
    def task_settings(self) -> TaskSettings:
        """Settings of an environment that behaves as the robot did."""
        return env_types()[self.env].settings.of(self.settings)

    @property
    def pair(self) -> Pair:
        """Scene and first target."""
        return Pair(self.env, self.task_settings.scene_set, self.scene_id, self.commands[0][1])

    @property
    def schedule(self) -> Schedule:
        """Changes of the command."""
        return tuple((frame, target_id) for frame, target_id in self.commands[1:])


def read_session(path: Path) -> dict[int, SessionEpisode]:
    """Read the episodes of a session, by index; blank lines are left out.

    Of two lines with one index the later counts: the robot repeats a number when an episode was recorded again.

    Raises:
        DatasetError: The file is missing, or a line is not what it should be: it is no JSON object, lacks a field, or
            has an environment, a setting, a scene or a target that is not possible. The message names line and field.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        raise DatasetError(f"{path} does not exist; the robot wrote its session to --robot.session_log") from None
    episodes = [_episode(line, f"{path}:{number}") for number, line in enumerate(lines, 1) if line.strip()]
    return {episode.episode_index: episode for episode in episodes}


def _episode(line: str, place: str) -> SessionEpisode:
    try:
        episode = SessionEpisode.model_validate_json(line)
        _require_playable(episode)
    except ValidationError as error:
        problems = "; ".join(map(_in_words, error.errors()))
        raise DatasetError(f"{place}: {problems}; is it a session log of a simulated robot?") from None
    except ConfigurationError as error:
        raise DatasetError(f"{place}: {error}") from None
    return episode


def _in_words(problem: Any) -> str:
    name = ".".join(map(str, problem["loc"]))
    words = {
        "missing": f"lacks {name}",
        "extra_forbidden": f"{name} is not known",
        "json_invalid": f"not JSON ({problem['msg']}); was its writer interrupted? Remove the line if it is the last",
        "model_type": "a JSON object is expected",
    }
    return words.get(problem["type"], f"{name}={problem['input']!r}: {problem['msg']}")


def _require_playable(episode: SessionEpisode) -> None:
    require_choice("env", episode.env, tuple(env_types()))
    targets = task_of_settings(episode.task_settings).target_count
    first, *changes = episode.commands
    require(
        len(first) == 2 and first[0] == 0,
        f"commands={episode.commands!r} is not possible; it begins with [0, first target]",
    )
    require_integer("commands: target_id", first[1], 0, targets - 1)
    checked_schedule(changes, targets, episode.frames)
