"""SAM 2 as a segmenter: a box in, the pixels of what fills it out."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.masks.model_files import ModelName, Placement, load, load_model, require_transformers

Box = tuple[float, float, float, float]
"""Left, upper, right, lower [px]."""

SAM2 = ModelName(name="facebook/sam2.1-hiera-tiny")


class SegmentAnything:
    """A SAM 2 of transformers; it is loaded at first use.

    Args:
        model: Its weights.
        placement: Where it runs, and whether weights may be fetched.
    """

    def __init__(self, model: ModelName, placement: Placement) -> None:
        self._name, self._placement = model, placement
        self._loaded: tuple[Any, Any] | None = None

    def pixels(self, picture: NDArray[np.uint8], box: Box) -> NDArray[np.bool_]:
        """Return the pixels (H, W) of what fills a box of a picture (H, W, 3).

        Raises:
            ConfigurationError: The weights are not here.
        """
        import torch

        processor, model = self._load()
        # Three levels: pictures, boxes of each, coordinates of each.
        inputs = processor(images=picture, input_boxes=[[list(map(float, box))]], return_tensors="pt")
        with torch.inference_mode():
            outputs = model(**inputs.to(self._placement.device), multimask_output=False)
        masks = processor.post_process_masks(outputs.pred_masks.cpu(), inputs["original_sizes"].cpu())
        return np.asarray(masks[0][0, 0].numpy(), dtype=bool)  # of the first picture, its first box, the one proposal

    def _load(self) -> tuple[Any, Any]:
        if self._loaded is None:
            require_transformers()
            from transformers import Sam2Model, Sam2Processor

            processor = load(Sam2Processor.from_pretrained, self._name, download=self._placement.download)
            self._loaded = processor, load_model(Sam2Model.from_pretrained, self._name, self._placement)
        return self._loaded
