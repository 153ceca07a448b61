"""The sticks of the page: when they count, and when they are as good as let go.

A command that is not renewed is no command: whoever closes the lid, loses the pad or the connection lets go. And who
takes the controls with a stick held over would make the machine jump, so they count once they were seen centred.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lerobot_excav.envs.tasks.sticks import AXES

STALE_S = 0.15
"""Age after which what the sticks said counts no more [s] (kind: guess; a page sends every 20 ms)."""

LOST_S = 0.6
"""Age after which they have to be centred again before they count [s] (kind: guess)."""

CENTRED = 0.08
"""Deflection that counts as none; pads rest within it (kind: guess)."""

CENTRED_MESSAGES = 8
"""How many messages in a row have to show all axes centred: 0.16 s (kind: guess)."""

TAKEOVER = 0.3
"""Deflection by which a person takes the controls from a policy: well beyond a pad's rest (kind: guess)."""

_REST = dict.fromkeys(AXES, 0.0)


@dataclass(kw_only=True)
class Sticks:
    """The sticks as the driving page reports them.

    Attributes:
        number: Number of the last message, by the page's own count.
        is_ready: Whether the sticks were seen centred since they were last lost.
        heard_since_s: When the controls were taken, which counts as being heard [s].
    """

    number: int = -1
    is_ready: bool = False
    _axes: Mapping[str, float] | None = None
    heard_since_s: float = -1e9
    _at_s: float = -1e9
    _centred: int = 0

    def report(self, axes: Sequence[float], number: int, at_s: float, *, centred: float = CENTRED) -> None:
        """Take in a message: the four axes in [-1, 1], its number, when it came [s]; `centred` counts as none."""
        if at_s - self._at_s > LOST_S:
            self.let_go()
        self._axes = dict(zip(AXES, axes, strict=True))
        self.number, self._at_s = number, at_s
        self._centred = self._centred + 1 if max(map(abs, axes)) <= centred else 0
        self.is_ready = self.is_ready or self._centred >= CENTRED_MESSAGES

    def let_go(self) -> None:
        """Forget what was said: the device is gone, or another page drives."""
        self._axes, self._centred, self.is_ready = None, 0, False

    def axes(self, now_s: float) -> dict[str, float]:
        """Return what counts now: the last message, or rest if it is stale or the sticks are not ready."""
        age_s = now_s - self._at_s
        if age_s > LOST_S:
            self.let_go()
        if self._axes is None or not self.is_ready or age_s > STALE_S:
            return dict(_REST)
        return dict(self._axes)

    def take_over(self, now_s: float) -> bool:
        """Tell whether a person wants the controls: a stick is held well out of its centre."""
        return max(map(abs, self.axes(now_s).values())) >= TAKEOVER

    def is_heard(self, now_s: float) -> bool:
        """Tell whether a message came lately, or the controls have just been taken."""
        return now_s - max(self._at_s, self.heard_since_s) <= LOST_S
