"""The session log: what each recorded episode was, so that its columns can be computed afterwards.

`lerobot-record` stores pictures, state and action only. The log adds what a deterministic re-simulation
needs (`lerobot-excav index` does it): one JSON object per recorded episode,

    {"episode_index": 3, "simulation_version": 2, "scene_set": "train", "scene_id": 0, "target_id": 3,
     "fps": 10, "soil": "sand", "fidelity": "standard", "observation_height": 96, "observation_width": 128,
     "task": "Scoop-v0", "frames": 120, "restarts": []}

`soil` and `fidelity` are the excavator's; the lines of other machines name their environment as `env` instead.
`episode_index` is the episode's number in the dataset when it was recorded, `frames` how many actions were
carried out, and `restarts` after which of them somebody restarted or changed the scene within the episode;
an episode with restarts is no single demonstration and cannot be re-simulated from its start.

A line is written when its episode has ended and is not being re-recorded. Where two lines have one
`episode_index`, the later holds: an interrupted recording that was resumed records that number again. For
the same reason the last line may name an episode that an interruption kept out of the dataset.
"""

import json
from datetime import datetime
from pathlib import Path
from typing import Any

from lerobot_excav.errors import DeviceError


def default_path(folder: str, now: datetime) -> Path:
    """Return where a session that began at a time is logged unless the user says otherwise.

    Args:
        folder: Folder below LeRobot's `outputs` for the sessions of one kind of robot.
        now: When the session began.
    """
    return Path("outputs", folder, f"{now:%Y-%m-%d_%H-%M-%S}.jsonl")


class SessionLog:
    """Append the episodes of a recording session to a file.

    Args:
        path: File to append to; it is made, with its folder, when the first episode has ended.
        common: Entries that every episode shares.
    """

    def __init__(self, path: Path, common: dict[str, Any]) -> None:
        self.path = path
        self._common = common
        self._episode: dict[str, Any] | None = None
        self._is_running = False

    def begin(self, episode_index: int, *, scene_id: int, target_id: int) -> None:
        """Begin an episode; the one before is written unless it had the same number."""
        if self._episode is not None and self._episode["episode_index"] != episode_index:
            self.write()
        self._episode = {
            "episode_index": episode_index,
            "scene_id": scene_id,
            "target_id": target_id,
            **self._common,
            "frames": 0,
            "restarts": [],
        }
        self._is_running = True

    def count_frame(self) -> None:
        """Count an action of the episode; between episodes, count nothing."""
        if self._is_running and self._episode is not None:
            self._episode["frames"] += 1

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
