"""Pictures over the network: a server that offers cameras by name, and a client that has the newest one.

A client connects by TCP and sends the camera's name and a line feed. Then pictures come as long as it listens, each as
12 bytes (uint64 clock of the machine at its exposure [us], uint32 size, little-endian) and a JPEG or PNG file. Who is
slow misses pictures; none is queued. The depth of a camera, registered with its pictures, comes under a name of its own
as PNG files of 16-bit grey [mm], 0 where nothing was measured.
"""

import contextlib
import io
import select
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.errors import DeviceError

_HEADER = struct.Struct("<QI")
LONGEST_NAME = 64
_MOST_BYTES = 50_000_000

FARTHEST_M = 20.0
"""How far depth cameras see at most [m] (kind: guess, of stereo cameras for outdoors)."""

_BUFFER_BYTES = 65536  # of the system: more would queue old pictures for who is slow
_LOOK_EVERY_S = 1.0  # whether a client that waits is still there


class Picture(NamedTuple):
    """A picture, the machine's clock at its exposure [us], and when it came [s].

    `pixels` are (H, W, 3) uint8, or (H, W, 1) uint16 [mm] of depth.
    """

    taken_us: int
    came_s: float
    pixels: NDArray[np.uint8] | NDArray[np.uint16]


def depth_name(name: str) -> str:
    """Return under which name the depth of a camera comes."""
    return f"{name}_depth"


class PictureServer:
    """Offers the newest picture of every camera.

    Args:
        host: Address to listen at.
        port: Port; 0 takes a free one.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            self._socket = socket.create_server((host, port))
        except OSError as error:
            raise DeviceError(
                f"--host={host} --picture_port={port} cannot be listened at: {error}; give an address of this computer "
                "and a free port, 0 for any"
            ) from error
        self.port: int = self._socket.getsockname()[1]
        self._files: dict[str, tuple[int, bytes]] = {}
        self._change = threading.Condition()
        self._is_over = False
        threading.Thread(target=self._serve, name="pictures", daemon=True).start()

    def show(
        self, name: str, taken_us: int, picture: NDArray[np.uint8] | NDArray[np.uint16], *, lossless: bool = False
    ) -> None:
        """Make a picture (H, W, 3) the newest one of a camera.

        `lossless` keeps every pixel; depth, (H, W) uint16 [mm], needs it.
        """
        file = io.BytesIO()
        image = Image.fromarray(picture)
        image.save(file, "PNG", compress_level=1) if lossless else image.save(file, "JPEG", quality=95)
        with self._change:
            self._files[name] = taken_us, file.getvalue()
            self._change.notify_all()

    def close(self) -> None:
        """Stop; clients lose their connection."""
        with self._change:
            self._is_over = True
            self._change.notify_all()
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # or a thread that waits for clients would go on doing so
        self._socket.close()

    def _serve(self) -> None:
        while not self._is_over:
            try:
                client, _ = self._socket.accept()
            except OSError:
                return
            threading.Thread(target=self._attend, args=(client,), name="a viewer", daemon=True).start()

    def _attend(self, client: socket.socket) -> None:
        with contextlib.suppress(OSError), client:
            client.settimeout(5.0)
            client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
            name = client.makefile("rb").readline(LONGEST_NAME).decode(errors="replace").strip()
            last_us = -1
            while True:
                newer = self._newer(name, last_us)
                if newer is None:
                    if self._is_over or is_gone(client):
                        return
                    continue
                last_us, data = newer
                client.sendall(_HEADER.pack(last_us, len(data)) + data)

    def _newer(self, name: str, than_us: int) -> tuple[int, bytes] | None:
        """Wait a while for a picture of a camera taken at another time; None if none came, or all is over."""
        with self._change:
            is_there = self._change.wait_for(
                lambda: self._is_over or self._files.get(name, (than_us,))[0] != than_us, _LOOK_EVERY_S
            )
            return self._files[name] if is_there and not self._is_over else None


class PictureClient:
    """Has the newest picture of a camera.

    Args:
        address: Host and port of the server.
        name: The camera.
        clock_s: Tells the time; that of `Picture.came_s`.
    """

    def __init__(
        self, address: tuple[str, int], name: str, *, clock_s: Callable[[], float] = time.perf_counter
    ) -> None:
        self._address, self._name, self._clock_s = address, name, clock_s
        self._change = threading.Condition()
        self._newest: Picture | None = None
        self._count = 0
        self._socket: socket.socket | None = None

    @property
    def is_connected(self) -> bool:
        """Whether it is connected, and the other side is there."""
        return self._socket is not None

    def connect(self, timeout_s: float) -> None:
        """Connect, and wait for the first picture.

        Raises:
            DeviceError: Nobody listens there, or no picture comes in time.
        """
        where = f"{self._address[0]}:{self._address[1]}"
        try:
            self._socket = socket.create_connection(self._address, timeout=timeout_s)
            self._socket.sendall(self._name.encode() + b"\n")
        except OSError as error:
            self.close()
            raise DeviceError(f"the picture stream at {where} cannot be reached: {error}") from error
        seen = self._count
        threading.Thread(target=self._listen, args=(self._socket,), name=self._name, daemon=True).start()
        try:
            self._after(seen, timeout_s)
        except DeviceError as error:
            self.close()
            raise DeviceError(
                f"no picture of {self._name!r} came from {where}; check the name, main or cab, say"
            ) from error

    def close(self) -> None:
        """Disconnect."""
        connection, self._socket, self._newest = self._socket, None, None  # the listener may do so too
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()

    def newest(self, oldest_s: float) -> Picture:
        """Return the newest picture.

        Raises:
            DeviceError: None came within the last `oldest_s`.
        """
        with self._change:
            if self._newest is None or self._clock_s() - self._newest.came_s > oldest_s:
                raise DeviceError(f"no picture of {self._name!r} came within {oldest_s:.2f} s; is the machine on?")
            return self._newest

    def next(self, timeout_s: float) -> Picture:
        """Wait for a picture that has not been returned yet.

        Raises:
            DeviceError: None comes in time.
        """
        return self._after(self._count, timeout_s)

    def since(self, taken_us: int, timeout_s: float) -> Picture:
        """Return the newest picture, once it was taken at a time of the machine's clock [us] or later.

        Raises:
            DeviceError: None comes in time.
        """
        with self._change:
            self._change.wait_for(
                lambda: (self._newest is not None and self._newest.taken_us >= taken_us) or self._socket is None,
                timeout_s,
            )
            if self._newest is None or self._newest.taken_us < taken_us:
                raise DeviceError(f"no picture of {self._name!r} came within {timeout_s:.2f} s; is the machine on?")
            return self._newest

    def _has(self, taken_us: int) -> bool:
        return self._newest is not None and self._newest.taken_us >= taken_us

    def _after(self, seen: int, timeout_s: float) -> Picture:
        """Wait for a picture that is not among the first `seen`."""
        with self._change:
            if not self._change.wait_for(lambda: self._count > seen or self._socket is None, timeout_s):
                raise DeviceError(f"no picture of {self._name!r} came within {timeout_s:.2f} s; is the machine on?")
            if self._newest is None:
                raise DeviceError(f"the stream of {self._name!r} is closed")
            return self._newest

    def _listen(self, connection: socket.socket) -> None:
        connection.settimeout(None)
        with contextlib.suppress(OSError, EOFError, ValueError), connection.makefile("rb") as file:
            while True:
                taken_us, size = _HEADER.unpack(_exactly(file, _HEADER.size))
                if size > _MOST_BYTES:
                    raise ValueError(f"a picture of {size} bytes")
                pixels = _pixels(_exactly(file, size))
                with self._change:
                    self._newest = Picture(taken_us, self._clock_s(), pixels)
                    self._count += 1
                    self._change.notify_all()
        with self._change:
            if self._socket is connection:
                self._socket = None  # the other side is gone
            self._change.notify_all()
        connection.close()


def is_gone(client: socket.socket) -> bool:
    """Tell whether a client, which has nothing more to say, has closed its connection."""
    ready, _, _ = select.select([client], [], [], 0.0)
    return bool(ready) and not client.recv(1, socket.MSG_PEEK)


def _pixels(data: bytes) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Return the pixels of a file: (H, W, 1) uint16 of 16-bit grey, (H, W, 3) uint8 of anything else."""
    image = Image.open(io.BytesIO(data))
    if image.mode.startswith("I"):
        return np.asarray(image).astype(np.uint16)[..., None]
    return np.asarray(image.convert("RGB"))


def _exactly(file: io.BufferedReader, size: int) -> bytes:
    data = file.read(size)
    if len(data) < size:
        raise EOFError
    return data
