"""The shared camera itself."""

from typing import Any, ClassVar, override
from weakref import WeakValueDictionary

import numpy as np
from lerobot.cameras import Camera
from lerobot.cameras.utils import make_cameras_from_configs
from numpy.typing import NDArray

from lerobot_excav.cameras.shared_camera.config_shared_camera import SharedCameraConfig
from lerobot_excav.errors import DeviceError


class SharedCamera(Camera):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Passes everything on to the camera that it holds, and remembers the last picture.

    LeRobot's robots know nothing of cameras that depend on each other, so the mask camera finds this one by its name.
    """

    connected: ClassVar["WeakValueDictionary[str, SharedCamera]"] = WeakValueDictionary()
    """The shared cameras that are connected in this process, by name."""

    def __init__(self, config: SharedCameraConfig) -> None:
        super().__init__(config)
        self.name = config.name
        self._camera: Camera = make_cameras_from_configs({config.name: config.camera})[config.name]
        self._last: NDArray[np.uint8] | None = None

    @property
    def is_connected(self) -> bool:
        """Whether the camera is connected."""
        return bool(self._camera.is_connected)

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Return none: the cameras of other types are found by these."""
        return []

    @override
    def connect(self, warmup: bool = True) -> None:
        """Connect the camera.

        Raises:
            DeviceError: Another shared camera of this name is connected.
        """
        if self.name in self.connected:
            raise DeviceError(f"two shared cameras are called {self.name!r}; give one of them another name")
        self._camera.connect(warmup)
        self.connected[self.name] = self

    @override
    def disconnect(self) -> None:
        """Disconnect the camera."""
        self.connected.pop(self.name, None)
        self._last = None
        self._camera.disconnect()

    @override
    def read(self) -> NDArray[np.uint8]:
        """Return the next picture, (H, W, 3)."""
        return self._noted(self._camera.read())

    @override
    def async_read(self, timeout_ms: float = 200.0) -> NDArray[np.uint8]:
        """Return the newest picture, (H, W, 3)."""
        return self._noted(self._camera.async_read(timeout_ms))

    @override
    def read_latest(self, max_age_ms: int = 500) -> NDArray[np.uint8]:
        """Return the newest picture without waiting, (H, W, 3)."""
        return self._noted(self._camera.read_latest(max_age_ms))

    @property
    def latest_timestamp(self) -> float | None:
        """When the newest picture came, by `time.perf_counter` [s], if the camera tells it."""
        return getattr(self._camera, "latest_timestamp", None)

    @property
    def taken_us(self) -> int | None:
        """When it was taken, by the clock of the machine that sent it [us], if the camera tells it."""
        return getattr(self._camera, "taken_us", None)

    @property
    def use_depth(self) -> bool:
        """Whether the camera measures depth as well."""
        return bool(getattr(self._camera, "use_depth", False))

    def read_latest_depth(self, max_age_ms: int | None = None) -> NDArray[np.uint16]:
        """Return the newest depth image as the camera gives it, (H, W, 1), 0 where nothing was measured.

        Raises:
            DeviceError: The camera measures none.
        """
        if not self.use_depth:
            raise DeviceError(
                f"the shared camera {self.name!r} measures no depth; give its camera use_depth: true, if it can"
            )
        oldest = {} if max_age_ms is None else {"max_age_ms": max_age_ms}
        return np.asarray(self._camera.read_latest_depth(**oldest), np.uint16)

    def last_picture(self) -> NDArray[np.uint8]:
        """Return the picture that was read last, or read one."""
        return self.read() if self._last is None else self._last

    def _noted(self, picture: NDArray[Any]) -> NDArray[np.uint8]:
        self._last = np.asarray(picture, np.uint8)
        return self._last
