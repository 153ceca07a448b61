"""A wire that loses, delays, doubles and shuffles datagrams, as much as it is told."""

import heapq
import itertools
from dataclasses import dataclass, field

import numpy as np

from lerobot_excav.errors import require


@dataclass(kw_only=True)
class WireFaults:
    """How bad a wire is.

    Attributes:
        loss: Share of the datagrams that are lost, [0, 1].
        delay_ms: How long every datagram takes [ms].
        jitter_ms: Mean of what comes on top, drawn from an exponential distribution, so that some overtake others [ms].
        duplicates: Share of them that come twice, [0, 1].

    Raises:
        ConfigurationError: A value is not possible.
    """

    loss: float = 0.0
    delay_ms: float = 0.0
    jitter_ms: float = 0.0
    duplicates: float = 0.0

    def __post_init__(self) -> None:
        for name, most in (("loss", 1.0), ("delay_ms", 10_000.0), ("jitter_ms", 10_000.0), ("duplicates", 1.0)):
            value = getattr(self, name)
            require(0.0 <= value <= most, f"{name}={value} of the wire is not possible; give a number from 0 to {most}")


@dataclass
class FaultyWire[Item]:
    """Takes datagrams in, and lets out what arrives.

    Args:
        faults: How bad it is.
        rng: Draws what happens to each.
    """

    faults: WireFaults
    rng: np.random.Generator
    _order: "itertools.count[int]" = field(default_factory=itertools.count)
    _waiting: list[tuple[float, int, Item]] = field(default_factory=list)

    def put(self, data: Item, now_s: float) -> None:
        """Send a datagram, and what is known of it, at a time [s]."""
        faults = self.faults
        for _ in range(2 if self.rng.random() < faults.duplicates else 1):
            if self.rng.random() >= faults.loss:
                way_s = 1e-3 * (faults.delay_ms + faults.jitter_ms * self.rng.standard_exponential())
                heapq.heappush(self._waiting, (now_s + way_s, next(self._order), data))

    def take(self, now_s: float) -> list[Item]:
        """Return what has arrived by a time [s], in the order of its arrival."""
        arrived = []
        while self._waiting and self._waiting[0][0] <= now_s:
            arrived.append(heapq.heappop(self._waiting)[2])
        return arrived
