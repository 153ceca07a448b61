"""The settings that every task has."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from lerobot_excav.envs.constants import TICKS_PER_SECOND
from lerobot_excav.envs.masks.corrupted import MASK_CONDITIONS, MASK_NOISES
from lerobot_excav.envs.masks.source import chooses_target, mask_source_names
from lerobot_excav.errors import require
from lerobot_excav.setting import check_settings, declared_settings, setting

SCENE_SETS = ("train", "val", "test")
TARGETS_PER_SCENE = 4
LAST_SCENE = 2**31 - 1  # of every scene set; datasets hold a scene's number as int64
ENDLESS_FRAMES = 2**31 - 1  # length of an episode that the command, not the environment, ends
FRAME_RATES = tuple(n for n in range(1, TICKS_PER_SECOND + 1) if TICKS_PER_SECOND % n == 0)
SNAPPED = "snapped"
"""How datasets and reports say that masks were snapped onto what lies under them."""
_LEAST_IMAGE_PX, _MOST_IMAGE_PX = 32, 1024  # below, a target covers hardly a pixel


def dropout_words(share: float) -> str:
    """Say at how many frames a mask is missing."""
    return f"dropout {100 * share:g} %"


@dataclass(kw_only=True)
class RenderSettings:
    """What `render()` of an environment returns: pictures for people, so LeRobot's videos of evaluations.

    Apart from the settings of a task, because only environments have it: robots and recordings show what policies see.

    Raises:
        ConfigurationError: A field has a value that is not possible.
    """

    render_height: int = setting(
        "Height of the pictures that people see [px]", default=480, low=_LEAST_IMAGE_PX, high=_MOST_IMAGE_PX
    )
    render_width: int = setting(
        "Width of the pictures that people see [px]", default=640, low=_LEAST_IMAGE_PX, high=_MOST_IMAGE_PX
    )
    render_camera: str = setting(
        "Camera of these pictures; which ones there are stands on the page of the environment", default="overview"
    )
    render_every: int = setting(
        "Draw every n-th frame only, and show it until the next: for time lapses of long episodes",
        default=1,
        low=1,
        high=1000,
    )
    film_folder: str | None = setting(
        "Folder in which the environment itself writes a film of every episode that comes to its end, the last picture "
        "included; left out: none. It needs little memory, where LeRobot keeps all pictures of an episode",
        default=None,
    )
    film_height: int = setting("Height of these films [px]", default=480, low=_LEAST_IMAGE_PX, high=_MOST_IMAGE_PX)
    film_width: int = setting("Width of these films [px]", default=640, low=_LEAST_IMAGE_PX, high=_MOST_IMAGE_PX)
    film_every: int = setting(
        "Frames from one picture of these films to the next: with 10 a film is a time lapse, ten times as fast",
        default=1,
        low=1,
        high=1000,
    )

    def __post_init__(self) -> None:
        check_settings(self)
        self.require_film_effect()

    def require_film_effect(self, prefix: str = "") -> None:
        """Check that what is said of films is said of some.

        Raises:
            ConfigurationError: A setting of films is given, and no folder for them.
        """
        plain = {field.name: field.default for field in dataclasses.fields(RenderSettings)}
        for name in ("film_height", "film_width", "film_every"):
            value = getattr(self, name)
            require(
                self.film_folder is not None or value == plain[name],
                f"{prefix}{name}={value} has no effect without a folder; give {prefix}film_folder as well",
            )


@dataclass(kw_only=True)
class TaskSettings:
    """Everything that a user may set about a task, whether an environment, a robot or a recording plays it.

    Raises:
        ConfigurationError: A field has a value that is not possible, or two fields contradict each other.
    """

    ENV_TYPE: ClassVar[str]
    """Name of the environment, as in `--env.type`."""
    PREFIX: ClassVar[str] = ""
    """What the user writes before the name of a field; configurations of LeRobot say `env.` or `robot.`."""

    task: str = setting(
        "Task, a gym id without the part before the slash",
        default=dataclasses.MISSING,
        is_column=True,
        changes_start=True,
    )
    fps: int = setting(
        "Frames per second of simulated time; a frame is a whole number of ticks of 0.02 s",
        default=dataclasses.MISSING,
        choices=FRAME_RATES,
    )
    episode_length: int | None = setting(
        "Frames after which an unfinished episode ends; left out: the task's own time limit",
        default=None,
        low=1,
        high=ENDLESS_FRAMES,
    )
    observation_height: int = setting(
        "Height of every picture that a policy sees [px]", default=96, low=_LEAST_IMAGE_PX, high=_MOST_IMAGE_PX
    )
    observation_width: int = setting(
        "Width of every picture that a policy sees [px]", default=128, low=_LEAST_IMAGE_PX, high=_MOST_IMAGE_PX
    )
    scene_set: str = setting(
        "Stream of scenes; they share none, and reports are made of test", default="train", choices=SCENE_SETS
    )
    mask_source: str = setting(
        "What makes the target mask: oracle, which knows the scene; geometry, which looks at depth; click, a network "
        "at a clicked pixel; manual, masks from a file; grounded_sam, from words; vlm_dig, a model that chooses "
        "where to dig; or a source of another package",
        default="oracle",
        choices=mask_source_names,
    )
    mask_options: str | None = setting(
        "TOML file of what the mask source is told, such as the masks of manual; left out: all as by default",
        default=None,
    )
    mask_condition: str = setting("What the target mask shows", default="correct", choices=MASK_CONDITIONS)
    mask_noise: str = setting("Error that is added to the mask", default="none", choices=MASK_NOISES)
    mask_noise_px: int = setting("Size of that error [px]", default=0, low=0, high=_MOST_IMAGE_PX)
    mask_dropout: float = setting(
        "Share of the frames at which the mask is missing, drawn for each: an empty one is shown, as by a segmenter "
        "that loses its object for a moment",
        default=0.0,
        low=0.0,
        below=1.0,
    )
    mask_snap: bool = setting(
        "Whether a small network that looks at the picture marks the object under the middle of the mask, and that is "
        "shown in its place: mends masks that lie a little off their object",
        default=False,
    )
    target_overlay: bool = setting(
        "Whether the mask as shown is tinted into the main picture, for policies without a mask input",
        default=False,
    )

    def __post_init__(self) -> None:
        check_settings(self, self.PREFIX)
        self._check_mask()
        # A configuration of LeRobot stands behind the settings.
        getattr(super(), "__post_init__", lambda: None)()

    def _check_mask(self) -> None:
        """Raise unless condition, kind and size of the mask's noise belong together."""
        noise, size, prefix = self.mask_noise, self.mask_noise_px, self.PREFIX
        require(
            (noise == "none") == (size == 0),
            f"{prefix}mask_noise={noise!r} and {prefix}mask_noise_px={size} do not belong together; "
            "give a kind of noise and a size from 1 pixel on, or neither (none, 0)",
        )
        require(
            self.mask_condition != "mismatched" or not chooses_target(self.mask_source),
            f"{prefix}mask_condition='mismatched' has no meaning with {prefix}mask_source={self.mask_source!r}, which "
            "chooses the target itself; take another condition",
        )
        require(
            self.mask_condition != "zero" or noise == "none",
            f"{prefix}mask_noise={noise!r} has no effect with {prefix}mask_condition='zero', which shows no "
            "mask; leave one of them out",
        )
        require(
            self.mask_condition != "zero" or not self.mask_dropout,
            f"{prefix}mask_dropout={self.mask_dropout} has no effect with {prefix}mask_condition='zero', which shows "
            "no mask at any frame; leave one of them out",
        )
        require(
            self.mask_condition not in ("zero", "random") or not self.mask_snap,
            f"{prefix}mask_snap=True has no meaning with {prefix}mask_condition={self.mask_condition!r}, whose mask "
            "lies on no object; leave one of them out",
        )

    @property
    def observation_size(self) -> tuple[int, int]:
        """Height and width of every picture [px]."""
        return self.observation_height, self.observation_width

    def require_commanded_mask(self) -> None:
        """Refuse a source that chooses the target itself, where recorded targets have to be those of the scene.

        Raises:
            ConfigurationError: It does.
        """
        require(
            not chooses_target(self.mask_source),
            f"{self.PREFIX}mask_source={self.mask_source!r} chooses where to act by itself, so no recording could be "
            "paired or replayed; use it in lerobot-eval and lerobot-excav console",
        )

    @property
    def mask_words(self) -> str:
        """What the mask shows, in words; datasets keep it as `excav.mask_source`."""
        overlay = ("as overlay",) if self.target_overlay else ()
        return ", ".join((self.mask_source, *self._mask_changes, *overlay))

    def require_mask_effect(self, obs_type: str) -> None:
        """Refuse settings of the mask where the target is told as numbers, exactly.

        Raises:
            ConfigurationError: `obs_type` is `state`, and one is not its default.
        """
        masks = ("mask_source", "mask_options", "mask_condition", "mask_noise", "mask_dropout", "mask_snap")
        names = (*masks, "target_overlay") if obs_type == "state" else ()
        for name in names:
            value, usual = getattr(self, name), getattr(TaskSettings, name)
            require(
                value == usual,
                f"{self.PREFIX}{name}={value!r} has no effect with obs_type='state', which tells the target as "
                "numbers; leave it out, or take obs_type='pixels_agent_pos'",
            )

    @property
    def mask_faults(self) -> tuple[str, ...]:
        """What is wrong with the mask on purpose, in words."""
        return tuple(f"mask: {change}" for change in self._mask_changes)

    @property
    def _mask_changes(self) -> tuple[str, ...]:
        condition = () if self.mask_condition == "correct" else (self.mask_condition,)
        noise = () if self.mask_noise == "none" else (f"{self.mask_noise} {self.mask_noise_px} px",)
        dropout = (dropout_words(self.mask_dropout),) if self.mask_dropout else ()
        return (*condition, *noise, *((SNAPPED,) if self.mask_snap else ()), *dropout)

    @classmethod
    def columns(cls) -> tuple[str, ...]:
        """Return the names of the settings that datasets keep in every frame, as `excav.<name>`."""
        return tuple(name for name, allowed in declared_settings(cls).items() if allowed.is_column)

    @classmethod
    def start_columns(cls) -> tuple[str, ...]:
        """Return those of them under which the same scene starts otherwise."""
        return tuple(name for name, allowed in declared_settings(cls).items() if allowed.changes_start)

    def as_dict(self) -> dict[str, Any]:
        """Return the settings by name."""
        return {name: getattr(self, name) for name in declared_settings(type(self))}

    @classmethod
    def of(cls, values: Mapping[str, Any], *, place: str = "") -> Self:
        """Make settings of values by name; `place` says in messages where they stand.

        Raises:
            ConfigurationError: A name is unknown, or a value is not possible.
        """
        known = declared_settings(cls)
        for name in values:
            require(name in known, f"{place}{name} is not a setting of {cls.ENV_TYPE}; allowed: {', '.join(known)}")
        return cls(**values)
