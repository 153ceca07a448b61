"""What LeRobot's command line says of a shared camera."""

from dataclasses import dataclass

from lerobot.cameras import CameraConfig

from lerobot_excav.errors import require
from lerobot_excav.setting import check_settings, setting


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

    name: str = setting("Name under which mask cameras know it, as `of`")
    camera: CameraConfig = setting("The camera itself, of any type of LeRobot")

    @property
    def use_depth(self) -> bool:
        """Whether the camera measures depth as well, as LeRobot's robots ask it."""
        return bool(getattr(self.camera, "use_depth", False))

    def __post_init__(self) -> None:
        check_settings(self, "shared camera: ")
        require(
            getattr(self.camera, "use_rgb", True),
            f"use_rgb=false of the shared camera {self.name!r} is not possible: mask cameras look at its pictures",
        )
        for field in ("fps", "width", "height"):
            own, given = getattr(self.camera, field), getattr(self, field)
            require(
                given is None or given == own,
                f"{field}={given} of the shared camera {self.name!r} is not possible: its camera says {own}; leave it",
            )
            setattr(self, field, own)
