"""The lines of a session log, one by one; `robots.session_log` writes them and says what each means."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    NonNegativeInt,
    TypeAdapter,
    ValidationError,
)

from lerobot_excav.datasets.format.schema import OPERATORS
from lerobot_excav.envs.tasks.measures import one_of
from lerobot_excav.envs.tasks.settings import LAST_SCENE
from lerobot_excav.errors import DatasetError


def _require_float32(value: float) -> float:
    if float(np.float32(value)) != value:
        raise ValueError("not a float32, which the robot writes exactly")
    return value


_LARGEST = float(np.finfo(np.float32).max)
Vector = list[Annotated[FiniteFloat, Field(ge=-_LARGEST, le=_LARGEST), AfterValidator(_require_float32)]]


class _Event(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")


class SessionEvent(_Event):
    """A robot began to record."""

    event: Literal["session"]
    simulation_version: int
    env: str
    settings: dict[str, Any]
    task: str | None


class EpisodeEvent(_Event):
    """An episode began."""

    event: Literal["episode"]
    episode_index: NonNegativeInt
    scene_id: int = Field(ge=0, le=LAST_SCENE)
    stage: NonNegativeInt
    target_id: NonNegativeInt


class ActionEvent(_Event):
    """A frame, whose action was carried out."""

    event: Literal["action"]
    state: Vector
    action: Vector


class CommandEvent(_Event):
    """Another target was commanded."""

    event: Literal["command"]
    target_id: NonNegativeInt


class OperatorEvent(_Event):
    """Who commands this episode: the last one that is named."""

    event: Literal["operator"]
    operator: Annotated[str, one_of(OPERATORS)]


class HeldEvent(_Event):
    """The machine was held still until its mask was found."""

    event: Literal["held"]


class RestartEvent(_Event):
    """A scene was started within the episode; state and action are those of the frame, if there was one."""

    event: Literal["restart"]
    scene_id: int = Field(ge=0, le=LAST_SCENE)
    stage: NonNegativeInt
    target_id: NonNegativeInt
    state: Vector | None
    action: Vector | None


class EndEvent(_Event):
    """The episode was over; so many frames were noted."""

    event: Literal["ended", "stopped"]
    frames: NonNegativeInt


class DiscardEvent(_Event):
    """The episode that ran last was thrown away."""

    event: Literal["discarded"]


Event = (
    SessionEvent
    | EpisodeEvent
    | OperatorEvent
    | ActionEvent
    | CommandEvent
    | HeldEvent
    | RestartEvent
    | EndEvent
    | DiscardEvent
)
_LINE: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="event")])


def read_events(path: Path) -> Iterator[tuple[str, Event]]:
    """Yield the events of a session log, each with its place (file and line); blank lines are left out.

    A line that is not JSON is left out where a crash may have cut it off: at the end of the file, or before the line
    with which the next session begins.

    Raises:
        DatasetError: The file is missing, or a line is not an event. The message names line and field.
    """
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
    except FileNotFoundError:
        raise DatasetError(f"{path} does not exist; the robot wrote its session to --robot.session_log") from None
    cut_off: DatasetError | None = None
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        place = f"{path}:{number}"
        event = _event(line, place)
        if cut_off is not None and not isinstance(event, SessionEvent):
            raise cut_off
        cut_off = event if isinstance(event, DatasetError) else None
        if not isinstance(event, DatasetError):
            yield place, event
    if cut_off is not None and not lines[-1].strip():  # a line that was cut off has no end
        raise cut_off


def _event(line: str, place: str) -> Event | DatasetError:
    """Read a line; an error is returned where a crash could explain it.

    Raises:
        DatasetError: The line is whole, and is not an event.
    """
    try:
        return _LINE.validate_json(line)
    except ValidationError as error:
        problems = error.errors()
    words = DatasetError(f"{place}: {'; '.join(map(_in_words, problems))}; is it a session log of a simulated robot?")
    if problems[0]["type"] == "json_invalid":
        return words
    raise words


def _in_words(problem: Any) -> str:
    name = ".".join(map(str, problem["loc"][1:]))  # the first is the kind of event
    words = {
        "missing": f"lacks {name}",
        "extra_forbidden": f"{name} is not known",
        "json_invalid": f"not JSON ({problem['msg']}), and it is not the last line of a session that was interrupted",
        "union_tag_not_found": "lacks event (a log of version 0.2.0 has a line per episode; that release completes it)",
        "union_tag_invalid": f"event={problem['ctx'].get('tag')!r} is not known" if "ctx" in problem else "",
    }
    if not name and problem["type"] not in words:
        return "a JSON object is expected"
    return words.get(problem["type"], f"{name}={problem['input']!r}: {problem['msg']}")
