"""One token that says what lies under the mask, and where to the pixel."""

import math

import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor, nn

TEMPERATURE = 10000  # ratio of the lowest to the highest frequency, as in LeRobot's ACTSinusoidalPositionEmbedding2d


class TargetToken(nn.Module):
    """Pool the main camera's features and position encodings under the target mask.

    Features exist per cell of the feature map: the token takes their mean, weighted by the mask's coverage of each
    cell. Position encodings are evaluated at every pixel of the mask, in the coordinates of the cells, so a target far
    smaller than a cell is placed to the pixel. A plain fourth channel must carry the target through the whole
    backbone; this token hands it to the transformer directly. An empty mask gives a learned token.
    """

    def __init__(self, dim_model: int) -> None:
        super().__init__()
        self.dim_model = dim_model
        # Attention adds position encodings to queries and keys only; values need the position in the content.
        self.position_proj = nn.Linear(dim_model, dim_model)
        self.feature_gain = nn.Parameter(torch.zeros(()))
        self.kind_embed = nn.Parameter(torch.zeros(dim_model))
        self.no_target_embed = nn.Parameter(torch.zeros(dim_model))
        nn.init.normal_(self.kind_embed, std=0.02)
        nn.init.normal_(self.no_target_embed, std=0.02)

    def forward(self, features: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """Return the token and its position encoding.

        Args:
            features: Projected feature map of the main camera, shape (B, D, h, w).
            mask: Target mask, 0 or 1, shape (B, 1, H, W).

        Returns:
            Token and position encoding, each (B, D); without a target `no_target_embed` and zeros.
        """
        cells = (features.shape[-2], features.shape[-1])
        coverage = F.adaptive_avg_pool2d(mask, cells)  # (B, 1, h, w)
        # The smallest mask, one pixel, covers far more than this of a cell.
        weights = coverage / coverage.sum(dim=(2, 3), keepdim=True).clamp_min(1e-9)
        content = (features * weights).sum(dim=(2, 3))  # (B, D)
        position = mean_position(mask, cells, self.dim_model)  # (B, D)
        has_target = mask.flatten(1).any(dim=1, keepdim=True)
        placed = self.position_proj(position) + self.kind_embed
        token = torch.where(has_target, self.feature_gain * content + placed, self.no_target_embed)
        return token, position


def mean_position(mask: Tensor, cells: tuple[int, int], dim: int) -> Tensor:
    """Return the mean position encoding of a mask's pixels.

    Half of an encoding depends on the row alone, half on the column alone, so the mean over pixels needs only the
    number of mask pixels in each row and in each column.

    Args:
        mask: Target mask, 0 or 1, shape (B, 1, H, W).
        cells: Rows and columns of the feature map.
        dim: Length of an encoding; the result is (B, dim), zeros for an empty mask.
    """
    pixels = mask[:, 0]
    count = pixels.sum(dim=(1, 2)).clamp_min(1)[:, None]  # (B, 1)
    rows = axis_encodings(cells[0], pixels.shape[1], dim // 2).to(mask)
    columns = axis_encodings(cells[1], pixels.shape[2], dim // 2).to(mask)
    return torch.cat([pixels.sum(dim=2) @ rows, pixels.sum(dim=1) @ columns], dim=1) / count


def axis_encodings(cell_count: int, pixel_count: int, dim: int) -> Tensor:
    """Return the sines and cosines of the pixel centres along one axis of a picture, shape (pixel_count, dim).

    At the centre of a cell this is LeRobot's encoding of that cell (`ACTSinusoidalPositionEmbedding2d`): with cells
    counted from 1, the angles are 2 pi cell / cell_count / TEMPERATURE^(2 i / dim), i = 0, 1, ... for each pair of
    sine and cosine.

    Args:
        cell_count: Cells of the feature map along this axis.
        pixel_count: Pixels of the picture along this axis; the cells share them evenly.
        dim: Length of an encoding, even.
    """
    cell = (torch.arange(pixel_count) + 0.5) * (cell_count / pixel_count) + 0.5  # pixel centres; first cell at 1
    frequency = TEMPERATURE ** (-2 * torch.arange(dim // 2) / dim)
    angle = 2 * math.pi / cell_count * cell[:, None] * frequency  # (pixel_count, dim / 2)
    return torch.stack([angle.sin(), angle.cos()], dim=-1).flatten(1)
