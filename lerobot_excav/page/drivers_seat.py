"""One page drives, the others look on."""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from lerobot_excav.envs.tasks.sticks import StickResponse
from lerobot_excav.page.sticks import CENTRED, Sticks
from lerobot_excav.page.wishes import ResponseMessage, Wish

MOST_WISHES = 100
"""Wishes that wait at most; more come only from a program (kind: guess)."""

MOST_DELAYS = 100_000
"""Delays that are kept: three hours of driving at ten pictures a second (kind: guess)."""


@dataclass(kw_only=True)
class DriversSeat:
    """Who drives, with which sticks, and what was wished for; shared by the server's thread and the one that plays.

    Attributes:
        sticks: Sticks of the page that drives.
        response: How they answer.
        clock: Tells the time [s].
        delays_ms: From stick to picture, as the driving pages measured it [ms], the last hours of it.
    """

    sticks: Sticks = field(default_factory=Sticks)
    response: StickResponse = field(default_factory=StickResponse)
    delays_ms: deque[float] = field(default_factory=lambda: deque(maxlen=MOST_DELAYS))
    clock: Callable[[], float] = time.monotonic
    _driver: int | None = None
    _generation: int = 0
    _wishes: deque[Wish] = field(default_factory=lambda: deque(maxlen=MOST_WISHES))
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @property
    def generation(self) -> int:
        """Changes whenever the controls are taken or given up."""
        return self._generation

    def is_heard(self) -> bool:
        """Tell whether the page that drives has said lately where its sticks are."""
        with self._lock:
            return self._driver is not None and self.sticks.is_heard(self.clock())

    @property
    def driver(self) -> int | None:
        """Number of the page that drives."""
        return self._driver

    def take(self, page: int, *, force: bool = False) -> bool:
        """Give the controls to a page, if nobody has them or it insists; tell whether it has them now."""
        with self._lock:
            if self._driver is None or (force and self._driver != page):
                self._driver = page
                self._reset()
            return self._driver == page

    def leave(self, page: int) -> None:
        """Take the controls from a page, if it has them: what it said last counts no more, and its wishes neither."""
        with self._lock:
            if self._driver == page:
                self._driver = None
                self._reset()

    def report(self, page: int, axes: list[float], number: int, *, lost: bool) -> None:
        """Take in where the sticks of a page are."""
        with self._lock:
            if self._driver == page:
                self.sticks.report(axes, number, self.clock(), centred=max(CENTRED, self.response.dead_zone))
                if lost:
                    self.sticks.let_go()

    def respond(self, page: int, message: ResponseMessage) -> None:
        """Set how the sticks answer."""
        with self._lock:
            if self._driver == page:
                values = message.model_dump(exclude={"kind", "invert"})
                self.response = StickResponse(invert=tuple(message.invert), **values)

    def note_delay(self, page: int, delay_ms: float) -> None:
        """Note what a page has measured from stick to picture [ms]; those of pages that look on are left out."""
        with self._lock:
            if self._driver == page:
                self.delays_ms.append(delay_ms)

    def wish(self, page: int, wish: Wish) -> None:
        """Put a wish of a page down; those of pages that look on are left out."""
        with self._lock:
            if self._driver == page:
                self._wishes.append(wish)

    def wishes(self) -> list[Wish]:
        """Take what has been wished for since the last call."""
        with self._lock:
            wishes = list(self._wishes)
            self._wishes.clear()
            return wishes

    def axes(self) -> tuple[dict[str, float], int]:
        """Return where the sticks are, as far as it counts, and the number of the message that said so."""
        with self._lock:
            return self.sticks.axes(self.clock()), self.sticks.number

    def wants_controls(self) -> bool:
        """Tell whether the person at the sticks wants to take over."""
        with self._lock:
            return self.sticks.take_over(self.clock())

    def let_go(self) -> None:
        """Forget where the sticks are, until they were centred again."""
        with self._lock:
            self.sticks.let_go()

    def _reset(self) -> None:
        self.sticks = Sticks(heard_since_s=self.clock())
        self._generation += 1
        self._wishes.clear()
