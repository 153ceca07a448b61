"""What LeRobot's command line says of a shared camera."""

from dataclasses import dataclass

from lerobot.cameras import CameraConfig

from lerobot_excav.errors import require


@CameraConfig.register_subclass("shared")
@dataclass(kw_only=True)
class SharedCameraConfig(CameraConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Any camera, whose last picture a camera of the type `mask` may look at.

        --robot.cameras='{top: {type: shared, name: top, camera: {type: opencv, index_or_path: 0, fps: 30, width: 640,
        height: 480}}, target_mask: {type: mask, of: top, source: grounded_sam, text: "the red block", width: 640,
        height: 480}}'

    Size and rate are those of the camera itself.

    Raises:
        ConfigurationError: The name is empty, or a size is given that is another than the camera's.
    """

    name: str
    camera: CameraConfig

    def __post_init__(self) -> None:
        require(
            bool(self.name), "name='' of a shared camera is not possible; give one, which the mask camera names as `of`"
        )
        for field in ("fps", "width", "height"):
            own, given = getattr(self.camera, field), getattr(self, field)
            require(
                given is None or given == own,
                f"{field}={given} of the shared camera {self.name!r} is not possible: its camera says {own}; leave it",
            )
            setattr(self, field, own)
