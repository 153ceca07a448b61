"""What the settings of `--env.type=excavator` and `--robot.type=excavator_sim` allow.

Importing this loads no simulator, so that every command of LeRobot can parse its line quickly. For the same reason the
names of the soil presets are repeated here; a test keeps them equal.
"""

from collections.abc import Sequence
from typing import Any

from lerobot_excav.envs import GYM_IDS
from lerobot_excav.errors import require, require_choice

SCENE_SETS = ("train", "val", "test")
MASK_CONDITIONS = ("correct", "zero", "random", "mismatched")
SOILS = ("sand", "gravel", "dirt", "wet_sand")
TARGETS_PER_SCENE = 4
TICKS_PER_SECOND = 50
IMAGE_SIZE_LIMITS = (32, 1024)  # [px]; below, a target covers hardly a pixel

_CHOICES = {"scene_set": SCENE_SETS, "mask_condition": MASK_CONDITIONS, "soil": SOILS}


def require_task(field: str, task: str | None) -> None:
    """Raise unless the task is one of this package.

    Raises:
        ConfigurationError: The task is unknown.
    """
    require_choice(field, task, tuple(GYM_IDS), hint="A task is a gym id without the part before the slash.")


def require_fps(field: str, fps: int) -> None:
    """Raise unless a frame lasts a whole number of ticks of 0.02 s.

    Raises:
        ConfigurationError: `fps` does not divide 50.
    """
    divisors = tuple(n for n in range(1, TICKS_PER_SECOND + 1) if TICKS_PER_SECOND % n == 0)
    require_choice(field, fps, divisors, hint="A frame is a whole number of ticks of 0.02 s.")


def require_image_size(field: str, size_px: int) -> None:
    """Raise unless pictures of this height or width are usable.

    Raises:
        ConfigurationError: The size is outside `IMAGE_SIZE_LIMITS`.
    """
    least, most = IMAGE_SIZE_LIMITS
    require(
        least <= size_px <= most,
        f"{field}={size_px} is out of range; allowed: {least} to {most} pixels; the default is 96 x 128.",
    )


def require_worksite_settings(config: Any, *, prefix: str, fields: Sequence[str] = ()) -> None:
    """Validate the fields that describe the simulated worksite.

    Args:
        config: Has `fps`, `observation_height`, `observation_width`, `scene_set`, `soil` and `fields`.
        prefix: What the user writes before the name of a field, such as `env.`.
        fields: Further fields out of `mask_condition`.

    Raises:
        ConfigurationError: A value is not allowed.
    """
    require_fps(f"{prefix}fps", config.fps)
    for name in ("observation_height", "observation_width"):
        require_image_size(f"{prefix}{name}", getattr(config, name))
    for name in ("scene_set", "soil", *fields):
        require_choice(f"{prefix}{name}", getattr(config, name), _CHOICES[name])
