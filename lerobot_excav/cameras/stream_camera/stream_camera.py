"""The stream camera itself."""

from typing import Any, override

import numpy as np
from lerobot.cameras import Camera
from numpy.typing import NDArray

from lerobot_excav.cameras.stream_camera.config_stream_camera import StreamCameraConfig
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.testbed.picture_stream import Picture, PictureClient, depth_name


class StreamCamera(Camera):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Has the newest picture that came over the network.

    Attributes:
        latest_timestamp: When the picture that was read last came, by `time.perf_counter` [s].
        taken_us: When it was taken, by the machine's clock [us].
    """

    def __init__(self, config: StreamCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self.use_depth = config.use_depth
        address = config.host, config.port
        self._client = PictureClient(address, config.name)
        self._depth_client = PictureClient(address, depth_name(config.name)) if config.use_depth else None
        self.latest_timestamp: float | None = None
        self.taken_us: int | None = None

    @property
    def is_connected(self) -> bool:
        """Whether pictures come."""
        return self._client.is_connected and (self._depth_client is None or self._depth_client.is_connected)

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Return none: a network is not searched."""
        return []

    @override
    def connect(self, warmup: bool = True) -> None:
        """Connect, and wait for the first picture.

        Raises:
            DeviceError: Nobody is there, or no picture comes.
            ConfigurationError: It has another size than was said.
        """
        oldest_ms = round(1e3 * self.config.timeout_s)
        try:
            self._client.connect(self.config.timeout_s)
            if self._depth_client is not None:
                self._connect_depth(self._depth_client)
            self.read_latest(oldest_ms)
            if self._depth_client is not None:
                self.read_latest_depth(oldest_ms)
        except (ConfigurationError, DeviceError):
            self.disconnect()
            raise

    def _connect_depth(self, client: PictureClient) -> None:
        try:
            client.connect(self.config.timeout_s)
        except DeviceError as error:
            raise DeviceError(
                f"the machine offers no depth of {self.config.name!r}; leave use_depth away (the emulator has depth "
                "with --calibration)"
            ) from error

    @override
    def disconnect(self) -> None:
        """Disconnect."""
        self._client.close()
        if self._depth_client is not None:
            self._depth_client.close()

    @override
    def read(self) -> NDArray[np.uint8]:
        """Return the next picture, (H, W, 3).

        Raises:
            DeviceError: None comes in time.
        """
        return self._noted(self._client.next(self.config.timeout_s))

    @override
    def async_read(self, timeout_ms: float = 200.0) -> NDArray[np.uint8]:
        """Return the newest picture, (H, W, 3), that came within the last `max_age_s`.

        It does not wait for a new one: the robot measures how old it is.

        Raises:
            DeviceError: None came: whoever went on would drive blind.
        """
        return self._noted(self._client.newest(self.config.max_age_s))

    @override
    def read_latest(self, max_age_ms: int = 500) -> NDArray[np.uint8]:
        """Return the newest picture, (H, W, 3), at most so old [ms].

        Raises:
            DeviceError: It is older.
        """
        return self._noted(self._client.newest(1e-3 * max_age_ms))

    def read_latest_depth(self, max_age_ms: int | None = None) -> NDArray[np.uint16]:
        """Return the depth image of the picture that was read last, or a later one, (H, W, 1) [mm]; 0: not measured.

        It comes by a way of its own, and is waited for.

        Args:
            max_age_ms: How long to wait [ms]; `max_age_s` by default.

        Raises:
            DeviceError: It does not come, or none is read.
        """
        if self._depth_client is None:
            raise DeviceError(f"the stream camera {self.config.name!r} reads no depth; give it use_depth: true")
        timeout_s = self.config.max_age_s if max_age_ms is None else 1e-3 * max_age_ms
        newest = self._depth_client.since(self.taken_us or 0, timeout_s)
        return self._checked(newest, 1).astype(np.uint16)

    def _noted(self, newest: Picture) -> NDArray[np.uint8]:
        pixels = self._checked(newest, 3)
        self.taken_us, self.latest_timestamp = newest.taken_us, newest.came_s
        return pixels.astype(np.uint8)

    def _checked(self, newest: Picture, channels: int) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """Return what came, (H, W, channels), if it is what was asked for."""
        config = self.config
        if not self.is_connected:
            raise DeviceError(f"the stream camera {config.name!r} is not connected; call connect() first")
        *size, given = newest.pixels.shape
        if tuple(size) != (config.height, config.width):
            raise ConfigurationError(
                f"the stream camera {config.name!r} gives {tuple(size)}, and was set up for "
                f"{(config.height, config.width)} (height, width); give it the machine's size"
            )
        if given != channels:
            raise ConfigurationError(
                f"the stream camera {config.name!r} gives pictures of {given} channels in place of {channels}; "
                "a depth stream is read by use_depth of the camera that it belongs to"
            )
        return newest.pixels
