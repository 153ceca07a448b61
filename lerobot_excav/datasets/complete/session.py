"""What the simulated robot noted while `lerobot-record` recorded: which scene and target each episode shows.

The file is JSON Lines, one object per episode; `robots.session_log` writes it.
"""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.format.json_lines import Line, read_json_lines
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.environment import EnvironmentDescription
from lerobot_excav.datasets.record.environments import environment_named
from lerobot_excav.envs.tasks.settings import (
    ENDLESS_FRAMES,
    LAST_SCENE,
    TARGETS_PER_SCENE,
    require_integer,
    require_task,
    require_view_settings,
)
from lerobot_excav.errors import DatasetError, require, require_choice


@dataclass(frozen=True, kw_only=True)
class SessionEpisode:
    """One recorded episode.

    Attributes:
        simulation_version: Version of the simulation.
        episode_index: Its number when it was recorded.
        env: Name of the environment.
        scene_set: Scene set.
        scene_id: Scene.
        target_id: Target.
        fps: Frames per second.
        observation_height: Image height [px].
        observation_width: Image width [px].
        task: Task of the environment.
        frames: How many actions were carried out; None if the line does not say.
        extra: Settings that not every environment has, by name.
        restarts: Frames after which the scene was restarted within the episode.
    """

    simulation_version: int
    episode_index: int
    env: str
    scene_set: str
    scene_id: int
    target_id: int
    fps: int
    observation_height: int
    observation_width: int
    task: str
    extra: dict[str, str]
    frames: int | None = None
    restarts: tuple[int, ...] = ()

    @property
    def pair(self) -> Pair:
        """Scene and target."""
        return Pair(self.env, self.scene_set, self.scene_id, self.target_id)

    def settings(self, *, episode_length: int = ENDLESS_FRAMES) -> DemonstrationSettings:
        """Return the settings of an environment that behaves as the robot did.

        Args:
            episode_length: Time limit [frames]; none by default.
        """
        return DemonstrationSettings.of(
            self.env,
            task=self.task,
            scene_set=self.scene_set,
            fps=self.fps,
            height=self.observation_height,
            width=self.observation_width,
            episode_length=episode_length,
            **self.extra,
        )


def read_session(path: Path) -> dict[int, SessionEpisode]:
    """Read a session.

    Args:
        path: The JSON Lines file.

    Returns:
        Episodes by index. Of two lines with one index the later counts: the robot repeats a number when an episode
        was recorded again.

    Raises:
        DatasetError: The file is missing, or a line is not what it should be.
    """
    lines = read_json_lines(path, origin="the robot wrote its session to --robot.session_log")
    episodes = [_episode(line) for line in lines]
    return {episode.episode_index: episode for episode in episodes}


def _episode(line: Line) -> SessionEpisode:
    # The first version wrote neither its number nor the fidelity, of which it had one only; and only the other
    # environments name themselves.
    record = {"env": "excavator", **line.record}
    environment = environment_named(f"{line.place}: env", record["env"])
    known, unmarked = environment.settings, environment.unmarked_version
    if unmarked is not None and record.setdefault("simulation_version", unmarked) == unmarked:
        record.setdefault("fidelity", known["fidelity"].unmarked)
    required = ({field.name for field in fields(SessionEpisode)} - {"frames", "restarts", "extra"}) | set(
        known
    )
    missing = required - set(record)
    if missing:
        raise DatasetError(
            f"{line.place}: lacks {', '.join(sorted(missing))}; is it a session log of a simulated robot?"
        )
    _check_values(record, environment, line.place)
    return SessionEpisode(
        **{name: record[name] for name in required - set(known)},
        extra={name: record[name] for name in known},
        frames=record.get("frames"),
        restarts=tuple(record.get("restarts", ())),
    )


def _check_values(record: dict[str, Any], environment: EnvironmentDescription, place: str) -> None:
    view = ("scene_set", "fps", "observation_height", "observation_width")
    require_view_settings(f"{place}: ", **{name: record[name] for name in view})
    require_integer(f"{place}: simulation_version", record["simulation_version"], 1)
    require_integer(f"{place}: episode_index", record["episode_index"], 0)
    require_task(f"{place}: task", record["task"], environment.tasks)
    require_integer(f"{place}: scene_id", record["scene_id"], 0, LAST_SCENE)
    require_integer(f"{place}: target_id", record["target_id"], 0, TARGETS_PER_SCENE - 1)
    for name, setting in environment.settings.items():
        require_choice(f"{place}: {name}", record[name], setting.choices)
    if record.get("frames") is not None:
        require_integer(f"{place}: frames", record["frames"], 0)
    restarts = record.get("restarts", [])
    require(
        isinstance(restarts, list), f"{place}: restarts={restarts!r} is not possible; give a list of frames"
    )
    for frame in restarts:
        require_integer(f"{place}: restarts", frame, 0)
