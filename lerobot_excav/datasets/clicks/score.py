"""How well clicks become masks: intersection over union, at the size that policies see."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.clicks.clicked_scenes import ClickedScene, click_on
from lerobot_excav.envs.masks.click.segmenter import ClickSegmenter
from lerobot_excav.envs.masks.shot import reduced

POLICY_SIZE = (96, 128)
"""Height and width at which masks are compared [px]: the default of every environment."""


class ClickScore(NamedTuple):
    """Scores of some scenes.

    Attributes:
        scenes: How many.
        ious: Intersection over union of every target with its mask, (n,).
    """

    scenes: int
    ious: NDArray[np.float64]

    @property
    def mean(self) -> float:
        """Mean over the targets."""
        return float(self.ious.mean())

    @property
    def share_above_half(self) -> float:
        """Share of the targets whose mask is more right than wrong."""
        return float((self.ious > 0.5).mean())


def score(segmenter: ClickSegmenter, scenes: Iterable[ClickedScene], rng: np.random.Generator) -> ClickScore:
    """Click once on every target of some scenes, and compare what is marked with what it covers."""
    ious, count = [], 0
    for scene in scenes:
        count += 1
        for target in scene.targets:
            row, column = click_on(target, rng)
            share = ((row + 0.5) / target.mask.shape[0], (column + 0.5) / target.mask.shape[1])
            found = reduced(segmenter.pixels(scene.picture, *share), POLICY_SIZE)
            ious.append(iou(found, reduced(target.mask, POLICY_SIZE)))
    return ClickScore(count, np.array(ious))


def iou(first: NDArray[np.bool_], second: NDArray[np.bool_]) -> float:
    """Return the intersection over union of two masks (H, W); two empty ones agree."""
    union = int((first | second).sum())
    return 1.0 if union == 0 else int((first & second).sum()) / union
