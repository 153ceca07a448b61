"""Reading JSON Lines: one object per line, blank lines left out."""

import json
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from lerobot_excav.errors import DatasetError


class Line(NamedTuple):
    """One object of a file.

    Attributes:
        place: `FILE:NUMBER`, for messages.
        record: The object.
    """

    place: str
    record: dict[str, Any]

    def read[Model: BaseModel](self, model: type[Model], *, hint: str) -> Model:
        """Make an object of the line; `hint` says what to do if it is something else.

        Raises:
            DatasetError: A field is missing, unknown or has a value that is not possible; the message names each.
        """
        try:
            return model.model_validate(self.record)
        except ValidationError as error:
            problems = "; ".join(_in_words(problem) for problem in error.errors())
            raise DatasetError(f"{self.place}: {problems}; {hint}") from None


def read_json_lines(path: Path, *, origin: str) -> list[Line]:
    """Read all objects of a file; `origin` says what writes such a file.

    Raises:
        DatasetError: The file is missing, or a line is no JSON object; the message names the line.
    """
    try:
        lines = path.read_text().splitlines()
    except FileNotFoundError:
        raise DatasetError(f"{path} does not exist; {origin}") from None
    return [_line(text, f"{path}:{number}") for number, text in enumerate(lines, 1) if text.strip()]


def _line(text: str, place: str) -> Line:
    try:
        record = json.loads(text)
    except json.JSONDecodeError as error:
        raise DatasetError(
            f"{place}: not JSON ({error}); was its writer interrupted? Remove the line if it is the last"
        ) from error
    if not isinstance(record, dict):
        raise DatasetError(f"{place}: a JSON object is expected, not {text[:40]!r}")
    return Line(place, record)


def _in_words(problem: Any) -> str:
    name = ".".join(map(str, problem["loc"]))
    if problem["type"] == "missing":
        return f"lacks {name}"
    if problem["type"] == "extra_forbidden":
        return f"{name} is not known"
    return f"{name}={problem['input']!r}: {problem['msg']}"
