"""The way that each environment has come since its target was shown, to be gone back when another one is."""

from collections import deque

import torch
from torch import Tensor

STILL_FRAMES = 5
"""How long a mask has to stand still before another one is a change of mind [frames] (kind: guess)."""


class WayBack:
    """Leads an environment back along its own actions when its mask shows another target soon after the last one.

    A policy that has seen no change of mind knows the states on the way to one target, not those from there to another
    one. At the end of the way back it is where it began, and there it knows what to do. That holds for actions that are
    positions; rates in the opposite order lead elsewhere. A mask of which a part lies on the one before shows the same
    target, moved or seen better, and an empty one shows none. Only what comes after a mask that stood still is a change
    of mind: one that jitters, as a segmenter's that looks at every frame, may lie beside itself from frame to frame.

    Args:
        most_frames: Longest way that is gone back; after a longer one the other target is no change of mind.
        stride: One in so many actions of the way is played, the first one always: so many times as fast.
    """

    def __init__(self, most_frames: int, stride: int = 1) -> None:
        self._most_frames, self._stride = most_frames, stride
        self.clear()

    def clear(self) -> None:
        """Forget all ways."""
        self._ways: list[list[Tensor]] = []
        self._led: list[deque[Tensor]] = []
        self._has_arrived: list[bool] = []
        self._still_frames: list[int] = []
        self._mask: Tensor | None = None  # the last one of each that showed a target
        self._last: Tensor | None = None

    @property
    def is_leading(self) -> Tensor:
        """Which environments are on their way back, bool (B,); meanwhile their masks are not looked at."""
        return torch.tensor([bool(led) for led in self._led], dtype=torch.bool)

    def look(self, mask: Tensor) -> Tensor:
        """Begin the way back where a mask, (B, 1, H, W), shows another target.

        Args:
            mask: Those of this frame.

        Returns:
            Which environments have come to the end of their way back, and need a plan from there, bool (B,).
        """
        if self._mask is None or self._last is None:
            self._mask, self._last = mask.clone(), mask  # the first ones are no change
            self._ways, self._led = [[] for _ in mask], [deque() for _ in mask]
            self._has_arrived, self._still_frames = [False for _ in mask], [0 for _ in mask]
        shown = mask.flatten(1).any(dim=1)
        is_other = shown & self._mask.flatten(1).any(dim=1) & ~((self._mask > 0) & (mask > 0)).flatten(1).any(dim=1)
        for number, way in enumerate(self._ways):
            if self._led[number] or not shown[number]:
                continue
            self._mask[number] = mask[number]
            if is_other[number]:
                if len(way) <= self._most_frames and self._still_frames[number] >= STILL_FRAMES:
                    self._led[number] = deque(way[:: self._stride][::-1])
                self._ways[number] = []
        counts = zip(self._still_frames, (mask != self._last).flatten(1).any(dim=1).tolist(), strict=True)
        self._still_frames = [0 if is_new else count + 1 for count, is_new in counts]
        self._last = mask
        arrived, self._has_arrived = torch.tensor(self._has_arrived), [False for _ in self._has_arrived]
        return arrived

    def led(self, planned: Tensor) -> Tensor:
        """Return what is played in this step, (B, A): the way back where one is gone, else what is planned."""
        actions = planned.clone()
        for number, led in enumerate(self._led):
            if led:
                actions[number] = led.popleft()
                self._has_arrived[number] = not led
            elif len(self._ways[number]) <= self._most_frames:  # one more than is gone back says that it is too long
                self._ways[number].append(planned[number].clone())
        return actions
