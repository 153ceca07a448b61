"""Whether a loop's commands still count when the next one comes: they age while they are held, and on their way."""

import itertools
import logging
from collections import deque

from lerobot_excav.testbed.safety import STALE_S

logger = logging.getLogger(__name__)

FRAMES = 10
"""Frames of which the shortest is believed: single late ones are common (kind: guess)."""


class CommandLapse:
    """Warns, once, if the machine lets every command lapse before the next one reaches it.

    It stands still for the rest of each frame then. No rule is broken and nothing fails: it only moves less than it was
    told, and a policy that hits its target elsewhere brings nothing.
    """

    def __init__(self) -> None:
        self._given_s: deque[float] = deque(maxlen=FRAMES + 1)
        self._has_warned = False

    def note(self, now_s: float, way_s: float) -> None:
        """Take note of a command.

        Args:
            now_s: When it is given [s].
            way_s: How long it will be under way [s].
        """
        self._given_s.append(now_s)
        if self._has_warned or len(self._given_s) <= FRAMES:
            return
        frame_s = min(later - earlier for earlier, later in itertools.pairwise(self._given_s))
        if frame_s + way_s > STALE_S:
            self._has_warned = True
            logger.warning(
                "a command is held for %.0f ms and is %.0f ms under way; the machine takes none that is older than "
                "%.0f ms, so it stands still for a part of every frame. Mend the network; or, if the loop is slow, let "
                "it do less. A person or a policy that was trained so may also drive at more frames a second (--fps, "
                "--dataset.fps).",
                1e3 * frame_s,
                1e3 * way_s,
                1e3 * STALE_S,
            )
