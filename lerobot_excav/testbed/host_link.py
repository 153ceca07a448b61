"""The host's end of the wire: repeats the held command 50 times a second, and hears what the machine says."""

import contextlib
import logging
import secrets
import select
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from lerobot_excav.errors import DeviceError
from lerobot_excav.testbed.clock_offset import ClockOffset
from lerobot_excav.testbed.dead_man import DeadMan
from lerobot_excav.testbed.protocol import (
    RATE_HZ,
    REFUSAL_WORDS,
    Command,
    CommandFlag,
    DatagramError,
    Newest,
    Refusal,
    State,
    StateFlag,
)
from lerobot_excav.testbed.safety import STILL, WATCHDOG_S

logger = logging.getLogger(__name__)

_MOST_BYTES = 2048
_MOST_AT_ONCE = 100  # datagrams read in a row: a flood must not keep commands from being sent


@dataclass(frozen=True)
class Heard:
    """A state, and when it was true by the host's clock [us]."""

    state: State
    true_us: int


class HostLink:
    """Talks to a machine in a thread of its own.

    Args:
        address: Host and port of the machine.
        dead_man: Who lets the machine move.
        hold_s: How long a command counts; then zero is sent, because whoever gives commands is late or gone. The
            machine has such a limit of its own.
        clock_us: The host's clock.

    Attributes:
        counts: Datagrams by what came of them: `sent`, `heard`, `overtaken`, `damaged`, `held_too_long`.
        session: Number by which the machine tells this host from others, drawn when it connects; 0 before.
    """

    def __init__(
        self,
        address: tuple[str, int],
        *,
        dead_man: DeadMan,
        hold_s: float,
        clock_us: Callable[[], int] = lambda: time.perf_counter_ns() // 1000,
    ) -> None:
        self.address, self.hold_s = address, hold_s
        self.counts: Counter[str] = Counter()
        self.session = self._number = 0
        self._dead_man, self._clock_us = dead_man, clock_us
        self._lock = threading.Lock()
        self._offset, self._newest = ClockOffset(), Newest()
        self._axes: tuple[float, float, float, float] = STILL
        self._given_us, self._flags = 0, CommandFlag.NONE
        self._release_after: int | None = None  # number of a command that has to be heard before release is said
        self._heard: Heard | None = None
        self._refusal = Refusal.NONE
        self._thread: threading.Thread | None = None
        self._fault: BaseException | None = None
        self._is_over = threading.Event()
        self._lets_go = False

    def connect(self) -> None:
        """Begin to talk.

        Raises:
            DeviceError: The address cannot be used.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.connect(self.address)
        except OSError as error:
            self._socket.close()
            raise DeviceError(f"robot.address={self.address[0]}:{self.address[1]} cannot be used: {error}") from error
        self._socket.settimeout(0.0)
        self.session = 1 + secrets.randbelow(65535)
        self._number = 0
        self._is_over.clear()
        self._thread = threading.Thread(target=self._run, name="testbed link", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Send zero once more, and stop talking; the machine's watchdog does the rest."""
        if self._thread is None:
            return
        with self._lock:
            self._axes = STILL
        self._is_over.set()
        self._thread.join(timeout=2.0)
        self._thread = None
        self._socket.close()

    def give(self, axes: tuple[float, float, float, float]) -> None:
        """Hold this command from now on, fractions of full speed in [-1, 1].

        Raises:
            DeviceError: The wire has failed; so say all that use it.
        """
        self._require_alive()
        with self._lock:
            self._axes, self._given_us = axes, self._clock_us()

    def let_go(self, *, lets_go: bool) -> None:
        """Act as if the dead-man were let go, as the start gate wants to see it."""
        self._lets_go = lets_go

    def stop(self) -> None:
        """Stop at once, and stay stopped until `release`."""
        self._require_alive()
        with self._lock:
            self._flags, self._axes, self._release_after = CommandFlag.EMERGENCY_STOP, STILL, None

    def release(self) -> None:
        """Ask the machine to release the emergency stop; it does with centred sticks and the dead-man let go.

        It is asked until it says that the stop is not latched any more, or another stop comes: then only a new call
        releases. Ask once, for every call begins as a new wish does, with a command that does not say release.
        """
        self._require_alive()
        with self._lock:
            self._flags, self._release_after = CommandFlag.NONE, self._number + 1

    def heard(self) -> Heard:
        """Return the newest state.

        Raises:
            DeviceError: The machine was not heard for `WATCHDOG_S`.
        """
        self._require_alive()
        with self._lock:
            heard, now_us = self._heard, self._clock_us()
        age_s = float("inf") if heard is None else (now_us - heard.true_us) * 1e-6
        if heard is None or age_s > WATCHDOG_S:
            lately = "has not been heard" if heard is None else f"was heard {age_s:.1f} s ago"
            raise DeviceError(
                f"the machine at {self.address[0]}:{self.address[1]} {lately}; it stands still by its own watchdog. "
                "Check that it is switched on, the address and the cable."
            )
        return heard

    @property
    def offset(self) -> ClockOffset:
        """The machine's clock, as the host knows it."""
        return self._offset

    @property
    def way_us(self) -> int:
        """How long a command is under way [us]: the machine cannot know it, for its clock is another."""
        return self._offset.trip_us // 2 if self._offset.is_known else 0

    def _require_alive(self) -> None:
        if self._fault is not None:
            raise DeviceError(f"the wire to {self.address[0]} has failed: {self._fault!r}") from self._fault

    def _run(self) -> None:
        try:
            self._talk()
        except BaseException as fault:  # it is told to whoever uses the wire; the machine's watchdog stops the machine
            self._fault = fault

    def _talk(self) -> None:
        due = time.monotonic()
        while not self._is_over.is_set():
            self._send()
            due = max(due + 1.0 / RATE_HZ, time.monotonic())
            self._hear_until(due)
        with contextlib.suppress(OSError):
            self._send()

    def _send(self) -> None:
        with self._lock:
            now_us = self._clock_us()
            age_us, axes, flags = max(0, now_us - self._given_us), self._axes, self._flags
            is_late = axes != STILL and age_us > self.hold_s * 1e6
            if is_late:
                self._axes = axes = STILL
                self.counts["held_too_long"] += 1
        if is_late:
            logger.warning("no command came for %.0f ms, so the machine is told to stand still", age_us * 1e-3)
        if self._dead_man.is_held() and not self._lets_go:
            flags |= CommandFlag.DEAD_MAN
        self._number += 1
        age_us = 0 if axes == STILL else age_us + self.way_us  # to stand still is never too old
        told = Command(session=self.session, number=self._number, host_us=now_us, axes=axes, age_us=age_us, flags=flags)
        with contextlib.suppress(OSError):  # a machine that is switched off answers by refusing
            self._socket.send(told.encode())
            self.counts["sent"] += 1

    def _hear_until(self, due: float) -> None:
        for _ in range(_MOST_AT_ONCE):
            ready, _, _ = select.select([self._socket], [], [], max(0.0, due - time.monotonic()))
            if not ready:
                return
            try:
                self._take(self._socket.recv(_MOST_BYTES))
            except DatagramError as error:
                self.counts["damaged"] += 1
                logger.debug("a datagram was thrown away: %s", error)
            except OSError:
                time.sleep(max(0.0, due - time.monotonic()))
                return
        time.sleep(max(0.0, due - time.monotonic()))

    def _take(self, data: bytes) -> None:
        state, came_us = State.decode(data), self._clock_us()
        if not self._newest.is_news(state.session, state.number):
            self.counts["overtaken"] += 1
            return
        self.counts["heard"] += 1
        if state.command_session == self.session:
            self._offset.note(
                sent_us=state.command_host_us,
                held_us=state.command_age_us,
                machine_us=state.machine_us,
                came_us=came_us,
            )
        true_us = state.machine_us + self._offset.offset_us if self._offset.is_known else came_us
        with self._lock:
            self._heard = Heard(state, min(true_us, came_us))
            if state.command_session == self.session:
                self._note_release(state)
        if state.refusal is not self._refusal:
            self._refusal = state.refusal
            logger.info("the machine says: %s", REFUSAL_WORDS[state.refusal])

    def _note_release(self, state: State) -> None:
        """Say release once the machine has heard this host without it, until nothing is latched any more."""
        if self._release_after is not None and state.command_number >= self._release_after:
            self._flags, self._release_after = CommandFlag.RELEASE, None
        elif self._flags is CommandFlag.RELEASE and not state.flags & StateFlag.STOP_LATCHED:
            self._flags = CommandFlag.NONE  # or a later stop would be released by an old wish
