"""The network behind a click: a window of the picture around it, and a mask of what was clicked on."""

import itertools

import torch
from torch import Tensor, nn

WINDOW_PX = 128
"""Side of the window [px] of a picture of `PICTURE_SIZE`: a block or a dig region is a third of it (kind: guess)."""

PICTURE_SIZE = (384, 512)
"""Height and width to which pictures are brought before the window is cut [px] (kind: as the simulator's shots)."""

CHANNELS = 5
"""Red, green and blue, and where the pixel lies in the whole picture: regions look otherwise far away."""

_WIDTHS = (16, 32, 64, 96)  # of the stages, each at half the resolution of the one before (kind: guess)


class ClickNetwork(nn.Module):
    """A U-Net (Ronneberger et al. 2015, fig. 1) whose mask has a quarter of the window's resolution.

    That is the resolution of the masks that policies see. The click is the middle of the window, so no channel has to
    tell it.
    """

    def __init__(self) -> None:
        super().__init__()
        stem, *widths = _WIDTHS
        self.stem = _convolution(CHANNELS, stem, stride=2)
        self.down = nn.ModuleList(
            nn.Sequential(_convolution(a, b, stride=2), _convolution(b, b)) for a, b in itertools.pairwise(_WIDTHS)
        )
        self.up = nn.ModuleList(_convolution(a + b, b) for a, b in itertools.pairwise(widths[::-1]))
        self.head = nn.Conv2d(widths[0], 1, kernel_size=1)

    def forward(self, windows: Tensor) -> Tensor:
        """Return logits (B, 1, S, S) of the mask in windows (B, 5, S, S) of values in [-1, 1]."""
        features, x = [], self.stem(windows)
        for stage in self.down:
            x = stage(x)
            features.append(x)
        for stage, finer in zip(self.up, features[-2::-1], strict=True):
            x = nn.functional.interpolate(x, size=finer.shape[-2:], mode="bilinear", align_corners=False)
            x = stage(torch.cat([x, finer], dim=1))
        logits = self.head(x)
        return nn.functional.interpolate(logits, size=windows.shape[-2:], mode="bilinear", align_corners=False)


def _convolution(inputs: int, outputs: int, *, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel_size=3, stride=stride, padding=1, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )
