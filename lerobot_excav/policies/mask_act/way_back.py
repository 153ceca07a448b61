"""The way that each environment has come since its target was shown, to be gone back when another one is."""

import torch
from torch import Tensor


class WayBack:
    """Leads an environment back along its own actions when its mask shows another target soon after the last one.

    A policy that has seen no change of mind knows the states on the way to one target, not those from there to another
    one. At the end of the way back it is where it began, and there it knows what to do. That holds for actions that are
    positions; rates in the opposite order lead elsewhere. A mask of which a part lies on the one before shows the same
    target, moved or seen better, and an empty one shows none.

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
        self._left: list[int] = []
        self._mask: Tensor | None = None

    @property
    def is_leading(self) -> Tensor:
        """Which environments are on their way back, bool (B,)."""
        return torch.tensor([left > 0 for left in self._left], dtype=torch.bool)

    def begin(self, mask: Tensor) -> dict[int, list[Tensor]]:
        """Return the actions back to the start, each (A,), by environment whose mask shows another target.

        They are to be played from now on, all of them; meanwhile masks, (B, 1, H, W), are not looked at.
        """
        if self._mask is None:
            self._mask = mask.clone()
            self._ways, self._left = [[] for _ in mask], [0] * len(mask)
        shown = mask.flatten(1).any(dim=1)
        is_other = shown & self._mask.flatten(1).any(dim=1) & ~((self._mask > 0) & (mask > 0)).flatten(1).any(dim=1)
        led = {}
        for number, way in enumerate(self._ways):
            if self._left[number] or not shown[number]:
                continue
            self._mask[number] = mask[number]
            if is_other[number]:
                self._ways[number] = []
                if 0 < len(way) <= self._most_frames:
                    led[number] = way[:: self._stride][::-1]
                    self._left[number] = len(led[number])
        return led

    def note(self, actions: Tensor) -> None:
        """Take down what is played in this step, (B, A)."""
        for number, action in enumerate(actions):
            if self._left[number]:
                self._left[number] -= 1
            elif len(self._ways[number]) <= self._most_frames:  # one more than is gone back says that it is too long
                self._ways[number].append(action.clone())
