"""What LeRobot's command line says of a stream camera."""

from dataclasses import dataclass

from lerobot.cameras import CameraConfig

from lerobot_excav.cameras.limits import MOST_FPS, MOST_PX
from lerobot_excav.errors import require
from lerobot_excav.setting import check_settings, setting
from lerobot_excav.testbed.picture_stream import LONGEST_NAME


@CameraConfig.register_subclass("stream")
@dataclass(kw_only=True)
class StreamCameraConfig(CameraConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """A camera of a machine that sends its pictures over the network, such as `lerobot-excav testbed-emulator`.

        --robot.cameras='{main: {type: stream, port: 47501, name: main, fps: 10, width: 128, height: 96}}'

    Raises:
        ConfigurationError: A value is missing or not possible.
    """

    name: str = setting("What the machine calls the camera")
    port: int = setting("Port of its pictures", low=1, high=65535)
    host: str = setting("Address of the machine", default="127.0.0.1")
    width: int = setting("Width of its pictures [px]", low=1, high=MOST_PX)
    height: int = setting("Height of its pictures [px]", low=1, high=MOST_PX)
    fps: int = setting("Pictures a second", low=1, high=MOST_FPS)
    use_depth: bool = setting("Whether its depth, which the machine calls <name>_depth, is read as well", default=False)
    timeout_s: float = setting(
        "How long to wait for the first picture, and for the next one [s]", default=5.0, above=0.0, high=600.0
    )
    max_age_s: float = setting(
        "How long ago the newest picture may have come [s]; reading an older one is an error",
        default=0.5,
        above=0.0,
        high=600.0,
    )

    def __post_init__(self) -> None:
        check_settings(self, "stream camera: ")
        require(
            len(self.name.encode()) < LONGEST_NAME and self.name.isprintable(),
            f"stream camera: name={self.name!r} is not possible; give one of up to {LONGEST_NAME - 1} printable bytes",
        )
