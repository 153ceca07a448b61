"""The session log: what happened in each recorded episode, written down as it happens.

`lerobot-record` stores pictures, state and action only, and closes its files at the end: a crash leaves a dataset that
nobody can read. The log holds what a deterministic simulation needs to repeat every episode, so that `lerobot-excav
index` can complete a recording, or recover one from a crash. It is JSON Lines, one event a line:

    {"event": "session", "simulation_version": 4, "env": "excavator", "settings": {"task": "Scoop-v0", "fps": 10, ...},
     "task": "Dig where the mask points."}
    {"event": "episode", "episode_index": 3, "scene_id": 0, "stage": 0, "target_id": 3}
    {"event": "operator", "operator": "scripted"}
    {"event": "action", "state": [...], "action": [...]}
    {"event": "command", "target_id": 1}
    {"event": "held"}
    {"event": "restart", "scene_id": 0, "stage": 0, "target_id": 3, "state": [...], "action": [...]}
    {"event": "ended", "frames": 150}
    {"event": "discarded"}
    {"event": "stopped", "frames": 12}

- `session`: a robot that connected has begun to record; what the simulation is set to, and the task text of the
  command, null if nobody knows it.
- `episode`: an episode begins. `episode_index` is its number in the dataset; what an earlier line says of this number
  and of higher ones was not kept.
- `operator`: a scripted operator drives in this episode; without such a line, it is a person or a policy.
- `action`: a frame, as LeRobot records it: the state that was observed, and the action that was carried out next, both
  float32 and exact.
- `command`: another command holds from here on; its target may have the number of the one before.
- `held`: before this, the machine was held still until its mask was found.
- `restart`: the scene was restarted or changed instead of carrying the frame's action out. State and action are null
  where LeRobot had no frame to record.
- `ended`: the time for resetting the scene has begun; `discarded`: the episode was thrown away; `stopped`: the
  recording is over, by an interruption perhaps, and only the dataset tells whether it has kept the episode. `frames`
  is how many frames were noted, so that a lost line is noticed.
"""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError, DeviceError
from lerobot_excav.robots.journal import ForeignFileError, Journal
from lerobot_excav.run_lock import RunLock


def default_path(folder: str, now: datetime) -> Path:
    """Return where a session that began now is logged, below LeRobot's `outputs`, unless the user says otherwise."""
    return Path("outputs", folder, f"{now:%Y-%m-%d_%H-%M-%S}.jsonl")


class SessionLog:
    """Writes down a recording session; between episodes nothing is noted.

    Raises:
        DeviceError: From every method: the file cannot be written.
    """

    def __init__(self, path: Path, spec: TaskSpec, settings: TaskSettings, text: str | None = None) -> None:
        self.path = path
        self._lock: RunLock | None = None
        self._journal = Journal(path, mark='"event": "session"')
        self._session: dict[str, Any] = {
            "event": "session",
            "simulation_version": spec.simulation_version,
            "env": spec.env_type,
            "settings": settings.as_dict(),
            "task": text,
        }
        self._is_begun = False  # whether this session's first line is written
        self._is_running = False  # whether an episode is
        self._command: tuple[int | None, int] = (None, 0)  # target, and since which action
        self._frames = 0  # of the running episode
        self._operator: str | None = None  # of the running episode, once it is noted

    def start(self) -> None:
        """Open the file to append to it; it is made if it is missing."""
        self._is_begun = self._is_running = False
        try:
            self._journal.start()
        except ForeignFileError as error:
            raise DeviceError(
                f"robot.session_log={str(self.path)!r} exists and does not begin like a session log of this version; "
                "it stays as it is. Give another file."
            ) from error
        except OSError as error:
            raise self._failure(error) from error

    def close(self) -> None:
        """Close the file; it is removed if it is new and no episode was recorded."""
        self._is_running = False
        self._journal.close()
        if self._lock is not None:
            self._lock.release()
        self._lock = None

    def begin(self, episode_index: int, *, scene_id: int, target_id: int, stage: int = 0) -> None:
        """Begin an episode; from the first one on no other robot may write into the file."""
        if not self._is_begun:
            self._keep_others_away()
            self._write(self._session)
        self._is_begun = self._is_running = True
        self._command, self._frames, self._operator = (target_id, 0), 0, None
        start = {"scene_id": scene_id, "stage": stage, "target_id": target_id}
        self._write({"event": "episode", "episode_index": episode_index, **start})

    def note_operator(self, operator: str) -> None:
        """Note who drives, `scripted`, `person` or `policy`, in the running episode; once, however often it is told."""
        if self._is_running and operator != self._operator:
            self._operator = operator
            self._write({"event": "operator", "operator": operator})

    def note_action(
        self, state: Sequence[float], action: Sequence[float], target_id: int | None, command_frame: int = 0
    ) -> None:
        """Note a frame whose action was carried out, after which a target is commanded, since so many actions.

        A task may command another region under the same number.
        """
        if not self._is_running:
            return
        events: list[dict[str, Any]] = [{"event": "action", "state": state, "action": action}]
        command = (target_id, command_frame)
        if target_id is not None and command != self._command:
            self._command = command
            events.append({"event": "command", "target_id": target_id})
        self._frames += 1
        self._write(*events)

    def note_held(self) -> None:
        """Note that the machine was held still until its mask was found."""
        if self._is_running:
            self._write({"event": "held"})

    def note_restart(
        self,
        state: Sequence[float] | None,
        action: Sequence[float] | None,
        *,
        scene_id: int,
        target_id: int,
        stage: int = 0,
    ) -> None:
        """Note that a scene was started within the episode, and the frame in which that was asked for."""
        if self._is_running:
            self._command = (target_id, 0)
            self._frames += state is not None and action is not None
            start = {"scene_id": scene_id, "stage": stage, "target_id": target_id}
            self._write({"event": "restart", **start, "state": state, "action": action})

    def end(self) -> None:
        """Note that the episode has ended; it may still be discarded."""
        self._finish("ended")

    def stop(self) -> None:
        """Note that the recording is over."""
        self._finish("stopped")

    def discard(self) -> None:
        """Note that the episode that ran last is not kept."""
        self._is_running = False
        if self._is_begun:
            self._write({"event": "discarded"})

    def _keep_others_away(self) -> None:
        """Lock the file: the lines of two recordings could not be told apart."""
        if self._lock is not None:
            return
        try:
            self._lock = RunLock(self.path.with_name(f".{self.path.name}.lock"), self.path)
        except DatasetError as error:
            raise DeviceError(f"robot.session_log={str(self.path)!r}: {error}. Or give another file.") from error
        except OSError as error:
            raise self._failure(error) from error

    def _finish(self, event: str) -> None:
        if self._is_running:
            self._write({"event": event, "frames": self._frames}, is_last=True)
        self._is_running = False

    def _write(self, *events: dict[str, Any], is_last: bool = False) -> None:
        try:
            self._journal.write(*events)
            if is_last:
                self._journal.sync()
        except OSError as error:
            self._is_running = False
            raise self._failure(error) from error

    def _failure(self, error: OSError) -> DeviceError:
        return DeviceError(
            f"robot.session_log={str(self.path)!r} cannot be written ({error.strerror}); give a file in a folder of "
            "your own, on a disk with room. Without it `lerobot-excav index` can neither complete nor recover this "
            "recording."
        )
