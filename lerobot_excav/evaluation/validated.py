"""What is read from a file, as a model: errors say where, which field, and what is allowed."""

from collections.abc import Mapping
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from lerobot_excav.errors import DatasetError, ExcavError


def validated[Model: BaseModel](
    model: type[Model], text: str, place: str, *, error: type[ExcavError] = DatasetError
) -> Model:
    """Make a model of JSON.

    Args:
        model: What is expected.
        text: The JSON.
        place: Where it stands, for messages, as `FILE:LINE`.
        error: What to raise.

    Raises:
        ExcavError: Of the type `error`: the text is not JSON, or not what the model expects.
    """
    try:
        return model.model_validate_json(text)
    except ValidationError as found:
        raise error(f"{place}: {_reason(found.errors()[0], model)}") from found


def _reason(error: Mapping[str, Any], model: type[BaseModel]) -> str:
    """Say in words what pydantic found first."""
    field = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in error["loc"])[1:]
    kind, value, message = error["type"], error["input"], error["msg"]
    if kind == "missing":
        return f"lacks {field}"
    if kind == "extra_forbidden":
        return f"{field} is not known; allowed: {', '.join(_part(model, error['loc'][:-1]).model_fields)}"
    if kind == "json_invalid":
        return f"not JSON ({error['ctx']['error']}); was its writer interrupted? Remove what is incomplete"
    if kind == "value_error":
        return f"{field}: {error['ctx']['error']}" if field else str(error["ctx"]["error"])
    return f"{field or 'the whole'}={value!r:.60}: {message[0].lower()}{message[1:]}"


def _part(model: Any, place: tuple[str | int, ...]) -> Any:
    """Return the model at a place within another."""
    for part in place:
        model = get_args(model)[0] if isinstance(part, int) else model.model_fields[part].annotation
    return model
