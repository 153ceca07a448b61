"""What keeps a machine still: the gate between commands that come over the wire and the valves.

The machine trusts nobody: whatever the host does, and whether it lives, these rules hold on the machine's side. Order
matters, the first that fails says why.

| rule | the machine stands still |
|---|---|
| emergency stop | from the first datagram that says so, until a release that began later comes with everything let go |
| link watchdog | when nothing was heard for `WATCHDOG_S`; then the start gate is asked again |
| soak | for `soak_s` of zero commands after it was switched on |
| start gate | until `GATE_SAMPLES` commands in a row had centred sticks and the dead-man let go |
| dead-man | while it is not held |
| staleness | when the command is older than `STALE_S`: held, under way for longer than others lately, or not renewed |
| speed limit | moves, but no faster than allowed |
| joint limits | within its braking distance of a limit, in its direction; both ways if its sensor gives no number |
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
"""Distance from its limit at which a joint stands [rad], besides what it needs to brake (kind: guess)."""

LAG_WINDOW_S = 30.0
"""How long the shortest way of a datagram is remembered [s]: clocks drift by milliseconds meanwhile (kind: guess)."""

STILL = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What the machine allows.

    Attributes:
        joint_range_rad: Least and greatest position of each joint, (4, 2) [rad].
        joint_accel_rad_s2: How fast each joint brakes, (4,) [rad/s2].
        speed: Greatest command, (0, 1].
        soak_s: How long zero commands are watched after switching on [s].
    """

    joint_range_rad: NDArray[np.float64]
    joint_accel_rad_s2: NDArray[np.float64]
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
    _lag: "ShortestLag" = field(default_factory=lambda: ShortestLag())
    _late_s: float = 0.0
    _may_release: set[int] = field(default_factory=set)
    _refusal: Refusal = Refusal.NOT_HEARD

    def hear(self, command: Command, now_s: float) -> bool:
        """Take a command in, and tell whether it is newer than those before."""
        is_other = command.session != self._newest.session
        if not self._newest.is_news(command.session, command.number):
            return False
        if is_other:
            self._lag = ShortestLag()
        if is_other or now_s - self._heard_s > WATCHDOG_S:
            self._disarm()
        self._late_s = self._lag.beyond_s(now_s - command.host_us * 1e-6, now_s)
        self.command, self._heard_s = command, now_s
        is_neutral = max(map(abs, command.axes)) <= CENTRED and not command.flags & CommandFlag.DEAD_MAN
        self._neutral = self._neutral + 1 if is_neutral else 0
        if not (is_neutral or self._is_soaked):
            self._soaked_s = 0.0
        self._latch(command, is_neutral=is_neutral)
        return True

    def _latch(self, command: Command, *, is_neutral: bool) -> None:
        """Latch the emergency stop, or release it.

        A release counts only from a session that has been heard without that wish since the stop: one that was asked
        for before it does not, whoever gave the stop.
        """
        is_stop, is_release = (bool(command.flags & flag) for flag in (CommandFlag.EMERGENCY_STOP, CommandFlag.RELEASE))
        if is_stop:
            self.is_stopped = True
            self._may_release.clear()
            self._disarm()
        if self.is_stopped and not is_release:
            self._may_release.add(command.session)
        elif self.is_stopped and not is_stop and is_neutral and command.session in self._may_release:
            self.is_stopped = False
            self._may_release.clear()

    def is_heard(self, now_s: float) -> bool:
        """Tell whether the host was heard lately."""
        return now_s - self._heard_s <= WATCHDOG_S

    def tick(
        self, joint_pos: NDArray[np.float64], joint_vel: NDArray[np.float64], now_s: float, dt_s: float
    ) -> Verdict:
        """Return what the valves get for the coming `dt_s`.

        Args:
            joint_pos: Where the joints are, (4,) [rad].
            joint_vel: How fast they turn, (4,) [rad/s].
            now_s: The machine's clock [s].
            dt_s: Time until the next call [s].
        """
        refusal = self._standing(now_s, dt_s)
        if refusal is not Refusal.NONE:
            return self._verdict(STILL, refusal)
        assert self.command is not None  # or nobody was heard
        told = np.array(self.command.axes)
        axes = np.clip(told, -self.limits.speed, self.limits.speed)
        slowed = bool((np.abs(told) > self.limits.speed).any())
        at_limit = self._is_at_limit(axes, joint_pos, joint_vel)
        axes[at_limit] = 0.0
        why = Refusal.JOINT_LIMIT if at_limit.any() else Refusal.SPEED_LIMIT if slowed else Refusal.NONE
        return self._verdict(tuple(axes.tolist()), why)

    def _is_at_limit(
        self, axes: NDArray[np.float64], joint_pos: NDArray[np.float64], joint_vel: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Return which joints would run into a limit, (4,); one whose sensor gives no number might."""
        lower, upper = self.limits.joint_range_rad.T
        braking_rad = joint_vel * np.abs(joint_vel) / (2.0 * self.limits.joint_accel_rad_s2)
        stops_at_rad = joint_pos + braking_rad
        is_free = (axes < 0.0) & (np.minimum(joint_pos, stops_at_rad) > lower + LIMIT_MARGIN_RAD)
        is_free |= (axes > 0.0) & (np.maximum(joint_pos, stops_at_rad) < upper - LIMIT_MARGIN_RAD)
        is_free &= np.isfinite(stops_at_rad)
        return np.asarray((axes != 0.0) & ~is_free)

    @property
    def _is_soaked(self) -> bool:
        return self._soaked_s >= self.limits.soak_s

    def _standing(self, now_s: float, dt_s: float) -> Refusal:
        """Return why the machine has to stand still."""
        if self.is_stopped:
            return Refusal.EMERGENCY_STOP
        if not self.is_heard(now_s) or self.command is None:
            self._disarm()
            return Refusal.NOT_HEARD
        if not self._is_soaked:
            self._soaked_s += dt_s
            return Refusal.SOAK
        self.is_armed = self.is_armed or self._neutral >= GATE_SAMPLES
        if not self.is_armed:
            return Refusal.START_GATE
        if not self.command.flags & CommandFlag.DEAD_MAN:
            return Refusal.DEAD_MAN
        is_stale = now_s - self._heard_s + self._late_s + self.command.age_us * 1e-6 > STALE_S
        return Refusal.STALE if is_stale else Refusal.NONE

    def _disarm(self) -> None:
        self.is_armed, self._neutral = False, 0
        if not self._is_soaked:
            self._soaked_s = 0.0

    def _verdict(self, axes: tuple[float, ...], refusal: Refusal) -> Verdict:
        if refusal is not self._refusal:
            self._refusal = refusal
            self.log(refusal)
        return Verdict(axes=axes, refusal=refusal)


@dataclass
class ShortestLag:
    """Tells how much longer than usual a datagram was under way, of clocks that differ by an unknown amount.

    The shortest lag of the last `LAG_WINDOW_S`, at least half of it, stands for the usual one.
    """

    _older_s: float = float("inf")
    _newer_s: float = float("inf")
    _since_s: float = float("-inf")

    def beyond_s(self, lag_s: float, now_s: float) -> float:
        """Return by how much a lag, arrival minus sending by two clocks [s], is beyond the shortest one lately."""
        if now_s - self._since_s > 0.5 * LAG_WINDOW_S:
            self._older_s, self._newer_s, self._since_s = self._newer_s, lag_s, now_s
        self._newer_s = min(self._newer_s, lag_s)
        return lag_s - min(self._older_s, self._newer_s)
