"""The datagrams between host and machine: what every byte means.

Both are little-endian and end in the CRC-32 of all bytes before it (`zlib.crc32`). Floats have single precision.

Command, host to machine, 44 bytes, at 50 Hz:

| bytes | type | meaning |
|---|---|---|
| 0-3 | 4 bytes | `EXC1` |
| 4 | uint8 | 1 |
| 5 | uint8 | flags: 1 dead-man held, 2 emergency stop, 4 release of the emergency stop |
| 6-7 | uint16 | session, drawn by the host when it connects |
| 8-11 | uint32 | number, from 1 on, rising within a session |
| 12-19 | uint64 | clock of the host [us] |
| 20-35 | 4 float32 | swing, boom, arm, bucket, as fractions of full speed in [-1, 1] |
| 36-39 | uint32 | age of the command when it was sent, and how long it will be under way [us] |
| 40-43 | uint32 | CRC-32 |

State, machine to host, 80 bytes, at 50 Hz:

| bytes | type | meaning |
|---|---|---|
| 0-3 | 4 bytes | `EXC1` |
| 4 | uint8 | 2 |
| 5 | uint8 | flags: 1 armed, 2 emergency stop latched, 4 host heard |
| 6-7 | uint16 | session, drawn by the machine when it starts |
| 8-11 | uint32 | number, from 1 on, rising within a session |
| 12-19 | uint64 | clock of the machine [us] |
| 20-21 | uint16 | session of the last command that was accepted; 0 if none was |
| 22-23 | uint16 | why the machine does not move as told, a code of `Refusal`; 0 if it does |
| 24-27 | uint32 | number of that command |
| 28-35 | uint64 | clock of the host in that command [us] |
| 36-51 | 4 float32 | joint positions, swing, boom, arm, bucket [rad] |
| 52-67 | 4 float32 | joint velocities [rad/s] |
| 68-75 | uint64 | how long ago that command came [us] |
| 76-79 | uint32 | CRC-32 |
"""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Any, ClassVar, Self

from lerobot_excav.errors import ExcavError

RATE_HZ = 50
"""Datagrams a second, either way; frame rates of recordings divide it."""

DIVIDING_RATES = tuple(rate for rate in range(1, RATE_HZ + 1) if RATE_HZ % rate == 0)
"""Rates of pictures and of loops at which every one of them meets equally many datagrams [1/s]."""

MAGIC = b"EXC1"
AXES = ("swing", "boom", "arm", "bucket")

_CRC = struct.Struct("<I")


class DatagramError(ExcavError, ValueError):
    """Bytes that are no datagram of this protocol."""


class CommandFlag(IntFlag):
    """What a command says besides its four numbers."""

    NONE = 0
    DEAD_MAN = 1
    EMERGENCY_STOP = 2
    RELEASE = 4


class StateFlag(IntFlag):
    """What a machine says of itself."""

    NONE = 0
    ARMED = 1
    STOP_LATCHED = 2
    HOST_HEARD = 4


class Refusal(IntEnum):
    """Why a machine does not move as it is told."""

    NONE = 0
    EMERGENCY_STOP = 1
    NOT_HEARD = 2
    SOAK = 3
    START_GATE = 4
    DEAD_MAN = 5
    STALE = 6
    SPEED_LIMIT = 7
    JOINT_LIMIT = 8


REFUSAL_WORDS = {
    Refusal.NONE: "it moves as told",
    Refusal.EMERGENCY_STOP: "the emergency stop is latched",
    Refusal.NOT_HEARD: "no host is heard",
    Refusal.SOAK: "the soak under zero commands is not over",
    Refusal.START_GATE: "the sticks were not seen centred with the dead-man released",
    Refusal.DEAD_MAN: "the dead-man is not held",
    Refusal.STALE: "the command is too old",
    Refusal.SPEED_LIMIT: "the command was faster than allowed",
    Refusal.JOINT_LIMIT: "a joint is at its limit",
}


@dataclass(frozen=True, kw_only=True)
class Command:
    """What a host tells a machine; the table of the module says what the fields mean."""

    session: int
    number: int
    host_us: int
    axes: tuple[float, float, float, float]
    age_us: int = 0
    flags: CommandFlag = CommandFlag.NONE

    KIND: ClassVar[int] = 1
    _LAYOUT: ClassVar[struct.Struct] = struct.Struct("<4sBBHIQ4fI")

    def encode(self) -> bytes:
        """Return the datagram."""
        head = MAGIC, self.KIND, self.flags, self.session, self.number, self.host_us
        return _sealed(self._LAYOUT.pack(*head, *self.axes, min(self.age_us, 2**32 - 1)))

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read a datagram.

        Raises:
            DatagramError: It has another length, beginning, kind or sum, or a number that cannot be.
        """
        values = _opened(data, cls._LAYOUT, cls.KIND)
        flags, session, number, host_us, *axes, age_us = values
        if not all(-1.0 <= value <= 1.0 for value in axes):  # NaN is not between them either
            raise DatagramError(f"the command {axes} is not within -1 and 1")
        return cls(
            session=session,
            number=number,
            host_us=host_us,
            axes=(axes[0], axes[1], axes[2], axes[3]),
            age_us=age_us,
            flags=CommandFlag(flags & 7),
        )


@dataclass(frozen=True, kw_only=True)
class State:
    """What a machine says of itself; the table of the module says what the fields mean."""

    session: int
    number: int
    machine_us: int
    joint_pos: tuple[float, ...]
    joint_vel: tuple[float, ...]
    command_session: int = 0
    command_number: int = 0
    command_host_us: int = 0
    command_age_us: int = 0
    refusal: Refusal = Refusal.NONE
    flags: StateFlag = StateFlag.NONE

    KIND: ClassVar[int] = 2
    _LAYOUT: ClassVar[struct.Struct] = struct.Struct("<4sBBHIQHHIQ8fQ")

    def encode(self) -> bytes:
        """Return the datagram."""
        head = MAGIC, self.KIND, self.flags, self.session, self.number, self.machine_us
        echo = self.command_session, self.refusal, self.command_number, self.command_host_us
        return _sealed(self._LAYOUT.pack(*head, *echo, *self.joint_pos, *self.joint_vel, self.command_age_us))

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read a datagram.

        Raises:
            DatagramError: It has another length, beginning, kind or sum, or a number that cannot be.
        """
        values = _opened(data, cls._LAYOUT, cls.KIND)
        flags, session, number, machine_us, command_session, refusal, command_number, host_us, *rest = values
        *joints, age_us = rest
        if not all(-100.0 < value < 100.0 for value in joints):
            raise DatagramError(f"the joints {joints} are not within -100 and 100 rad and rad/s")
        try:
            why = Refusal(refusal)
        except ValueError as error:
            raise DatagramError(f"the refusal {refusal} is not known; allowed: 0 to {max(Refusal)}") from error
        return cls(
            session=session,
            number=number,
            machine_us=machine_us,
            joint_pos=tuple(joints[:4]),
            joint_vel=tuple(joints[4:]),
            command_session=command_session,
            command_number=command_number,
            command_host_us=host_us,
            command_age_us=age_us,
            refusal=why,
            flags=StateFlag(flags & 7),
        )


MOST_SESSIONS = 8
"""Sessions that are told apart at the same time (kind: guess: hosts, and those that were started again)."""


class Newest:
    """Lets datagrams through whose number has not been seen or overtaken; a new session begins from the start.

    Sessions may alternate, as those of two hosts do.

    Attributes:
        session: Of the last datagram that was let through; 0 before the first.
    """

    def __init__(self) -> None:
        self.session = 0
        self._numbers: dict[int, int] = {}  # of each session, the one that was heard last at the end

    def is_news(self, session: int, number: int) -> bool:
        """Tell whether a datagram is newer than all before, and take note of it.

        Duplicates and those that were overtaken on the way are not. Numbers do not wrap: at 50 Hz they last 2.7 years.
        """
        newest = self._numbers.pop(session, number - 1)
        is_news = number > newest
        self._numbers[session] = max(number, newest)
        while len(self._numbers) > MOST_SESSIONS:
            del self._numbers[next(iter(self._numbers))]
        if is_news:
            self.session = session
        return is_news


def _sealed(data: bytes) -> bytes:
    return data + _CRC.pack(zlib.crc32(data))


def _opened(data: bytes, layout: struct.Struct, kind: int) -> tuple[Any, ...]:
    """Return the values behind magic and kind."""
    if len(data) != layout.size + _CRC.size:
        raise DatagramError(f"{len(data)} bytes came, and a datagram of kind {kind} has {layout.size + _CRC.size}")
    body, (crc,) = data[: layout.size], _CRC.unpack(data[layout.size :])
    magic, its_kind, *values = layout.unpack(body)
    if magic != MAGIC or its_kind != kind:
        raise DatagramError(f"the datagram begins with {magic!r}, kind {its_kind}; allowed: {MAGIC!r}, kind {kind}")
    if crc != zlib.crc32(body):
        raise DatagramError("the sum at the end of the datagram is not that of its bytes")
    return tuple(values)
