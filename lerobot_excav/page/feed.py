"""The newest moment of whatever is shown: one thread publishes it, any number of pages wait for it."""

import asyncio
import json
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Moment:
    """What a page shows at once.

    Attributes:
        number: Counts moments from 1.
        state: What is told in words and numbers, ready for JSON.
        pictures: Encoded pictures (JPEG or PNG) by name.
    """

    number: int
    state: Mapping[str, Any]
    pictures: Mapping[str, bytes]

    def message(self, *, with_pictures: bool = True, **own: Any) -> bytes:
        """Return the moment as one message: the length of the header (4 bytes, little-endian), header, pictures.

        `own` is what is told to one page alone; a page that has the pictures already does without them.
        """
        pictures = self.pictures if with_pictures else {}
        parts = [[name, len(data)] for name, data in pictures.items()]
        header = json.dumps({"number": self.number, "pictures": parts, **self.state, **own}).encode()
        return b"".join([len(header).to_bytes(4, "little"), header, *pictures.values()])


class Feed:
    """Holds the newest moment. Whoever is too slow for one misses it: nothing is queued."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._moment: Moment | None = None
        self._waiting: set[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = set()

    def publish(self, state: Mapping[str, Any], pictures: Mapping[str, bytes]) -> Moment:
        """Put a moment in the place of the last one; from any thread."""
        with self._lock:
            number = 1 + (self._moment.number if self._moment else 0)
            self._moment = moment = Moment(number=number, state=state, pictures=pictures)
            waiting, self._waiting = self._waiting, set()
        for loop, event in waiting:
            if not loop.is_closed():
                loop.call_soon_threadsafe(event.set)
        return moment

    async def newer_than(self, number: int) -> Moment:
        """Wait for a moment after the one of a number, and return the newest."""
        while True:
            event = asyncio.Event()
            with self._lock:
                if self._moment is not None and self._moment.number > number:
                    return self._moment
                entry = (asyncio.get_running_loop(), event)
                self._waiting.add(entry)
            try:
                await event.wait()
            finally:
                with self._lock:
                    self._waiting.discard(entry)
