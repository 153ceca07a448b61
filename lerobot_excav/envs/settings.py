"""What the settings of `--env.type=excavator` and `--robot.type=excavator_sim` allow.

Importing this loads no simulator, so that every command of LeRobot can parse its line quickly. For the same reason the
names of the soil presets and fidelities are repeated here; a test keeps them equal.
"""

from collections.abc import Sequence
from numbers import Integral
from typing import Any

from lerobot_excav.errors import require, require_choice

EXCAVATOR_TASKS = ("Scoop-v0",)
FR5_TASKS = ("FR5Grasp-v0",)
SCENE_SETS = ("train", "val", "test")
MASK_CONDITIONS = ("correct", "zero", "random", "mismatched")
MASK_NOISES = ("none", "shift", "erode", "dilate")
SOILS = ("sand", "gravel", "dirt", "wet_sand")
FIDELITIES = ("fast", "standard", "fine")
TARGETS_PER_SCENE = 4
TICKS_PER_SECOND = 50
EPISODE_DURATION_S = 20.0  # time limit of an episode unless another is asked for (kind: paper)
FR5_EPISODE_DURATION_S = 8.0  # that of the arm (kind: paper, 400 frames at 50 Hz)
RENDER_MODES = ("rgb_array", None)
IMAGE_SIZE_LIMITS = (32, 1024)  # [px]; below, a target covers hardly a pixel

_CHOICES = {
    "scene_set": SCENE_SETS,
    "mask_condition": MASK_CONDITIONS,
    "soil": SOILS,
    "fidelity": FIDELITIES,
}


def require_retarget_frame(field: str, frame: int | None, episode_length: int) -> None:
    """Raise unless another block may be commanded at this frame; None: never.

    Raises:
        ConfigurationError: The frame is not one within the episode.
    """
    if frame is not None:
        hint = f"An episode has {episode_length} frames; leave it out to command one block only."
        require_integer(field, frame, 1, episode_length - 1, hint=hint)


def require_task(field: str, task: str | None) -> None:
    """Raise unless the task is one of the excavator.

    Raises:
        ConfigurationError: The task is unknown.
    """
    require_choice(field, task, EXCAVATOR_TASKS, hint="A task is a gym id without the part before the slash.")


def require_integer(field: str, value: Any, low: int, high: int | None = None, *, hint: str = "") -> None:
    """Raise unless a value is a whole number within limits; a truth value is none.

    Args:
        field: Name of the setting as its user writes it.
        value: The value given.
        low: Least allowed value.
        high: Greatest allowed value; None for no limit.
        hint: Next step, added to the message.

    Raises:
        ConfigurationError: `value` is no whole number from `low` to `high`.
    """
    is_integer = isinstance(value, Integral) and not isinstance(value, bool)
    limits = f"from {low} on" if high is None else f"from {low} to {high}"
    require(
        is_integer and value >= low and (high is None or value <= high),
        f"{field}={value!r} is not possible; give a whole number {limits}. {hint}".rstrip(),
    )


def require_fps(field: str, fps: int) -> None:
    """Raise unless a frame lasts a whole number of ticks of 0.02 s.

    Raises:
        ConfigurationError: `fps` does not divide 50.
    """
    divisors = tuple(n for n in range(1, TICKS_PER_SECOND + 1) if TICKS_PER_SECOND % n == 0)
    hint = f"A frame is a whole number of ticks of 0.02 s: {', '.join(map(str, divisors))}."
    require_integer(field, fps, 1, TICKS_PER_SECOND, hint=hint)
    require_choice(field, fps, divisors, hint=hint)


def require_episode_length(field: str, frames: int | None) -> None:
    """Raise unless an episode may have this length; None stands for `EPISODE_DURATION_S`.

    Raises:
        ConfigurationError: The length is no whole number from 1 on.
    """
    if frames is not None:
        hint = f"It counts frames; leave it out for {EPISODE_DURATION_S:g} s."
        require_integer(field, frames, 1, hint=hint)


def require_image_size(field: str, size_px: int) -> None:
    """Raise unless pictures of this height or width are usable.

    Raises:
        ConfigurationError: The size is outside `IMAGE_SIZE_LIMITS`.
    """
    require_integer(field, size_px, *IMAGE_SIZE_LIMITS, hint="It counts pixels; the default is 96 x 128.")


def require_worksite_settings(config: Any, *, prefix: str, fields: Sequence[str] = ()) -> None:
    """Validate the fields that describe the simulated worksite.

    Args:
        config: Has `fps`, `observation_height`, `observation_width`, `scene_set`, `soil`, `fidelity` and
            `fields`.
        prefix: What the user writes before the name of a field, such as `env.`.
        fields: Further fields out of `mask_condition`.

    Raises:
        ConfigurationError: A value is not allowed.
    """
    require_fps(f"{prefix}fps", config.fps)
    for name in ("observation_height", "observation_width"):
        require_image_size(f"{prefix}{name}", getattr(config, name))
    for name in ("scene_set", "soil", "fidelity", *fields):
        require_choice(f"{prefix}{name}", getattr(config, name), _CHOICES[name])
