"""Which scene and target every episode of a recording shows, also when it is recorded again or resumed."""

import json
import operator
from collections.abc import Mapping
from pathlib import Path

from lerobot_excav.errors import ConfigurationError

LoggedStart = tuple[int, int, int]
"""Scene, stage and first target of an episode."""


class TargetOrder:
    """The current target, counted over all scenes: target t of scene s has the number s * targets per scene + t.

    With `advance=episode`, episode N shows number `first + N`, and each press of `next_scene` between two episodes
    leaves one target out; a press within an episode lasts until its end. With `advance=button` every press leads on,
    and nothing else. An episode recorded again begins as it did before, whatever was pressed within it.

    Args:
        first: Number of the first target.
        by_episode: Whether every episode gets a target of its own.
        per_scene: Targets of a scene.
        stage: Stage at which every scene is shown.
        log_path: Session log, which tells what a recording that is resumed has shown so far.
    """

    def __init__(self, first: int, *, by_episode: bool, per_scene: int, stage: int, log_path: Path) -> None:
        self._first, self._by_episode, self._per_scene, self._log_path = first, by_episode, per_scene, log_path
        self._stage = stage
        self._is_new = True  # whether no episode of this session has begun
        self._left_out = 0
        self._is_running = False  # whether an episode is
        self._pressed = 0  # within the running episode
        self.number = first

    @property
    def start(self) -> tuple[int, int]:
        """Scene and target."""
        return divmod(self.number, self._per_scene)

    def press(self) -> None:
        """Move on to the next target."""
        self.number += 1
        if self._is_running:
            self._pressed += 1
        else:
            self._left_out += 1

    def skip(self) -> None:
        """Leave out the present target for good: its start does not offer it."""
        self.number += 1
        self._left_out += 1

    def begin(self, episode_index: int) -> None:
        """Begin an episode, counted from 0 in the dataset.

        Raises:
            ConfigurationError: It is the first of this session but not of the recording, and the session log lacks an
                earlier one, or began with another target.
        """
        if self._is_new and episode_index > 0:
            self._resume(episode_index, logged_starts(self._log_path))
        self._is_new = False
        if self._by_episode:
            self.number = self._first + self._left_out + episode_index
        self._is_running, self._pressed = True, 0

    def end(self) -> None:
        """End the running episode."""
        self._is_running = False

    def discard(self) -> None:
        """Forget the episode that has ended, and what was pressed within it."""
        self.number -= self._pressed
        self._pressed = 0

    def _resume(self, episode_index: int, logged: Mapping[int, LoggedStart]) -> None:
        missing = [index for index in range(episode_index) if index not in logged]
        if missing:
            lacking = "all of them" if len(missing) == episode_index else f"episodes {missing}"
            raise ConfigurationError(
                f"this recording has {episode_index} episodes already, and robot.session_log={str(self._log_path)!r} "
                f"lacks {lacking}, so `lerobot-excav index` could not complete it. Nothing was changed. Give the file "
                "of the first session as --robot.session_log=FILE (by default it is in outputs/<robot>_sessions), or "
                "record into a new dataset and merge both once they are indexed."
            )
        scene_id, stage, target_id = logged[0]
        if (*divmod(self._first, self._per_scene), self._stage) != (scene_id, target_id, stage):
            at = f", stage {stage}" if stage or self._stage else ""
            again = f"--robot.scene_id={scene_id} --robot.target_id={target_id}"
            raise ConfigurationError(
                f"the recording that is resumed began with scene {scene_id}{at} and target {target_id}. Give {again}"
                f"{f' --robot.stage={stage}' if at else ''} again, or record into a new dataset."
            )
        scene_id, _, target_id = logged[episode_index - 1]
        last = scene_id * self._per_scene + target_id
        if self._by_episode:
            self._left_out = last + 1 - self._first - episode_index
        else:
            self.number = last


def logged_starts(path: Path) -> dict[int, LoggedStart]:
    """Return scene, stage and first target of a session log's episodes, by number; unreadable lines count as none."""
    starts: dict[int, LoggedStart] = {}
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
    except OSError:
        return starts
    for line in lines:
        try:
            episode = json.loads(line)
            if episode["event"] == "episode":
                keys = ("episode_index", "scene_id", "stage", "target_id")
                index, scene_id, stage, target_id = (operator.index(episode[key]) for key in keys)
                starts[index] = scene_id, stage, target_id
        except (ValueError, TypeError, LookupError):
            continue  # `lerobot-excav index` says what is wrong with it
    return starts
