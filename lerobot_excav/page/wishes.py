"""What a page may ask for: messages, checked before anything acts on them."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

Axis = Annotated[float, Field(ge=-1.0, le=1.0)]
Part = Annotated[float, Field(ge=0.0, le=1.0)]

MOST_BYTES = 1_000_000
"""Longest message that is read: a painted mask has a few thousand [bytes]."""


WishKind = Literal[
    "point", "paint", "target", "start", "drive", "work", "stop", "next",
    "record", "finish", "keep", "again", "skip", "complete",
]  # fmt: skip


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class SticksMessage(_Message):
    """Where the sticks are; sent over and over while a page drives."""

    kind: Literal["sticks"]
    axes: Annotated[list[Axis], Field(min_length=4, max_length=4)]
    number: int
    lost: bool = False  # whether a device that was in use is gone


class TakeMessage(_Message):
    """The page wants the controls; `force` takes them from another page."""

    kind: Literal["take"]
    force: bool = False


class LeaveMessage(_Message):
    """The page gives the controls up."""

    kind: Literal["leave"]


class SeenMessage(_Message):
    """The page has drawn a moment, so it can have the next one."""

    kind: Literal["seen"]
    number: int
    delay_ms: Annotated[float, Field(ge=0.0)] | None = None  # from stick to picture, as the page measured it


class ResponseMessage(_Message):
    """How sticks answer."""

    kind: Literal["response"]
    pattern: Literal["iso", "sae"]
    dead_zone: Annotated[float, Field(ge=0.0, le=0.5)]
    expo: Part
    invert: list[Literal["left_x", "left_y", "right_x", "right_y"]]


class Wish(_Message):
    """What whoever shows the page is asked to do, by the page that drives.

    Attributes:
        kind: What; whoever shows the page says in each moment which it offers.
        x: Place in the main picture, from its left edge at 0 to its right edge at 1.
        y: The same from its upper edge.
        picture: A painted mask as PNG in base64: what is not black is meant.
        number: Number of a target, a scene or a stage.
        values: Further numbers.
    """

    kind: WishKind
    x: Part | None = None
    y: Part | None = None
    picture: Annotated[str, Field(max_length=MOST_BYTES)] | None = None
    number: Annotated[int, Field(ge=0)] | None = None
    values: dict[str, Annotated[int, Field(ge=0)]] = Field(default_factory=dict)


Message = SticksMessage | TakeMessage | LeaveMessage | SeenMessage | ResponseMessage | Wish

_MESSAGE: TypeAdapter[Any] = TypeAdapter(Annotated[Message, Field(discriminator="kind")])


def read_message(text: str) -> Message:
    """Read a message of a page.

    Raises:
        ValueError: It is none that is known.
    """
    message: Message = _MESSAGE.validate_json(text)
    return message
