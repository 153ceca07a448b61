"""A checkpoint's files, taken only if they are whole: weights, processors, and what they are read with."""

import json
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import torch
from lerobot.configs import FeatureType, NormalizationMode
from lerobot.utils.constants import POLICY_POSTPROCESSOR_DEFAULT_NAME, POLICY_PREPROCESSOR_DEFAULT_NAME
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn

from lerobot_excav.errors import ConfigurationError, require, shown

PROCESSORS = {
    f"{POLICY_PREPROCESSOR_DEFAULT_NAME}.json": "normalizer_processor",
    f"{POLICY_POSTPROCESSOR_DEFAULT_NAME}.json": "unnormalizer_processor",
}
"""Files of the processors, and the step of each without which the numbers are others than in training."""

_STATISTICS = {
    NormalizationMode.MEAN_STD: ("mean", "std"),
    NormalizationMode.MIN_MAX: ("min", "max"),
    NormalizationMode.QUANTILES: ("q01", "q99"),
    NormalizationMode.QUANTILE10: ("q10", "q90"),
    NormalizationMode.IDENTITY: (),
}
_DAMAGED = "Copy the checkpoint again, or take another one."


def read_json(file: Path) -> dict[str, Any]:
    """Read a JSON object from a file.

    Raises:
        ConfigurationError: The file is missing, is not text, or holds something else.
    """
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ConfigurationError(f"{file} cannot be read ({error}). {_DAMAGED}") from error
    require(isinstance(content, dict), f"{file} holds {shown(content, most=60)}, not settings by name. {_DAMAGED}")
    return dict(content)


def read_tensors(file: Path) -> dict[str, Tensor]:
    """Read tensors by name.

    Raises:
        ConfigurationError: The file is missing, truncated or damaged, or holds a number that is not finite.
    """
    try:
        tensors = load_file(file)
    except (OSError, SafetensorError, ValueError) as error:
        raise ConfigurationError(f"{file} cannot be read ({error}). {_DAMAGED}") from error
    broken = [name for name, value in tensors.items() if not _is_finite(value)]
    require(not broken, f"{file}: {_listed(broken)} {_hold(broken)} numbers that are not finite. {_DAMAGED}")
    return tensors


def load_weights(policy: nn.Module, file: Path) -> None:
    """Fill a policy with the weights of a file, of which none may be missing, left over or of another shape.

    Raises:
        ConfigurationError: They do not fit, or the file cannot be read.
    """
    found, expected = read_tensors(file), policy.state_dict()
    missing, unknown = sorted(expected.keys() - found.keys()), sorted(found.keys() - expected.keys())
    other = [
        f"{name} {tuple(found[name].shape)} instead of {tuple(value.shape)}"
        for name, value in expected.items()
        if name in found and not _is_alike(found[name], value)
    ]
    problems = [
        f"{words} {_listed(names)}"
        for words, names in (("lacks", missing), ("has unknown", unknown), ("has the misshaped", other))
        if names
    ]
    require(
        not problems,
        f"{file} {'; '.join(problems)}: it is damaged, or a setting of the network is another one than in training. "
        "A checkpoint keeps its network; leave such settings out.",
    )
    policy.load_state_dict(found)


def require_processors(folder: Path) -> None:
    """Check both processors of a checkpoint: their steps, and the statistics that these work with.

    LeRobot passes on, as it is, whatever it has no statistics for.

    Raises:
        ConfigurationError: A file is missing or damaged, or statistics are missing, not finite or of another shape.
    """
    for name, needed in PROCESSORS.items():
        file = folder / name
        steps = [step for step in _steps(file) if step.get("registry_name") == needed]
        require(len(steps) == 1, f"{file} has {len(steps)} steps {needed!r} and should have one. {_DAMAGED}")
        state = folder / str(steps[0].get("state_file"))
        statistics = read_tensors(state)
        for key, shape in _needed_statistics(file, steps[0].get("config")):
            require(key in statistics, f"{state} lacks {key}, without which {file.name} would not scale. {_DAMAGED}")
            count = statistics[key].numel()
            require(
                count == shape[0] or (len(shape) == 3 and count in (1, shape[0])),
                f"{state}: {key} has {count} numbers, and its feature has the shape {shape}. {_DAMAGED}",
            )


def _steps(file: Path) -> list[dict[str, Any]]:
    steps = read_json(file).get("steps")
    is_list = isinstance(steps, list) and all(isinstance(step, dict) for step in steps)
    require(is_list, f"{file}: steps={shown(steps, most=60)} is not a list of steps. {_DAMAGED}")
    return list(steps or [])


def _needed_statistics(file: Path, config: Any) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield the names of the statistics that a step needs, each with the shape of its feature."""
    try:
        chosen = config.get("normalize_observation_keys")
        for name, feature in config["features"].items():
            kind, shape = FeatureType(feature["type"]), tuple(feature["shape"])
            if kind is FeatureType.ACTION or chosen is None or name in chosen:
                mode = NormalizationMode(config["norm_map"].get(kind.value, NormalizationMode.IDENTITY))
                yield from ((f"{name}.{statistic}", shape) for statistic in _STATISTICS[mode])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ConfigurationError(f"{file} is damaged ({type(error).__name__}: {error}). {_DAMAGED}") from error


def _is_finite(value: Tensor) -> bool:
    # PyTorch cannot tell it of all formats of one byte.
    return bool(torch.isfinite(value if value.element_size() > 1 else value.float()).all())


def _is_alike(found: Tensor, expected: Tensor) -> bool:
    return found.shape == expected.shape and found.is_floating_point() == expected.is_floating_point()


def _listed(names: Collection[str], most: int = 3) -> str:
    rest = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(list(names)[:most]) + rest


def _hold(names: Collection[str]) -> str:
    return "holds" if len(names) == 1 else "hold"
