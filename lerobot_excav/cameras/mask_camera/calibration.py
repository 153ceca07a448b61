"""Where a real camera stands, from a file that somebody has measured.

    position_w = [3.6, -4.6, 7.4]    # eye point [m], world frame
    target_w = [-0.5, 0.25, 0.2]     # a point on the optical axis [m]; the upper edge of the picture points up
    fovy_deg = 46.0                  # vertical field of view of the colour picture
    depth_unit_m = 0.001             # of the depth image; some cameras count in tenths of a millimetre

A camera that does not stand upright takes `axes_w` in place of `target_w`: three rows of the rotation whose columns are
its right, up and backward axes.
"""

import tomllib
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from lerobot_excav.envs.machines.pinhole import CameraPose, PinholeCamera
from lerobot_excav.errors import ConfigurationError

Point = tuple[FiniteFloat, FiniteFloat, FiniteFloat]

_ROTATION_ERROR = 1e-3  # of what people round (kind: guess)


class Calibration(BaseModel):
    """Where a camera stands in the world frame, and how it projects; pixels are square, the axis meets the middle."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    position_w: Point
    target_w: Point | None = None
    axes_w: tuple[Point, Point, Point] | None = None
    fovy_deg: Annotated[float, Field(gt=0.0, lt=180.0)]
    depth_unit_m: Annotated[float, Field(gt=0.0, le=0.01)] = 0.001

    @model_validator(mode="after")
    def _says_where_it_looks(self) -> Self:
        if (self.target_w is None) == (self.axes_w is None):
            raise ValueError("give target_w or axes_w")
        if self.target_w is not None:
            offset = np.subtract(self.target_w, self.position_w)
            if np.hypot(offset[0], offset[1]) <= 1e-6 * np.abs(offset).sum():
                raise ValueError("target_w lies straight above or below position_w, or at it; give axes_w")
        if self.axes_w is not None:
            axes = np.array(self.axes_w)
            if np.abs(axes @ axes.T - np.eye(3)).max() > _ROTATION_ERROR or np.linalg.det(axes) < 0.0:
                raise ValueError("axes_w is no rotation")
        return self

    def camera(self, height: int, width: int) -> PinholeCamera:
        """Return the camera of pictures of a size [px]."""
        if self.axes_w is not None:
            axes_w = np.array(self.axes_w)
        else:
            assert self.target_w is not None  # one of them is given
            axes_w = CameraPose(self.position_w, self.target_w, self.fovy_deg).axes
        return PinholeCamera(
            position_w=np.array(self.position_w),
            axes_w=axes_w,
            fovy_rad=float(np.deg2rad(self.fovy_deg)),
            height=height,
            width=width,
        )


def read_calibration(path: Path) -> Calibration:
    """Read a file of a calibration.

    Raises:
        ConfigurationError: It cannot be read, or does not say what is needed.
    """
    try:
        return Calibration(**tomllib.loads(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the file"
        raise ConfigurationError(
            f"calibration={path}: {place}: {first['msg']}; it takes {', '.join(Calibration.model_fields)}"
        ) from error
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"calibration={path} cannot be read ({error}); give a TOML file") from error


def calibration_text(camera: PinholeCamera) -> str:
    """Return the file of a camera whose place is known."""
    rows = ",\n".join(f"    {row}" for row in camera.axes_w.tolist())
    return (
        f"position_w = {camera.position_w.tolist()}\n"
        f"axes_w = [\n{rows},\n]\n"
        f"fovy_deg = {float(np.rad2deg(camera.fovy_rad))!r}\n"
    )
