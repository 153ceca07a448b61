"""A simulated excavator that speaks the protocol of a real one, in real time."""

import contextlib
import logging
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.constants import JOINT_ACCEL_RAD_S2, JOINT_RANGE_RAD
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.testbed.faulty_wire import FaultyWire, WireFaults
from lerobot_excav.testbed.picture_stream import PictureServer
from lerobot_excav.testbed.protocol import RATE_HZ, REFUSAL_WORDS, Command, DatagramError, Refusal, State, StateFlag
from lerobot_excav.testbed.safety import SOAK_S, WATCHDOG_S, Limits, SafetyGate, Verdict
from lerobot_excav.testbed.valves import Valves

logger = logging.getLogger(__name__)

if round(1.0 / TICK_S) != RATE_HZ:
    raise ConfigurationError(f"TICK_S={TICK_S} does not fit RATE_HZ={RATE_HZ}: a tick has a datagram")

_MOST_BYTES = 2048
_MOST_AT_ONCE = 100

Env = MaskedTaskEnv[Any, Any]


@dataclass(kw_only=True)
class EmulatedMachine:
    """How the machine and its wire differ from the ideal ones.

    Attributes:
        valves: Between command and motion.
        joint_noise_rad: Standard deviation of the joint sensors [rad] (kind of the default: guess).
        speed_limit: Greatest command that it carries out, (0, 1].
        soak_s: How long zero commands are watched after it was switched on [s].
        wire: Faults of the wire, each way.
        pictures_hz: Pictures a second of each camera; divides 50.
        seed: Of noise and faults.
    """

    valves: Valves = field(default_factory=Valves)
    joint_noise_rad: float = 0.001
    speed_limit: float = 1.0
    soak_s: float = SOAK_S
    wire: WireFaults = field(default_factory=WireFaults)
    pictures_hz: int = 10
    seed: int = 0


class Emulator:
    """Lets a simulated machine be driven over the network.

    Args:
        env: Its worksite, an environment of the excavator at 50 frames a second, reset to a scene.
        machine: How it differs from the ideal one.
        host: Address to listen at.
        port: Port of the datagrams; 0 takes a free one.
        picture_port: Port of the pictures; 0 takes a free one.
        pictures: Returns what its cameras show now, by name, (H, W, 3) uint8, or (H, W) uint16 [mm] of depth.
        on_over: Told what came of an episode, as its metrics say it; whoever is told resets `env`.

    Attributes:
        address: Host and port of the datagrams.
        picture_address: Host and port of the pictures.
        gate: What keeps the machine still.
        refusals: Every reason for which it stood still or was slowed down, and when [s since the start].
        late_ticks: How many ticks took longer than they simulate.

    Raises:
        DeviceError: A port is taken, or the address is not this computer's.
    """

    def __init__(
        self,
        env: Env,
        machine: EmulatedMachine,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        picture_port: int = 0,
        pictures: Callable[[], Mapping[str, NDArray[np.uint8] | NDArray[np.uint16]]],
        on_over: Callable[[dict[str, Any]], None],
    ) -> None:
        self._env, self._machine, self._draw, self._on_over = env, machine, pictures, on_over
        self._socket = _bound(host, port)
        try:
            self._pictures = PictureServer(host, picture_port)
        except DeviceError:
            self._socket.close()
            raise
        self.address = host, int(self._socket.getsockname()[1])
        self.picture_address = host, self._pictures.port
        limits = Limits(
            joint_range_rad=np.array(JOINT_RANGE_RAD),
            joint_accel_rad_s2=np.array(JOINT_ACCEL_RAD_S2),
            speed=machine.speed_limit,
            soak_s=machine.soak_s,
        )
        self.gate = SafetyGate(limits, log=self._note_refusal)
        self.refusals: list[tuple[float, Refusal]] = []
        self.late_ticks = 0
        self._rng, wire_in, wire_out = (
            np.random.default_rng(seed) for seed in np.random.SeedSequence(machine.seed).spawn(3)
        )
        self._incoming: FaultyWire[tuple[bytes, tuple[str, int]]] = FaultyWire(machine.wire, wire_in)
        self._outgoing: FaultyWire[bytes] = FaultyWire(machine.wire, wire_out)
        self._session, self._number, self._ticks = 1 + secrets.randbelow(65535), 0, 0
        self._hosts: dict[tuple[str, int], float] = {}  # who was heard, and when
        self._came_us, self._refusal = 0, Refusal.NOT_HEARD
        self._joint_pos, self._joint_vel = self._joints()
        self._start_s = time.monotonic()

    def run(self, is_over: Callable[[], bool]) -> None:
        """Play in real time until it is over; where a tick takes too long, the world is slower than real time."""
        due_s = time.monotonic()
        while not is_over():
            self.tick(time.monotonic())
            due_s, now_s = due_s + TICK_S, time.monotonic()
            self.late_ticks += now_s > due_s
            due_s = max(due_s, now_s)
            time.sleep(due_s - now_s)

    def tick(self, now_s: float) -> None:
        """Hear, move, show and answer, once."""
        verdict = self._judge(now_s)
        flow = self._machine.valves.step(np.array(verdict.axes), TICK_S)
        *_, terminated, truncated, info = self._env.step(flow.astype(np.float32))
        self._joint_pos, self._joint_vel = self._joints()
        if terminated or truncated:
            self._machine.valves.reset()
            with self._answering():
                self._on_over(info["episode_metrics"])
            self._joint_pos, self._joint_vel = self._joints()
        if self._ticks % round(RATE_HZ / self._machine.pictures_hz) == 0:
            self._show()
        self._ticks += 1
        self._answer(time.monotonic())  # a state that took long to reach is not under way for that time

    def close(self) -> None:
        """Switch it off."""
        self._socket.close()
        self._pictures.close()

    @property
    def clock_us(self) -> int:
        """The machine's own clock [us]; it does not begin where the host's does."""
        return round((time.monotonic() - self._start_s) * 1e6) + 1

    def _joints(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        machine = self._env.world.machine
        return machine.joint_pos, machine.joint_vel

    def _judge(self, now_s: float) -> Verdict:
        self._hear(now_s)
        verdict = self.gate.tick(self._joint_pos, self._joint_vel, now_s, TICK_S)
        self._refusal = verdict.refusal
        return verdict

    @contextlib.contextmanager
    def _answering(self) -> Iterator[None]:
        """Go on hearing and answering, standing still, while the next start is built up: that takes long."""
        is_over = threading.Event()

        def answer() -> None:
            while not is_over.wait(TICK_S):
                now_s = time.monotonic()
                self._judge(now_s)
                self._answer(now_s)

        thread = threading.Thread(target=answer, name="testbed answers", daemon=True)
        thread.start()
        try:
            yield
        finally:
            is_over.set()
            thread.join()

    def _hear(self, now_s: float) -> None:
        for _ in range(_MOST_AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(_MOST_BYTES)
            except OSError:
                break
            self._incoming.put((data, sender), now_s)
        for data, sender in self._incoming.take(now_s):
            with contextlib.suppress(DatagramError):
                if self.gate.hear(Command.decode(data), now_s):
                    self._came_us = self.clock_us
                    self._hosts[sender] = now_s  # a stranger's nonsense gets no answer
        self._hosts = {host: heard_s for host, heard_s in self._hosts.items() if now_s - heard_s <= WATCHDOG_S}

    def _show(self) -> None:
        taken_us = self.clock_us
        for name, picture in self._draw().items():
            is_depth = picture.dtype == np.uint16
            self._pictures.show(name, taken_us, picture, lossless=is_depth or name == "target_mask")

    def _answer(self, now_s: float) -> None:
        self._number += 1
        self._outgoing.put(self._state(now_s).encode(), now_s)
        for data in self._outgoing.take(now_s):
            for host in self._hosts:
                with contextlib.suppress(OSError):
                    self._socket.sendto(data, host)

    def _state(self, now_s: float) -> State:
        flags = StateFlag.ARMED if self.gate.is_armed else StateFlag.NONE
        flags |= StateFlag.STOP_LATCHED if self.gate.is_stopped else StateFlag.NONE
        flags |= StateFlag.HOST_HEARD if self.gate.is_heard(now_s) else StateFlag.NONE
        command, clock_us = self.gate.command, self.clock_us
        noise = self._machine.joint_noise_rad * self._rng.standard_normal(4)
        echo = {}
        if command is not None:
            echo = {
                "command_session": command.session,
                "command_number": command.number,
                "command_host_us": command.host_us,
                "command_age_us": clock_us - self._came_us,
            }
        return State(
            session=self._session,
            number=self._number,
            machine_us=clock_us,
            joint_pos=tuple((self._joint_pos + noise).tolist()),
            joint_vel=tuple(self._joint_vel.tolist()),
            refusal=self._refusal,
            flags=flags,
            **echo,
        )

    def _note_refusal(self, refusal: Refusal) -> None:
        self.refusals.append((time.monotonic() - self._start_s, refusal))
        logger.info("%s", REFUSAL_WORDS[refusal])


def _bound(host: str, port: int) -> socket.socket:
    """Return a socket that listens there.

    Raises:
        DeviceError: It cannot.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        listening.bind((host, port))
    except OSError as error:
        listening.close()
        raise DeviceError(
            f"--host={host} --port={port} cannot be listened at: {error}; give an address of this computer and a free "
            "port, 0 for any"
        ) from error
    listening.settimeout(0.0)
    return listening
