"""What is read from a file, as a model: errors say where, which field, and what is allowed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.errors import DatasetError, ExcavError, shown


def validated[Model: BaseModel](
    model: type[Model], text: str, place: str, *, error: type[ExcavError] = DatasetError
) -> Model:
    """Make a model of JSON that stands at a place such as `FILE:LINE`.

    Raises:
        ExcavError: Of the type `error`: the text is not JSON, or not what the model expects.
    """
    try:
        return model.model_validate_json(text)
    except ValidationError as found:
        raise error(f"{place}: {_first_reason(found, model)}") from found


def validated_file[Model: BaseModel](model: type[Model], path: Path) -> Model:
    """Make a model of a JSON file.

    Raises:
        DatasetError: The file is missing, not text, not JSON, or not what the model expects.
    """
    with reading(path):
        text = path.read_text(encoding="utf-8")
    return validated(model, text, str(path))


def validated_value[Model: BaseModel](model: type[Model], value: Mapping[str, Any], place: str) -> Model:
    """Make a model of what was read already, such as a row of a table.

    Raises:
        DatasetError: It is not what the model expects.
    """
    try:
        return model.model_validate(value)
    except ValidationError as found:
        raise DatasetError(f"{place}: {_first_reason(found, model)}") from found


def _first_reason(found: ValidationError, model: type[BaseModel]) -> str:
    errors = found.errors()
    # A misspelt field is unknown and, under its right name, missing: the first says more.
    return _reason(next((item for item in errors if item["type"] == "extra_forbidden"), errors[0]), model)


def _reason(error: Mapping[str, Any], model: type[BaseModel]) -> str:
    """Say in words what pydantic found."""
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
    return f"{field or 'the whole'}={shown(value, most=60)}: {message[0].lower()}{message[1:]}"


def _part(model: Any, place: tuple[str | int, ...]) -> Any:
    """Return the model at a place within another."""
    for name in place:
        if isinstance(name, str):
            model = _first_model(model.model_fields[name].annotation)
    return model


def _first_model(kind: Any) -> Any:
    """Return the model in a type such as `tuple[Row, ...]` or `Row | None`."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind
    return next((found for part in get_args(kind) if (found := _first_model(part))), None)
