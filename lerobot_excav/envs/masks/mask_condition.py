"""Mask conditions: the right mask, and the corruptions that test whether a policy obeys it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.settings import MASK_CONDITIONS, SCENE_SETS
from lerobot_excav.errors import ExcavError, require_choice

_SHIFT_TRIES = 1000
_STREAM = 0x3A5C  # names this family of random streams


def corruption_rng(scene_set: str, scene_id: int, target_id: int) -> np.random.Generator:
    """Return the generator of a corrupted mask: the same scene and target are always shown the same corruption."""
    key = (SCENE_SETS.index(scene_set), scene_id, target_id)
    return np.random.default_rng(np.random.SeedSequence(_STREAM, spawn_key=key))


def conditioned_mask(
    masks: Sequence[NDArray[np.uint8]], target_id: int, condition: str, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return the mask that is shown under a condition.

    Args:
        masks: The right mask of every target, each (H, W, 3) of {0, 255}, uint8.
        target_id: Index of the commanded target.
        condition: `correct`; `zero` (empty); `random` (the same blob moved elsewhere in the picture, off its place);
            `mismatched` (the mask of another target).
        rng: Source of the place or of the other target.

    Returns:
        Mask (H, W, 3) of {0, 255}, uint8.

    Raises:
        ConfigurationError: There is no such condition.
        ExcavError: The picture shows nothing of the commanded target, or no other place is free for its blob.
    """
    require_choice("mask_condition", condition, MASK_CONDITIONS)
    if not masks[target_id].any():
        height, width = masks[target_id].shape[:2]
        raise ExcavError(
            f"target_id={target_id} covers no pixel of a picture of {height} x {width}; "
            "use larger observation_height and observation_width"
        )
    if condition == "zero":
        return np.zeros_like(masks[target_id])
    if condition == "random":
        return _moved_elsewhere(masks[target_id], rng)
    if condition == "mismatched":
        others = [i for i in range(len(masks)) if i != target_id]
        return masks[int(rng.choice(others))].copy()
    return masks[target_id].copy()


def _moved_elsewhere(mask: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Shift a blob inside the picture so that it does not overlap its old place."""
    rows, cols = np.nonzero(mask[..., 0])
    height, width = mask.shape[:2]
    for _ in range(_SHIFT_TRIES):
        row_shift = int(rng.integers(-rows.min(), height - rows.max()))
        col_shift = int(rng.integers(-cols.min(), width - cols.max()))
        moved = np.zeros_like(mask)
        moved[rows + row_shift, cols + col_shift] = 255
        if not np.any(moved & mask):
            return moved
    raise ExcavError(
        f"mask_condition='random': no free place for a blob of {rows.size} pixels in {height} x {width}; "
        "use larger observation_height and observation_width"
    )
