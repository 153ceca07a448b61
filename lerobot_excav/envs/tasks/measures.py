"""What is measured of a task: the record of an episode, and the columns that sum records up."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, NonNegativeInt, PositiveInt, model_validator

from lerobot_excav.envs.masks.corrupted import MASK_CONDITIONS, MASK_NOISES
from lerobot_excav.envs.tasks.settings import (
    FRAME_RATES,
    LAST_SCENE,
    SCENE_SETS,
    SNAPPED,
    TARGETS_PER_SCENE,
    dropout_words,
)

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

MASK_SETTINGS = {
    "mask_source": "mask sources",
    "mask_options": "options of mask sources",
    "mask_condition": "mask conditions",
    "mask_noise": "kinds of mask noise",
    "mask_noise_px": "strengths of mask noise",
    "mask_snap": "snapped masks and others",
    "mask_dropout": "shares of frames at which masks drop out",
}
"""What says which mask was shown, with its plural for messages; every environment takes these as settings, and tells of
its options the name of the file and a digest."""


class EpisodeKey(NamedTuple):
    """What makes episodes of two runs comparable."""

    scene_set: str
    scene_id: int
    stage: int
    target_id: int

    def __str__(self) -> str:
        return f"{self.scene_set}/{self.scene_id}/{self.stage}/{self.target_id}"


def one_of(allowed: Collection[Any]) -> AfterValidator:
    """Return a check that a value is one of those that are allowed."""

    def check(value: Any) -> Any:
        if value not in allowed:
            raise ValueError(f"{value!r} is not known; allowed: {', '.join(map(str, allowed))}")
        return value

    return AfterValidator(check)


TargetId = Annotated[int, Field(ge=0, lt=TARGETS_PER_SCENE)]
"""Number of a target of a scene."""


class CommandedTarget(NamedTuple):
    """A target, and the first frame in which it was commanded."""

    frame: NonNegativeInt
    target_id: TargetId


class EpisodeRecord(BaseModel):
    """A line of a metrics file, whose fields `docs/reference/metrics.md` and `docs/reference/settings.md` define.

    A task adds its own fields in a subclass; entries that are no fields are left out.
    """

    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False)

    simulation_version: PositiveInt
    task: str
    fps: Annotated[int, one_of(FRAME_RATES)]
    episode_length: PositiveInt
    camera_every: PositiveInt = 1  # files of earlier releases do not say it
    scene_set: Annotated[str, one_of(SCENE_SETS)]
    scene_id: int = Field(ge=0, le=LAST_SCENE)
    stage: int = Field(default=0, ge=0)  # cycles dug before the start; files of earlier releases hold stage 0 only
    target_id: TargetId  # commanded first
    mask_source: str
    mask_options: str = ""  # name of the file and a digest of it; empty without one
    mask_condition: Annotated[str, one_of(MASK_CONDITIONS)]
    mask_noise: Annotated[str, one_of(MASK_NOISES)]
    mask_noise_px: NonNegativeInt
    mask_snap: bool = False  # files of earlier releases do not say it, for nothing was snapped
    mask_dropout: float = Field(default=0.0, ge=0.0, lt=1.0)  # nor this, for no mask dropped out
    target_overlay: bool
    shown_target_id: int = Field(ge=-1, lt=TARGETS_PER_SCENE)  # of the last mask, noise aside; -1 if it showed none
    is_success: bool  # every part of the task succeeded
    frames: NonNegativeInt
    mask_missing: bool  # the episode was given up because the source found nothing
    mask_missing_frames: NonNegativeInt  # in which the machine was held still, because the source had found nothing yet
    # Of the mask as shown and the target, mean over the frames; None without pictures and in files of earlier releases.
    mask_iou: float | None = Field(default=None, ge=0.0, le=1.0)
    mask_fallbacks: NonNegativeInt = 0  # how often a source that chooses left it to the planner
    commands: tuple[CommandedTarget, ...]  # all, in their order; the first begins at frame 0

    @model_validator(mode="after")
    def _commands_follow_each_other(self) -> Self:
        frames = [command.frame for command in self.commands]
        if self.commands[:1] != ((0, self.target_id),) or frames != sorted(set(frames)):
            raise ValueError(
                f"commands={[list(command) for command in self.commands]} must be pairs of frame and target, in the "
                f"order of their frames, and begin with [0, target_id={self.target_id}]"
            )
        return self

    @property
    def key(self) -> EpisodeKey:
        """Scene, stage and first target."""
        return EpisodeKey(self.scene_set, self.scene_id, self.stage, self.target_id)

    @property
    def final_target_id(self) -> int:
        """Target that is commanded at the end."""
        return self.commands[-1].target_id

    @property
    def changes(self) -> tuple[int, ...]:
        """Frames at which the command changed."""
        return tuple(command.frame for command in self.commands[1:])

    @property
    def shown_words(self) -> str:
        """What the mask showed, in words, whenever the command changed."""
        words = [self.mask_condition]
        if self.mask_source != "oracle":
            words.append(f"from {self.mask_source}")
        if self.mask_noise != "none":
            words.append(f"{self.mask_noise} {self.mask_noise_px} px")
        if self.mask_snap:
            words.append(SNAPPED)
        if self.mask_dropout:
            words.append(dropout_words(self.mask_dropout))
        if self.target_overlay:
            words.append("as overlay")
        return ", ".join(words)

    @property
    def mask_words(self) -> str:
        """The same, and how often pictures were drawn unless it was at every frame."""
        rare = f", camera every {self.camera_every} frames" if self.camera_every > 1 else ""
        return f"{self.shown_words}{rare}"

    @property
    def mask(self) -> str:
        """What the mask showed, in words."""
        changed = f", changed at frame {' and '.join(map(str, self.changes))}" if self.changes else ""
        return f"{self.mask_words}{changed}"

    @property
    def obeyed_shown_mask(self) -> bool | None:
        """Whether the machine did what the shown mask said, which was not the command; None if no field tells."""
        return None

    @property
    def outcome_words(self) -> str:
        """How the episode ended, in a few words."""
        if self.is_success:
            return "success"
        return "did what the wrong mask said" if self.obeyed_shown_mask else "failure"


class Kind(Enum):
    """How a column sums up episodes."""

    RATE = auto()
    """Share of the episodes with a truth value that is true."""
    MEAN = auto()
    """Mean over training seeds, scenes and targets."""
    RATIO = auto()
    """Mean over the operator's on the same scenes and targets."""
    COUNTS = auto()
    """How often each word occurs."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """One measure of a task.

    Attributes:
        key: Name in `report.json`.
        header: Name in tables.
        kind: How episodes are summed up.
        field: Field or property of the task's record; None leaves an episode out of a rate.
        words: For counts, all words in the order of the table.
        bounds: Values between which a mean lies, as no interval may leave them; None without such bounds.
    """

    key: str
    header: str
    kind: Kind
    field: str
    words: tuple[str, ...] = ()
    bounds: tuple[float, float] | None = None

    @property
    def scale(self) -> float:
        """Factor to the unit of the header: shares are shown in percent."""
        return 100.0 if self.kind in (Kind.RATE, Kind.RATIO) else 1.0


@dataclass(frozen=True, kw_only=True)
class TaskMeasures:
    """Everything that reports, and the index of a dataset, know of a task.

    Attributes:
        record: What a line of a metrics file holds.
        settings: Settings of the task's own environment that all episodes of a run share, with their plural.
        shared: Further fields or properties of the record that all episodes of a run share, with their plural.
        setting: Headers and fields of the columns that tell runs apart.
        columns: The measures.
        compared: Keys of the measures whose paired differences are given.
        world: What two runs must share for a scene's number to mean the same scene, as text with fields in braces.
        simulation: Description of the simulation, as text with fields in braces.
        legend: Explains the columns, line by line; takes who the operator was, None without one.
        outcome: Turns the task states of an episode and of its end, (n + 1, k), into columns of the paired-scene index.
        summary: Describes the outcomes of an index in a few words.
        sentence: Says in one sentence what came of episodes; None leaves that to the table.
        figure_entry: Function that draws episodes into a picture file, what no table can show; None draws nothing.
        method_figures: Functions that draw the episodes of several runs, by their names, into a picture file; each by
            what the picture shows, in a few words.
    """

    record: type[EpisodeRecord]
    settings: Mapping[str, str]
    shared: Mapping[str, str]
    setting: Mapping[str, str]
    columns: tuple[Column, ...]
    compared: tuple[str, ...]
    world: str
    simulation: str
    legend: Callable[[str | None], list[str]]
    outcome: Callable[["NDArray[Any]"], dict[str, Any]]
    summary: Callable[["pd.DataFrame"], str]
    sentence: Callable[[Sequence[Any]], str] | None = None
    figure_entry: str | None = None
    method_figures: Mapping[str, str] = field(default_factory=dict)

    @property
    def constants(self) -> dict[str, str]:
        """All that the episodes of a run share, with the plural for messages."""
        version = {"simulation_version": "versions of the simulation"}
        overlay = {"target_overlay": "pictures with and without overlay"}
        time = {"fps": "frame rates", "episode_length": "time limits", "camera_every": "camera rates"}
        return {**MASK_SETTINGS, **overlay, **time, **self.settings, **self.shared, **version}

    def column(self, key: str) -> Column:
        """Return a column by its key."""
        return next(column for column in self.columns if column.key == key)
