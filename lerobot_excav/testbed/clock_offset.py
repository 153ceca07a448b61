"""How far the machine's clock is from the host's, from datagrams that come and go."""

from collections import deque
from dataclasses import dataclass, field

KEPT = 250
"""Exchanges that are remembered: five seconds (kind: guess)."""

JUMP_US = 1_000_000
"""Change of the offset that only a clock that was set explains [us] (kind: guess)."""


@dataclass
class ClockOffset:
    """Keeps the offset of the exchange with the shortest round trip: it was delayed least (RFC 5905, section 10)."""

    _exchanges: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=KEPT))

    def note(self, *, sent_us: int, held_us: int, machine_us: int, came_us: int) -> None:
        """Take note of an exchange.

        Args:
            sent_us: When the host sent a command, by its own clock.
            held_us: How long the machine had it before it answered.
            machine_us: When it answered, by its own clock.
            came_us: When the answer came, by the host's clock.
        """
        trip_us = max(0, came_us - sent_us - held_us)
        offset_us = came_us - trip_us // 2 - machine_us
        if self._exchanges and abs(offset_us - self.offset_us) > JUMP_US + trip_us:
            self._exchanges = deque([(trip_us, offset_us)], maxlen=KEPT)  # in one step: others read it
            return
        self._exchanges.append((trip_us, offset_us))

    @property
    def is_known(self) -> bool:
        """Whether there was an exchange."""
        return bool(self._exchanges)

    @property
    def offset_us(self) -> int:
        """Host's clock minus the machine's [us]."""
        return min(tuple(self._exchanges))[1]

    @property
    def trip_us(self) -> int:
        """The shortest round trip lately [us]."""
        return min(tuple(self._exchanges))[0]
