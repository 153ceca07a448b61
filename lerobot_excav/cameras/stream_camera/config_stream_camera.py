"""What LeRobot's command line says of a stream camera."""

from dataclasses import dataclass

from lerobot.cameras import CameraConfig

from lerobot_excav.errors import require
from lerobot_excav.testbed.picture_stream import LONGEST_NAME


@CameraConfig.register_subclass("stream")
@dataclass(kw_only=True)
class StreamCameraConfig(CameraConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """A camera of a machine that sends its pictures over the network, such as `lerobot-excav testbed-emulator`.

        --robot.cameras='{main: {type: stream, port: 47501, name: main, fps: 10, width: 128, height: 96}}'

    Attributes:
        name: What the machine calls the camera.
        port: Port of its pictures.
        host: Its address.
        timeout_s: How long to wait for the first picture, and for the next one [s].
        max_age_s: How long ago the newest picture may have come [s]; then reading it is an error.

    Raises:
        ConfigurationError: A value is missing or not possible.
    """

    name: str
    port: int
    host: str = "127.0.0.1"
    timeout_s: float = 5.0
    max_age_s: float = 0.5

    def __post_init__(self) -> None:
        require(
            0 < len(self.name.encode()) < LONGEST_NAME and self.name.isprintable(),
            f"name={self.name!r} of a stream camera is not possible; give one of up to {LONGEST_NAME - 1} bytes",
        )
        is_port = isinstance(self.port, int) and 1 <= self.port <= 65535
        require(is_port, f"port={self.port!r} of a stream camera is not possible; give a whole number from 1 to 65535")
        for field in ("timeout_s", "max_age_s"):
            value = getattr(self, field)
            require(
                isinstance(value, int | float) and 0.0 < value <= 600.0,
                f"{field}={value!r} of a stream camera is not possible; give a time above 0 and up to 600 s",
            )
        for field in ("width", "height", "fps"):
            require(
                getattr(self, field) is not None,
                f"the stream camera {self.name!r} needs {field}, that of the machine's pictures: robots ask for it",
            )
