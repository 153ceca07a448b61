"""What the simulated robot noted while `lerobot-record` recorded: which scene and target each episode shows.

The file is JSON Lines, one object per episode; `robots.excavator_sim.session_log` writes it.
"""

from dataclasses import dataclass, fields
from pathlib import Path

from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.json_lines import Line, read_json_lines
from lerobot_excav.datasets.pair import Pair
from lerobot_excav.envs.simulation_version import UNMARKED_VERSION
from lerobot_excav.errors import DatasetError

_ENDLESS_FRAMES = 2**31 - 1  # the person with the joystick, not the environment, ended the episode


@dataclass(frozen=True, kw_only=True)
class SessionEpisode:
    """One recorded episode.

    Attributes:
        simulation_version: Version of the simulation.
        episode_index: Its number when it was recorded.
        scene_set: Scene set.
        scene_id: Scene.
        target_id: Target.
        fps: Frames per second.
        soil: Name of the soil preset.
        fidelity: Numerical effort of the soil.
        observation_height: Image height [px].
        observation_width: Image width [px].
        task: Task of the environment.
        frames: How many actions were carried out; None if the line does not say.
        restarts: Frames after which the scene was restarted within the episode.
    """

    simulation_version: int
    episode_index: int
    scene_set: str
    scene_id: int
    target_id: int
    fps: int
    soil: str
    fidelity: str
    observation_height: int
    observation_width: int
    task: str
    frames: int | None = None
    restarts: tuple[int, ...] = ()

    @property
    def pair(self) -> Pair:
        """Scene and target."""
        return Pair("excavator", self.scene_set, self.scene_id, self.target_id)

    def settings(self) -> DemonstrationSettings:
        """Return the settings of an environment that behaves as the robot did."""
        return DemonstrationSettings(
            task=self.task,
            scene_set=self.scene_set,
            fps=self.fps,
            height=self.observation_height,
            width=self.observation_width,
            soil=self.soil,
            fidelity=self.fidelity,
            episode_length=_ENDLESS_FRAMES,
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
    # The first version wrote neither its number nor the fidelity, of which it had one only.
    record = {"simulation_version": UNMARKED_VERSION, **line.record}
    if record["simulation_version"] == UNMARKED_VERSION:
        record.setdefault("fidelity", "standard")
    values = {field.name: record[field.name] for field in fields(SessionEpisode) if field.name in record}
    missing = {field.name for field in fields(SessionEpisode)} - {"frames", "restarts"} - set(values)
    if missing:
        raise DatasetError(
            f"{line.place}: lacks {', '.join(sorted(missing))}; is it a session log of excavator_sim?"
        )
    return SessionEpisode(**{**values, "restarts": tuple(values.get("restarts", ()))})
