"""What a vision-language model answers to the question where to dig: its form, and whether it can be done."""

import json
import re
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from lerobot_excav.envs.masks.grounding import clipped
from lerobot_excav.envs.masks.segment_anything import Box
from lerobot_excav.envs.masks.vision_language import Answer
from lerobot_excav.envs.tasks.planner.candidates import Candidates
from lerobot_excav.envs.tasks.planner.surface import SeenSurface

LONGEST_REASON = 500


class UnusableAnswerError(Exception):
    """An answer that cannot be carried out; its text says why."""


class DigAnswer(BaseModel):
    """Where to dig, and why; the box is left, upper, right, lower."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    box: tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]
    reason: Annotated[str, Field(max_length=LONGEST_REASON)] = ""


def read_answer(answer: Answer, size: tuple[int, int]) -> tuple[Box, str]:
    """Return the box of an answer in the pixels of a picture of height and width `size`, and its reason.

    Raises:
        UnusableAnswerError: It holds no such answer, or its box lies beside the picture.
    """
    found = re.search(r"\{.*?\}", answer.text, flags=re.DOTALL)
    if found is None:
        raise UnusableAnswerError(f"it answers without JSON: {answer.text[:100]!r}")
    try:
        parsed = DigAnswer.model_validate(json.loads(found[0]))
    except (json.JSONDecodeError, ValidationError) as error:
        raise UnusableAnswerError(f"its JSON is not what was asked for: {found[0][:100]!r}") from error
    down, across = size[0] / answer.scale[0], size[1] / answer.scale[1]
    left, upper, right, lower = parsed.box
    box = clipped([left * across, upper * down, right * across, lower * down], size)
    if box is None:
        raise UnusableAnswerError(f"its box {list(parsed.box)} lies beside the picture, or is empty")
    return box, parsed.reason


def require_soil(place_w: NDArray[np.float64], surface: SeenSurface) -> None:
    """Check that a place (3,) [m] is soil that is seen, and no part of the machine.

    Raises:
        UnusableAnswerError: It is not.
    """
    if not surface.shows(place_w[None])[0]:
        raise UnusableAnswerError("in the middle of its box there is no soil")


def require_reach(radius_m: float, reach_m: tuple[float, float]) -> None:
    """Check that the bucket reaches a place so far from the swing axis [m].

    Raises:
        UnusableAnswerError: It is out of reach.
    """
    low_m, high_m = reach_m
    if not low_m <= radius_m <= high_m:
        raise UnusableAnswerError(f"its place is {radius_m:.1f} m away, and the bucket digs from {low_m} to {high_m} m")


def require_diggable(rated: Candidates) -> None:
    """Check that one rated place may be dug and is worth a cycle, by the planner's own rules.

    Raises:
        UnusableAnswerError: It is not.
    """
    if rated.is_barred[0]:
        raise UnusableAnswerError("its place is barred by keep_out")
    if not rated.is_possible[0]:
        raise UnusableAnswerError(
            f"its place is not worth a cycle: {rated.swept_m3[0]:.2f} m3 within a cut, loading begins after "
            f"{rated.onset_m[0]:.2f} m, {rated.seen_share[0]:.0%} of it is seen"
        )
