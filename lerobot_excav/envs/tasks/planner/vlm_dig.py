"""Mask source `vlm_dig`: a vision-language model chooses where to dig, as in the paper; the planner checks it.

The model sees the picture and its depth, and answers with a box and a reason. The region around the middle of the box
is what is commanded; SAM 2's mask of the box bounds it. Whatever cannot be done, or is no answer, is answered by the
planner instead: with a warning, counted in the metrics.
"""

import logging
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.model_files import Placement
from lerobot_excav.envs.masks.segment_anything import Box, SegmentAnything
from lerobot_excav.envs.masks.shot import Shot, reduced
from lerobot_excav.envs.masks.source import MaskView, Pixels, TargetMask
from lerobot_excav.envs.masks.vision_language import VisionLanguageModel
from lerobot_excav.envs.tasks.planner.candidates import Candidates
from lerobot_excav.envs.tasks.planner.depth_picture import depth_picture
from lerobot_excav.envs.tasks.planner.dig_answer import (
    UnusableAnswerError,
    read_answer,
    require_diggable,
    require_reach,
    require_soil,
)
from lerobot_excav.envs.tasks.planner.plan import Plan
from lerobot_excav.envs.tasks.planner.surface import SeenSurface, see_surface
from lerobot_excav.envs.tasks.planner.vlm_options import VlmDigOptions
from lerobot_excav.errors import ConfigurationError, require

logger = logging.getLogger(__name__)

REACH_M = (2.6, 6.4)
"""Distance from the swing axis at which a region may be commanded [m] (kind: guess; more than the planner's)."""

LEAST_INSIDE = 0.25
"""Part of the region that SAM 2 has to see, or its mask does not count (kind: guess)."""

QUESTION = """\
The first picture is what the fixed camera above an excavator sees, the second one the depth of the same view: the \
lighter, the nearer. Choose the region of the sand pile that the bucket should dig next. Rules: dig sand, not bare \
ground, not the machine and not the box. Prefer a place with much sand, and more sand between it and the \
machine. The place must lie {low:.1f} to {high:.1f} m from the machine's swing axis, and be in sight. A region is \
0.8 m wide{barred}. Answer with JSON alone: {{"box": [left, upper, right, lower], "reason": "one sentence"}}, the box \
in the coordinates that you use for the first picture."""


class DigView(MaskView, Protocol):
    """What this source looks at: the view of an excavator."""

    def planned(self, surface: SeenSurface) -> Plan:
        """Return what the planner proposes."""

    def rated(self, places_w: NDArray[np.float64], surface: SeenSurface) -> Candidates:
        """Return how the planner rates places (n, 3) [m]."""


class Choice(NamedTuple):
    """Where to dig, (3,) [m], and why: the model's box and reason, or why the planner has chosen instead."""

    place_w: NDArray[np.float64]
    box: Box | None
    facts: dict[str, object]


class VlmDigSource:
    """Asks a vision-language model once for every situation."""

    def __init__(self, options: VlmDigOptions) -> None:
        self._options = options
        placement = Placement(options.download, options.device)
        self._model = VisionLanguageModel(options.model, placement, most_tokens=options.most_tokens)
        self._segmenter = SegmentAnything(options.segmenter, placement)
        self._known: tuple[tuple[int, ...], TargetMask | None] | None = None

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the mask of the region that is chosen; None if nothing is left to dig.

        Raises:
            ConfigurationError: The machine is no excavator, or the weights or transformers are not here.
        """
        require(hasattr(view, "planned"), "mask_source='vlm_dig' chooses where to dig; it needs an excavator")
        if self._known is None or self._known[0] != view.scene_key:
            self._known = view.scene_key, self._choose(view)  # type: ignore[arg-type]  # checked above
        return self._known[1]

    def _choose(self, view: DigView) -> TargetMask | None:
        shot = view.shot()
        assert shot.depth_m is not None  # of an excavator
        assert shot.camera is not None
        surface = see_surface(shot.depth_m, shot.camera)
        choice = self._answer(view, shot, surface) or self._plan(view, surface)
        if choice is None:
            return None
        pixels, facts = self._bounded(view, shot, choice)
        small = reduced(pixels, (view.camera.height, view.camera.width))
        if not small.any():
            return None
        return TargetMask(pixels=small, target_id=None, source="vlm_dig", parameters=facts, place_w=choice.place_w)

    def _answer(self, view: DigView, shot: Shot, surface: SeenSurface) -> Choice | None:
        """Return what the model chooses, or None with a note if that cannot be done."""
        self._fallback = ""
        assert shot.depth_m is not None
        question = QUESTION.format(low=REACH_M[0], high=REACH_M[1], barred=f". {self._options.rules}".rstrip(". "))
        answer = self._model.ask([shot.picture, depth_picture(shot.depth_m)], question)
        try:
            box, reason = read_answer(answer, shot.size)
            place_w = _middle(shot, box)
            require_soil(place_w, surface)
            require_reach(float(np.hypot(*(place_w[:2] - np.asarray(MACHINE_POS_W[:2])))), REACH_M)
            require_diggable(view.rated(place_w[None], surface))
        except UnusableAnswerError as unusable:
            self._fallback = f"{self._options.model.words}: {unusable}"
            logger.warning("%s; the planner chooses instead", self._fallback)
            return None
        return Choice(place_w, box, {"box": [round(edge, 1) for edge in box], "reason": reason})

    def _plan(self, view: DigView, surface: SeenSurface) -> Choice | None:
        proposals = view.planned(surface).proposals
        if not proposals:
            return None
        return Choice(proposals[0].target.center_w, None, {"fallback": self._fallback, "planner": proposals[0].reason})

    def _bounded(self, view: DigView, shot: Shot, choice: Choice) -> tuple[Pixels, dict[str, object]]:
        """Return the pixels of the region, within what SAM 2 sees in the box, and what became of it."""
        patch = view.patch(choice.place_w, shot)
        if patch is None:
            raise ConfigurationError("mask_source='vlm_dig' chooses where to dig; it needs an excavator")
        if choice.box is None:
            return patch, choice.facts
        whole = self._segmenter.pixels(shot.picture, choice.box)
        inside = patch & whole
        areas = {"inside_px": int(inside.sum()), "patch_px": int(patch.sum()), "whole_px": int(whole.sum())}
        # Sand has no edges, and SAM 2 may see next to nothing in a box: then the depth decides alone.
        is_much = areas["inside_px"] >= LEAST_INSIDE * areas["patch_px"]
        return (inside if is_much else patch), {**choice.facts, **areas}


def _middle(shot: Shot, box: Box) -> NDArray[np.float64]:
    """Return the point (3,) [m] in the middle of a box."""
    height, width = shot.size
    row, column = min(int(0.5 * (box[1] + box[3])), height - 1), min(int(0.5 * (box[0] + box[2])), width - 1)
    return np.asarray(shot.points_w()[row, column])
