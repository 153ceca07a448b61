"""What keeps a machine still: the gate between commands that come over the wire and the valves.

The machine trusts nobody: whatever the host does, and whether it lives, these rules hold on the machine's side. Order
matters, the first that fails says why.

| rule | the machine stands still |
|---|---|
| emergency stop | from the first datagram that says so, until it is released with all sticks and the dead-man let go |
| link watchdog | when nothing was heard for `WATCHDOG_S`; then the start gate is asked again |
| soak | for `soak_s` of zero commands after it was switched on |
| start gate | until `GATE_SAMPLES` commands in a row had centred sticks and the dead-man let go |
| dead-man | while it is not held |
| staleness | when the command was held for longer than `STALE_S` by whoever gave it |
| speed limit | moves, but no faster than allowed |
| joint limits | at a limit, in its direction |
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.testbed.protocol import Command, CommandFlag, Newest, Refusal

STALE_S = 0.15
"""Age from which a command counts as zero [s] (kind: that of the rigs this follows)."""

WATCHDOG_S = 0.5
"""Silence after which the link counts as lost [s] (kind: guess: 25 datagrams)."""

GATE_SAMPLES = 10
"""Commands in a row that have to be neutral before the machine moves (kind: that of the rigs this follows)."""

CENTRED = 0.05
"""Deflection that counts as none (kind: guess)."""

SOAK_S = 30.0
"""How long zero commands are watched after switching on [s] (kind: that of the rigs this follows)."""

LIMIT_MARGIN_RAD = 0.02
"""Distance from its limit at which a joint stops [rad] (kind: guess)."""

STILL = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What the machine allows.

    Attributes:
        joint_range_rad: Least and greatest position of each joint, (4, 2) [rad].
        speed: Greatest command, (0, 1].
        soak_s: How long zero commands are watched after switching on [s].
    """

    joint_range_rad: NDArray[np.float64]
    speed: float = 1.0
    soak_s: float = SOAK_S


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What the valves get, fractions of full speed (4,), and why it is not what was told."""

    axes: tuple[float, ...]
    refusal: Refusal


@dataclass
class SafetyGate:
    """Decides tick by tick what of the last command reaches the valves.

    Args:
        limits: What the machine allows.
        log: Told of every change of the reason for which it stands still or is slowed down.

    Attributes:
        command: The last command that was accepted.
        is_armed: Whether soak and start gate have been passed since the link was lost.
        is_stopped: Whether the emergency stop is latched.
    """

    limits: Limits
    log: Callable[[Refusal], None] = lambda refusal: None
    command: Command | None = None
    is_armed: bool = False
    is_stopped: bool = False
    _newest: Newest = field(default_factory=Newest)
    _heard_s: float = float("-inf")
    _neutral: int = 0
    _soaked_s: float = 0.0
    _refusal: Refusal = Refusal.NOT_HEARD

    def hear(self, command: Command, now_s: float) -> bool:
        """Take a command in, and tell whether it is newer than those before."""
        is_other = command.session != self._newest.session
        if not self._newest.is_news(command.session, command.number):
            return False
        if is_other or now_s - self._heard_s > WATCHDOG_S:
            self._disarm()
        self.command, self._heard_s = command, now_s
        is_neutral = max(map(abs, command.axes)) <= CENTRED and not command.flags & CommandFlag.DEAD_MAN
        self._neutral = self._neutral + 1 if is_neutral else 0
        if command.flags & CommandFlag.EMERGENCY_STOP:
            self.is_stopped = True
            self._disarm()
        elif command.flags & CommandFlag.RELEASE and is_neutral:
            self.is_stopped = False
        return True

    def is_heard(self, now_s: float) -> bool:
        """Tell whether the host was heard lately."""
        return now_s - self._heard_s <= WATCHDOG_S

    def tick(self, joint_pos: NDArray[np.float64], now_s: float, dt_s: float) -> Verdict:
        """Return what the valves get for the coming `dt_s`, with the joints at `joint_pos` (4,) [rad]."""
        refusal = self._standing(now_s, dt_s)
        if refusal is not Refusal.NONE:
            return self._verdict(STILL, refusal)
        assert self.command is not None  # or nobody was heard
        told = np.array(self.command.axes)
        axes = np.clip(told, -self.limits.speed, self.limits.speed)
        slowed = bool((np.abs(told) > self.limits.speed).any())
        lower, upper = self.limits.joint_range_rad.T
        at_limit = (joint_pos <= lower + LIMIT_MARGIN_RAD) & (axes < 0.0)
        at_limit |= (joint_pos >= upper - LIMIT_MARGIN_RAD) & (axes > 0.0)
        axes[at_limit] = 0.0
        why = Refusal.JOINT_LIMIT if at_limit.any() else Refusal.SPEED_LIMIT if slowed else Refusal.NONE
        return self._verdict(tuple(axes.tolist()), why)

    def _standing(self, now_s: float, dt_s: float) -> Refusal:
        """Return why the machine has to stand still."""
        if self.is_stopped:
            return Refusal.EMERGENCY_STOP
        if not self.is_heard(now_s) or self.command is None:
            self._disarm()
            return Refusal.NOT_HEARD
        if self._soaked_s < self.limits.soak_s:
            self._soaked_s = self._soaked_s + dt_s if self._neutral else 0.0
            return Refusal.SOAK
        self.is_armed = self.is_armed or self._neutral >= GATE_SAMPLES
        if not self.is_armed:
            return Refusal.START_GATE
        if not self.command.flags & CommandFlag.DEAD_MAN:
            return Refusal.DEAD_MAN
        is_stale = now_s - self._heard_s + self.command.age_us * 1e-6 > STALE_S
        return Refusal.STALE if is_stale else Refusal.NONE

    def _disarm(self) -> None:
        self.is_armed, self._neutral = False, 0

    def _verdict(self, axes: tuple[float, ...], refusal: Refusal) -> Verdict:
        if refusal is not self._refusal:
            self._refusal = refusal
            self.log(refusal)
        return Verdict(axes=axes, refusal=refusal)
