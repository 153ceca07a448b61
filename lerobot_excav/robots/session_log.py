"""The session log: what each recorded episode was, so that its columns can be computed afterwards.

`lerobot-record` stores pictures, state and action only. The log adds what a deterministic re-simulation
needs (`lerobot-excav index` does it): one JSON object per recorded episode,

    {"episode_index": 3, "simulation_version": 2, "env": "excavator", "scene_id": 0, "commands": [[0, 3]],
     "settings": {"task": "Scoop-v0", "fps": 10, "soil": "sand", ...}, "frames": 120, "restarts": []}

`episode_index` is the episode's number in the dataset when it was recorded, `commands` after how many actions which
target was commanded, `settings` what the simulation was set to, `frames` how many actions were carried out, and
`restarts` after which of them somebody restarted or changed the scene within the episode, or the machine was held still
until its mask was found; an episode with restarts cannot be re-simulated from its start.

A line is written when its episode has ended and is not being re-recorded. Where two lines have one
`episode_index`, the later holds: an interrupted recording that was resumed records that number again. For
the same reason the last line may name an episode that an interruption kept out of the dataset.
"""

import json
from datetime import datetime
from pathlib import Path
from typing import Any

from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DeviceError


def default_path(folder: str, now: datetime) -> Path:
    """Return where a session that began now is logged, below LeRobot's `outputs`, unless the user says otherwise."""
    return Path("outputs", folder, f"{now:%Y-%m-%d_%H-%M-%S}.jsonl")


class SessionLog:
    """Append the episodes of a recording session to a file; it is made when the first episode has ended."""

    def __init__(self, path: Path, spec: TaskSpec, settings: TaskSettings) -> None:
        self.path = path
        self._common = {
            "simulation_version": spec.simulation_version,
            "env": spec.env_type,
            "settings": settings.as_dict(),
        }
        self._episode: dict[str, Any] | None = None
        self._is_running = False

    def begin(self, episode_index: int, *, scene_id: int, target_id: int) -> None:
        """Begin an episode; the one before is written unless it had the same number."""
        if self._episode is not None and self._episode["episode_index"] != episode_index:
            self.write()
        self._episode = {
            "episode_index": episode_index,
            **self._common,
            "scene_id": scene_id,
            "commands": [[0, target_id]],
            "frames": 0,
            "restarts": [],
        }
        self._is_running = True

    def count_frame(self, target_id: int | None) -> None:
        """Count an action of the episode, after which a target is commanded; between episodes, count nothing."""
        if not self._is_running or self._episode is None:
            return
        self._episode["frames"] += 1
        commands = self._episode["commands"]
        if target_id is not None and target_id != commands[-1][1]:
            commands.append([self._episode["frames"], target_id])

    def note_restart(self) -> None:
        """Note that the scene was restarted or changed within the episode, if one is running."""
        if self._is_running and self._episode is not None:
            self._episode["restarts"].append(self._episode["frames"])

    def pause(self) -> None:
        """Note that the episode has ended; it may still be discarded."""
        self._is_running = False

    def discard(self) -> None:
        """Forget the episode that has ended."""
        self._episode, self._is_running = None, False

    def write(self) -> None:
        """Append the episode, if there is one.

        Raises:
            DeviceError: The file cannot be written.
        """
        if self._episode is None:
            return
        # What was commanded after the last action was never obeyed, nor shown in a frame.
        commands, frames = self._episode["commands"], self._episode["frames"]
        self._episode["commands"] = [commands[0], *(change for change in commands[1:] if change[0] < frames)]
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(self._episode) + "\n")
        except OSError as error:
            raise DeviceError(
                f"robot.session_log={str(self.path)!r} cannot be written ({error.strerror}); give a file in "
                "a folder of your own. Without it `lerobot-excav index` cannot complete this recording."
            ) from error
        self.discard()
