"""Where `lerobot-record` and `lerobot-rollout` stand in a recording, learnt from what they announce.

LeRobot tells a robot nothing about episodes. Both commands announce every phase in the log, in the thread that drives
the robot and before the phase begins, so a handler of the root logger marks the exact boundaries. A rollout of strategy
`sentry` cuts one long run into episodes; it announces the start, and every cut.
The announcements are not an interface of LeRobot: the tests record for real, to notice when they change.
"""

import logging
import re
from collections.abc import Callable

_EPISODE = re.compile(r"Recording episode (\d+)")
_RESET = "Reset the environment"
_REPEAT = "Re-record episode"
_STOP = "Stop recording"

_DATASET = "lerobot.rollout.context"
_READY = re.compile(r"Dataset ready: .* \((\d+) existing episodes\)")
_SENTRY = "lerobot.rollout.strategies.sentry"
_CUT = re.compile(r"Episode (\d+) saved")


class RecordingPhases(logging.Handler):
    """A handler for the root logger that calls back at every boundary of a recording.

    Args:
        on_episode: Called with the number of the episode that begins.
        on_pause: Called when an episode has ended and the time for resetting begins.
        on_discard: Called when the episode just recorded is thrown away.
        on_stop: Called when the recording is over.
    """

    def __init__(
        self,
        *,
        on_episode: Callable[[int], None],
        on_pause: Callable[[], None],
        on_discard: Callable[[], None],
        on_stop: Callable[[], None],
    ) -> None:
        super().__init__(level=logging.INFO)
        self._on_episode, self._on_pause = on_episode, on_pause
        self._on_other = {
            ("root", _RESET): on_pause,
            ("root", _REPEAT): on_discard,
            ("root", _STOP): on_stop,
            (_SENTRY, "Sentry control loop ended — saving final episode"): on_pause,
            (_SENTRY, "Stopping sentry recording"): on_stop,
        }
        self._existing_episodes = 0
        self._is_sentry = False

    def emit(self, record: logging.LogRecord) -> None:
        """Recognise an announcement; errors of a callback reach the command, unlike errors of printing."""
        message = record.getMessage()
        episode = self._beginning(record.name, message)
        if episode is not None:
            if self._is_sentry:
                self._on_pause()  # a cut ends the episode before it
            self._on_episode(episode)
        elif (record.name, message) in self._on_other:
            self._on_other[record.name, message]()

    def _beginning(self, logger: str, message: str) -> int | None:
        """Return the number of the episode that a message begins, if it does."""
        if logger == _DATASET and (ready := _READY.fullmatch(message)):
            self._existing_episodes = int(ready[1])
        elif logger == _SENTRY and message.startswith("Sentry recording started"):
            self._is_sentry = True
            return self._existing_episodes
        elif logger == "root":
            begins = _EPISODE.fullmatch(message) or (self._is_sentry and _CUT.fullmatch(message))
            return int(begins[1]) if begins else None
        return None
