"""Mask source `grounded_sam`: words -> a box of Grounding DINO -> a mask of SAM 2.

A region of uniform sand has no edge in a picture, and the mask of SAM 2 is that of the whole pile. So a region of the
ground comes from depth, as with `geometry`, and the mask of the pile bounds it.
"""

import hashlib
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.grounding import GROUNDING_DINO, Detection, Detector
from lerobot_excav.envs.masks.model_files import ModelName, Placement
from lerobot_excav.envs.masks.options import MaskOptions, Share
from lerobot_excav.envs.masks.segment_anything import SAM2, SegmentAnything
from lerobot_excav.envs.masks.shot import reduced
from lerobot_excav.envs.masks.source import MaskView, Pixels, TargetMask, register_mask_source


class GroundedSamOptions(MaskOptions):
    """Options of the source `grounded_sam`.

    Attributes:
        text: What to look for; None: what the task calls the target.
        detector: Weights of Grounding DINO.
        segmenter: Weights of SAM 2.
        threshold: Least score of a box (kind: that of the model's authors).
        text_threshold: Least score of a word of it.
        download: Whether weights may be fetched from the Hub.
        device: Where the models run.
    """

    text: Annotated[str, Field(min_length=1)] | None = None
    detector: ModelName = GROUNDING_DINO
    segmenter: ModelName = SAM2
    threshold: Share = 0.3
    text_threshold: Share = 0.25
    download: bool = False
    device: str = "cpu"


class GroundedSamSource:
    """Looks for words in the picture; both models run once for a picture and its words."""

    def __init__(self, options: GroundedSamOptions) -> None:
        self._options = options
        placement = Placement(options.download, options.device)
        self._detector = Detector(
            options.detector, placement, threshold=options.threshold, text_threshold=options.text_threshold
        )
        self._segmenter = SegmentAnything(options.segmenter, placement)
        self._known: tuple[object, Detection | None, Pixels] | None = None  # of the scene and the words before

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the mask of a command; None if nothing in the picture is what the words say.

        Raises:
            ConfigurationError: The weights or transformers are not here, or a region of the ground has no depth.
        """
        words = self._options.text or view.words(command)
        shot = view.shot()
        found, fine = self._look(shot.picture, words)
        if found is None:
            return None
        facts = {"words": words, "score": round(found.score, 3), "box": [round(edge, 1) for edge in found.box]}
        facts |= {"detector": self._options.detector.words, "segmenter": self._options.segmenter.words}
        place_w = view.place_w(command)
        patch = None if place_w is None else view.patch(place_w, shot)
        if patch is not None:
            facts |= {"inside_px": int((patch & fine).sum()), "patch_px": int(patch.sum()), "whole_px": int(fine.sum())}
            fine = patch & fine
        pixels = reduced(fine, (view.camera.height, view.camera.width))
        if not pixels.any():
            return None
        return TargetMask(pixels=pixels, target_id=command.target_id, source="grounded_sam", parameters=facts)

    def _look(self, picture: NDArray[np.uint8], words: str) -> tuple[Detection | None, Pixels]:
        # Not the scene: it may look otherwise now, and its number may be that of another one elsewhere.
        key = hashlib.sha256(picture.tobytes()).hexdigest(), words
        if self._known is None or self._known[0] != key:
            found = self._detector.find(picture, words)
            empty = np.zeros(picture.shape[:2], dtype=bool)
            self._known = key, found, empty if found is None else self._segmenter.pixels(picture, found.box)
        return self._known[1:]


register_mask_source("grounded_sam", GroundedSamSource, options=GroundedSamOptions)
