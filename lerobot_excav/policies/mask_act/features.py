"""What the features of a policy, and how they are normalised, have to look like."""

from collections.abc import Mapping
from typing import Any

from lerobot.configs import FeatureType, NormalizationMode, PolicyFeature
from lerobot.utils.constants import ACTION, OBS_STATE

from lerobot_excav.errors import require, shown

NORMALISED = tuple(
    kind.value for kind in (FeatureType.VISUAL, FeatureType.STATE, FeatureType.ACTION)
)  # kinds whose normalisation has to be told
_MOST = 100_000  # entries of a vector, or pixels along an axis: more is a slip of the keyboard

MISSING_MASK_HINT = (
    "Record or generate demonstrations with the target mask (`lerobot-excav demos` writes it), name another feature "
    "with --policy.mask_key, or train the no-condition variant with --policy.withhold_mask=true."
)


def check_features(field: str, features: Any) -> None:
    """Check features by name, None or empty where they are not known yet.

    Raises:
        ConfigurationError: A feature is not one, or its shape is not what the network takes.
    """
    require(
        features is None or isinstance(features, Mapping), f"{field}={shown(features)} does not map names to features"
    )
    for name, feature in (features or {}).items():
        place = f"{field}[{name!r}]={shown(feature)}"
        require(
            isinstance(name, str)
            and bool(name)
            and isinstance(feature, PolicyFeature)
            and isinstance(feature.type, FeatureType),
            f"{place} is not a feature; give a type ({', '.join(kind.value for kind in FeatureType)}) and a shape.",
        )
        require(
            _is_shape(feature.shape, _axes(name, feature.type)),
            f"{place} has a shape that is not possible; give (channels, height, width) for pictures and (length,) "
            f"for {OBS_STATE}, environment state and {ACTION}, in whole numbers from 1 to {_MOST}.",
        )


def _axes(name: str, kind: FeatureType) -> int | None:
    """Return how many axes the network takes; None where it does not read the feature."""
    is_vector = name in (OBS_STATE, ACTION) or kind is FeatureType.ENV
    return 3 if kind is FeatureType.VISUAL else 1 if is_vector else None


def _is_shape(shape: Any, axes: int | None) -> bool:
    return (
        isinstance(shape, tuple | list)
        and bool(shape)
        and axes in (None, len(shape))
        and all(isinstance(length, int) and length is not True and 1 <= length <= _MOST for length in shape)
    )


def check_normalization(field: str, mapping: Mapping[str, NormalizationMode]) -> None:
    """Check which kinds of features are normalised.

    Raises:
        ConfigurationError: A kind is not known, or one that every policy has is left out: LeRobot would not normalise
            it, without a word.
    """
    kinds = [kind.value for kind in FeatureType]
    wrong = [f"{kind!r} is unknown" for kind in mapping if kind not in kinds]
    wrong += [f"{kind!r} is missing" for kind in NORMALISED if kind not in mapping]
    require(
        not wrong,
        f"{field}={shown(dict(mapping))} is not possible ({', '.join(wrong)}); name {', '.join(NORMALISED)}; known are "
        f"{', '.join(kinds)}.",
    )


def require_way_back(frames: int, stride: int, *, withheld: bool) -> None:
    """Check that the settings of the way back have an effect.

    Raises:
        ConfigurationError: They have none.
    """
    require(
        stride == 1 or frames > 0,
        f"policy.backtrack_stride={stride} has no effect with backtrack_frames=0; give the longest way back.",
    )
    require(
        not (frames and withheld),
        f"policy.backtrack_frames={frames} has no effect with withhold_mask=True, which shows no target; give 0.",
    )


def require_rgb(key: str, shape: tuple[int, ...]) -> None:
    """Check that a camera has three channels.

    Raises:
        ConfigurationError: It has others.
    """
    require(
        shape[0] == 3,
        f"{key} has {shape[0]} channel(s), shape {shape}; mask_act reads RGB cameras. Leave it out of "
        "--policy.input_features.",
    )


def require_mask_shape(mask_key: str, mask_shape: tuple[int, ...], main_key: str, main_shape: tuple[int, ...]) -> None:
    """Raise `ConfigurationError` unless the shape of a mask fits its camera: ([B,] 1 or 3, H, W) to ([B,] 3, H, W)."""
    *batch, _, height, width = main_shape
    allowed = [(*batch, channels, height, width) for channels in (1, 3)]
    require(
        mask_shape in allowed,
        f"{mask_key} has shape {mask_shape}, {main_key} has shape {main_shape}; a mask marks pixels of its camera, so "
        f"its shape must be {allowed[0]} or {allowed[1]} (channels, height, width). Render both at one size, or set "
        "--policy.main_camera to the camera that the mask belongs to.",
    )


def require_shown(*, withheld: str, **settings: tuple[Any, Any]) -> None:
    """Check that nothing is asked of what is withheld.

    Args:
        withheld: The setting that withholds it.
        settings: Settings that change it by their names: their value, and the one that changes nothing.

    Raises:
        ConfigurationError: One of them changes it.
    """
    for field, (value, neutral) in settings.items():
        require(
            value == neutral,
            f"policy.{field}={value} has no effect with policy.{withheld}=true; give {neutral}, or leave it out",
        )
