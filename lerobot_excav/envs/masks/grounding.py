"""Grounding DINO as a detector: words in, a box out.

S. Liu et al., "Grounding DINO", ECCV 2024.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.masks.model_files import ModelName, Placement, load, load_model, require_transformers
from lerobot_excav.envs.masks.segment_anything import Box
from lerobot_excav.errors import require

GROUNDING_DINO = ModelName(name="IDEA-Research/grounding-dino-tiny")


class Detection(NamedTuple):
    """What was found."""

    box: Box
    score: float
    words: str


class Detector:
    """A Grounding DINO of transformers; it is loaded at first use.

    Args:
        model: Its weights.
        threshold: Least score of a box.
        text_threshold: Least score of a word, for it to be among those that the box is called by.
        placement: Where it runs, and whether weights may be fetched.
    """

    def __init__(self, model: ModelName, placement: Placement, *, threshold: float, text_threshold: float) -> None:
        self._name, self._placement = model, placement
        self._thresholds = {"threshold": threshold, "text_threshold": text_threshold}
        self._loaded: tuple[Any, Any] | None = None

    def find(self, picture: NDArray[np.uint8], words: str) -> Detection | None:
        """Return the best box for words in a picture (H, W, 3), within it; None if nothing is good enough.

        Raises:
            ConfigurationError: The weights are not here.
        """
        import torch

        processor, model = self._load()
        inputs = processor(images=picture, text=phrase(words), return_tensors="pt").to(self._placement.device)
        with torch.inference_mode():
            outputs = model(**inputs)
        height, width = picture.shape[:2]
        size = height, width
        (found,) = processor.post_process_grounded_object_detection(
            outputs, inputs.input_ids, target_sizes=[size], **self._thresholds
        )
        if len(found["scores"]) == 0:
            return None
        best = int(found["scores"].argmax())
        box = clipped(found["boxes"][best].tolist(), size)
        return None if box is None else Detection(box, float(found["scores"][best]), str(found["text_labels"][best]))

    def _load(self) -> tuple[Any, Any]:
        if self._loaded is None:
            require_transformers()
            from transformers import GroundingDinoForObjectDetection, GroundingDinoProcessor

            processor = load(GroundingDinoProcessor.from_pretrained, self._name, download=self._placement.download)
            self._loaded = (
                processor,
                load_model(GroundingDinoForObjectDetection.from_pretrained, self._name, self._placement),
            )
        return self._loaded


def phrase(words: str) -> str:
    """Return words as the model wants them: in lower case, each phrase with a full stop behind it.

    Raises:
        ConfigurationError: There are none.
    """
    parts = [part.strip().lower() for part in words.split(".")]
    said = " ".join(f"{part}." for part in parts if part)
    require(bool(said), f"the words {words!r} say nothing to look for; give --mask.text, or text in mask_options")
    return said


def clipped(box: list[float], size: tuple[int, int]) -> Box | None:
    """Return a box within a picture of height and width `size` [px]; None if less than a pixel of it lies there."""
    height, width = size
    left, right = (float(np.clip(x, 0.0, width)) for x in (box[0], box[2]))
    upper, lower = (float(np.clip(y, 0.0, height)) for y in (box[1], box[3]))
    if not (right - left >= 1.0 and lower - upper >= 1.0):  # NaN is neither
        return None
    return left, upper, right, lower
