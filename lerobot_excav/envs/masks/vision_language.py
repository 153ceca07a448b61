"""A vision-language model of the Qwen family as somebody who looks at pictures and answers a question."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.masks.model_files import ModelName, Placement, load, load_model, require_transformers
from lerobot_excav.errors import require

QWEN = ModelName(name="Qwen/Qwen2.5-VL-7B-Instruct")

KINDS = ("qwen2_5_vl", "qwen3_vl", "qwen3_vl_moe")
"""Kinds of models whose answers are understood."""

RELATIVE = 1000.0
"""Full scale of the boxes of Qwen3-VL, in both axes (source: its model card)."""


class Answer(NamedTuple):
    """What the model says, and the height and width that its places refer to."""

    text: str
    scale: tuple[float, float]


class VisionLanguageModel:
    """A Qwen2.5-VL or Qwen3-VL of transformers; it is loaded at first use.

    Args:
        model: Its weights.
        most_tokens: Longest answer [tokens].
        placement: Where it runs, and whether weights may be fetched.
    """

    def __init__(self, model: ModelName, placement: Placement, *, most_tokens: int) -> None:
        self._name, self._most_tokens, self._placement = model, most_tokens, placement
        self._loaded: tuple[Any, Any] | None = None

    def ask(self, pictures: Sequence[NDArray[np.uint8]], question: str) -> Answer:
        """Return the most likely answer to a question about pictures (H, W, 3); places refer to the first of them.

        Raises:
            ConfigurationError: The weights are not here.
        """
        import torch

        processor, model = self._load()
        parts: list[dict[str, str]] = [{"type": "image"} for _ in pictures]
        messages = [{"role": "user", "content": [*parts, {"type": "text", "text": question}]}]
        prompt = processor.apply_chat_template(messages, add_generation_prompt=True, tokenize=False)
        inputs = processor(text=[prompt], images=list(pictures), return_tensors="pt").to(self._placement.device)
        with torch.inference_mode():
            tokens = model.generate(**inputs, max_new_tokens=self._most_tokens, do_sample=False)
        said = tokens[:, inputs["input_ids"].shape[1] :]
        text = str(processor.batch_decode(said, skip_special_tokens=True)[0])
        return Answer(text, self._scale(processor, model, inputs["image_grid_thw"][0].tolist()))

    def _scale(self, processor: Any, model: Any, grid: Sequence[int]) -> tuple[float, float]:
        """Return height and width that stand for the whole picture in an answer.

        Qwen2.5-VL means pixels of the picture as it was resized, each axis by a factor of its own.
        """
        if str(model.config.model_type).startswith("qwen3"):
            return RELATIVE, RELATIVE
        patch_px = float(processor.image_processor.patch_size)
        return grid[1] * patch_px, grid[2] * patch_px

    def _load(self) -> tuple[Any, Any]:
        if self._loaded is None:
            require_transformers()
            from transformers import AutoModelForImageTextToText, AutoProcessor

            processor = load(AutoProcessor.from_pretrained, self._name, download=self._placement.download)
            kind = AutoModelForImageTextToText.from_pretrained
            model = load_model(kind, self._name, self._placement, dtype="auto")
            require(
                str(model.config.model_type) in KINDS,
                f"the weights {self._name.name!r} are of {model.config.model_type!r}, and how that gives boxes is not "
                f"known here; allowed: {', '.join(KINDS)}",
            )
            self._loaded = processor, model
        return self._loaded
