"""What the settings of environments and simulated robots allow.

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
LAST_SCENE = 2**31 - 1  # of every scene set; datasets hold a scene's number as int64
TICKS_PER_SECOND = 50
ENDLESS_FRAMES = 2**31 - 1  # length of an episode that the command, not the environment, ends
EXCAVATOR_EPISODE_DURATION_S = 20.0  # time limit of an episode unless another is asked for (kind: paper)
FR5_EPISODE_DURATION_S = 8.0  # that of the arm (kind: paper, 400 frames at 50 Hz)
RENDER_MODES = ("rgb_array", None)
IMAGE_SIZE_LIMITS = (32, 1024)  # [px]; below, a target covers hardly a pixel


def require_mask_settings(prefix: str, *, mask_condition: str, mask_noise: str, mask_noise_px: int) -> None:
    """Raise unless condition, kind and size of the mask's noise belong together.

    Args:
        prefix: What the user writes before the name of a field, such as `env.`.
        mask_condition: What the mask shows.
        mask_noise: Kind of the noise.
        mask_noise_px: Its size [px].

    Raises:
        ConfigurationError: Condition or kind is unknown, the size is no whole number from 0 on, or one has no effect
            with the others.
    """
    require_choice(f"{prefix}mask_condition", mask_condition, MASK_CONDITIONS)
    require_choice(f"{prefix}mask_noise", mask_noise, MASK_NOISES)
    require_integer(f"{prefix}mask_noise_px", mask_noise_px, 0, IMAGE_SIZE_LIMITS[1])
    require(
        (mask_noise == "none") == (mask_noise_px == 0),
        f"{prefix}mask_noise={mask_noise!r} and {prefix}mask_noise_px={mask_noise_px} do not belong together; "
        "give a kind of noise and a size from 1 pixel on, or neither (none, 0)",
    )
    require(
        mask_condition != "zero" or mask_noise == "none",
        f"{prefix}mask_noise={mask_noise!r} has no effect with {prefix}mask_condition='zero', which shows no mask; "
        "leave one of them out",
    )


def require_view_settings(
    prefix: str, *, scene_set: str, fps: int, observation_height: int, observation_width: int
) -> None:
    """Raise unless scenes, frame rate and pictures are those of a simulation.

    Args:
        prefix: What the user writes before the name of a field, such as `env.`.
        scene_set: Stream of scenes.
        fps: Frames per second.
        observation_height: Height of every picture [px].
        observation_width: Width of every picture [px].

    Raises:
        ConfigurationError: One of them is not possible.
    """
    require_choice(f"{prefix}scene_set", scene_set, SCENE_SETS)
    require_fps(f"{prefix}fps", fps)
    require_image_size(f"{prefix}observation_height", observation_height)
    require_image_size(f"{prefix}observation_width", observation_width)


def require_retarget_frame(field: str, frame: int | None, episode_length: int) -> None:
    """Raise unless another block may be commanded at this frame; None: never.

    Raises:
        ConfigurationError: The frame is not one within the episode.
    """
    if frame is not None:
        hint = f"An episode has {episode_length} frames; leave it out to command one block only."
        require_integer(field, frame, 1, episode_length - 1, hint=hint)


def require_task(field: str, task: str | None, tasks: Sequence[str]) -> None:
    """Raise unless the task is one of those of an environment.

    Raises:
        ConfigurationError: The task is unknown.
    """
    require_choice(field, task, tasks, hint="A task is a gym id without the part before the slash.")


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
    """Raise unless an episode may have this length; None stands for the task's own.

    Raises:
        ConfigurationError: The length is no whole number from 1 on.
    """
    if frames is not None:
        hint = "It counts frames; leave it out for the task's own time limit."
        require_integer(field, frames, 1, hint=hint)


def require_image_size(field: str, size_px: int) -> None:
    """Raise unless pictures of this height or width are usable.

    Raises:
        ConfigurationError: The size is outside `IMAGE_SIZE_LIMITS`.
    """
    require_integer(field, size_px, *IMAGE_SIZE_LIMITS, hint="It counts pixels; the default is 96 x 128.")
