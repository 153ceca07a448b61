"""Where `lerobot-record` and `lerobot-rollout` stand in a recording, learnt from what they announce.

LeRobot tells a robot nothing about episodes. Both commands announce every phase on the root logger, in the
thread that drives the robot and before the phase begins, so a handler there marks the exact boundaries.
The announcements are not an interface of LeRobot: the tests record for real, to notice when they change.
"""

import logging
import re
from collections.abc import Callable

_EPISODE = re.compile(r"Recording episode (\d+)")
_RESET = "Reset the environment"
_REPEAT = "Re-record episode"
_STOP = "Stop recording"


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
        self._on_episode = on_episode
        self._on_other = {_RESET: on_pause, _REPEAT: on_discard, _STOP: on_stop}

    def emit(self, record: logging.LogRecord) -> None:
        """Recognise an announcement; errors of a callback reach the command, unlike errors of printing."""
        if record.name != "root":
            return
        message = record.getMessage()
        episode = _EPISODE.fullmatch(message)
        if episode is not None:
            self._on_episode(int(episode.group(1)))
        elif message in self._on_other:
            self._on_other[message]()
