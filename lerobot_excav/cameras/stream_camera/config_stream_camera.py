"""What LeRobot's command line says of a stream camera."""

from dataclasses import dataclass

from lerobot.cameras import CameraConfig

from lerobot_excav.errors import require


@CameraConfig.register_subclass("stream")
@dataclass(kw_only=True)
class StreamCameraConfig(CameraConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """A camera of a machine that sends its pictures over the network, such as `lerobot-excav testbed-emulator`.

        --robot.cameras='{main: {type: stream, port: 47501, name: main, fps: 10, width: 128, height: 96}}'

    Attributes:
        name: What the machine calls the camera.
        port: Port of its pictures.
        host: Its address.
        timeout_s: How long to wait for the first picture, and for the next one at most [s].

    Raises:
        ConfigurationError: A value is missing or not possible.
    """

    name: str
    port: int
    host: str = "127.0.0.1"
    timeout_s: float = 5.0

    def __post_init__(self) -> None:
        require(bool(self.name) and "\n" not in self.name, f"name={self.name!r} of a stream camera is not possible")
        require(1 <= self.port <= 65535, f"port={self.port} of a stream camera is not possible; give 1 to 65535")
        require(
            0.0 < self.timeout_s <= 600.0,
            f"timeout_s={self.timeout_s} of a stream camera is not possible; give a time above 0 and up to 600",
        )
        for field in ("width", "height", "fps"):
            require(
                getattr(self, field) is not None,
                f"the stream camera {self.name!r} needs {field}, that of the machine's pictures: robots ask for it",
            )
