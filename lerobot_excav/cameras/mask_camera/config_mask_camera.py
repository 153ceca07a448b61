"""What LeRobot's command line says of a mask camera."""

from dataclasses import dataclass
from pathlib import Path

from lerobot.cameras import CameraConfig

from lerobot_excav.cameras.limits import MOST_FPS, MOST_PX
from lerobot_excav.envs.masks.source import chooses_target, mask_source_names
from lerobot_excav.envs.tasks.planner.zones import Zone, parsed_zones, zone_text
from lerobot_excav.errors import require
from lerobot_excav.setting import check_settings, setting

ANY_FPS = 30
"""Rate that is told [1/s] (kind: guess): LeRobot's robots demand one of every camera, and a mask is read at any."""


@CameraConfig.register_subclass("mask")
@dataclass(kw_only=True)
class MaskCameraConfig(CameraConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """The target mask of a shared camera, as one more camera of a robot; its class needs no change.

    Raises:
        ConfigurationError: There is no such source, it chooses targets itself, or the size is missing.
    """

    of: str = setting("Name of the shared camera at whose pictures the source looks")
    source: str = setting(
        "What makes the mask: click, manual, grounded_sam, or a source of another package that needs a picture only; "
        "for regions of the ground also geometry and vlm_dig",
        choices=mask_source_names,
    )
    options: str | None = setting(
        "TOML file of what the source is told; whenever it changes, the mask is made again", default=None
    )
    text: str | None = setting("What to look for, before what the options say", default=None)
    command: Path | None = setting(
        "Text file that holds what to look for; whenever it changes, the mask is made again, also by a source that "
        "does not read it",
        default=None,
    )
    snap: bool = setting(
        "Whether a small network marks the object under the middle of the mask, and that is taken in its place",
        default=False,
    )
    calibration: Path | None = setting(
        "TOML file of where the shared camera stands; its depth is looked at then", default=None
    )
    targets: str = setting(
        "What is acted on: objects, or regions of the ground that the excavator digs and that its planner may choose",
        default="objects",
        choices=("objects", "regions"),
    )
    keep_out: str = setting(
        "Rectangles of the ground in which nothing is dug, x_low,y_low,x_high,y_high [m], parted by semicolons",
        default="none",
    )
    width: int = setting("Width of the shared camera's pictures [px]", low=1, high=MOST_PX)
    height: int = setting("Height of the shared camera's pictures [px]", low=1, high=MOST_PX)
    fps: int = setting("Rate that robots are told [1/s]; a mask is read at any", default=ANY_FPS, low=1, high=MOST_FPS)

    def __post_init__(self) -> None:
        check_settings(self, "mask camera: ")
        self._check_targets()

    def _check_targets(self) -> None:
        """Refuse what has no effect, or cannot be."""
        is_regions = self.targets == "regions"
        require(
            not is_regions or self.calibration is not None,
            "mask camera: targets=regions needs calibration=FILE, and a shared camera that measures depth",
        )
        require(
            is_regions or not (chooses_target(self.source) or self.source == "geometry"),
            f"mask camera: source={self.source} chooses where to dig by itself; give targets: regions",
        )
        require(
            self.calibration is None or self.source not in ("click", *(() if is_regions else ("grounded_sam",))),
            f"mask camera: source={self.source} does not look at depth; leave calibration and targets away, or give "
            "source: manual, whose clicks do",
        )
        require(
            not (is_regions and self.snap),
            "mask camera: snap takes objects, and targets=regions are none; leave one of them away",
        )
        zones = parsed_zones("mask camera: keep_out", self.keep_out)
        require(not zones or is_regions, f"mask camera: keep_out={self.keep_out!r} has no effect with targets=objects")
        self.keep_out = zone_text(zones)
        require(
            self.text is None or self.command is None,
            "text and command of a mask camera both say what to look for; give one of them",
        )

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The keep-out zones."""
        return parsed_zones("keep_out", self.keep_out)
