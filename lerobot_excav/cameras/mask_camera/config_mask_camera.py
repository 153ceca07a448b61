"""What LeRobot's command line says of a mask camera."""

from dataclasses import dataclass
from pathlib import Path

from lerobot.cameras import CameraConfig

from lerobot_excav.envs.masks.source import chooses_target, mask_source_names
from lerobot_excav.errors import require, require_choice

ANY_FPS = 30
"""Rate that is told [1/s] (kind: guess): LeRobot's robots demand one of every camera, and a mask is read at any."""


@CameraConfig.register_subclass("mask")
@dataclass(kw_only=True)
class MaskCameraConfig(CameraConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """The target mask of a shared camera, as one more camera of a robot; its class needs no change.

    Attributes:
        of: Name of the shared camera.
        source: Mask source: `grounded_sam`, `manual`, or one of another package that needs a picture only.
        options: TOML file of what the source is told.
        text: What to look for, before what the options say.
        command: Text file that holds what to look for; whenever it changes, the mask is made again.
        snap: Whether each mask is snapped onto the object under its middle, by the small network of `mask_snap`.

    Raises:
        ConfigurationError: There is no such source, it chooses targets itself, or the size is missing.
    """

    of: str
    source: str
    options: str | None = None
    text: str | None = None
    command: Path | None = None
    snap: bool = False
    fps: int | None = ANY_FPS

    def __post_init__(self) -> None:
        require_choice("source of a mask camera", self.source, mask_source_names())
        require(
            not chooses_target(self.source), f"source={self.source} of a mask camera chooses where to act by itself"
        )
        require(
            self.width is not None and self.height is not None,
            f"the mask camera of {self.of!r} needs width and height, those of that camera: robots ask for them first",
        )
        require(
            self.text is None or self.command is None,
            "text and command of a mask camera both say what to look for; give one of them",
        )
