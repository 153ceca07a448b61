"""What the mask source `vlm_dig` can be told."""

from typing import Annotated

from pydantic import Field

from lerobot_excav.envs.masks.model_files import ModelName
from lerobot_excav.envs.masks.options import MaskOptions
from lerobot_excav.envs.masks.segment_anything import SAM2
from lerobot_excav.envs.masks.vision_language import QWEN


class VlmDigOptions(MaskOptions):
    """Options of the source `vlm_dig`.

    Attributes:
        model: Weights of a Qwen2.5-VL or Qwen3-VL.
        segmenter: Weights of SAM 2.
        rules: Further rules for the model, in words.
        most_tokens: Longest answer [tokens].
        download: Whether weights may be fetched from the Hub.
        device: Where the models run.
    """

    model: ModelName = QWEN
    segmenter: ModelName = SAM2
    rules: str = ""
    most_tokens: Annotated[int, Field(ge=16, le=4096)] = 256
    download: bool = False
    device: str = "cpu"
