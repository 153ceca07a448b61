"""One token that says what lies under the mask, and where."""

import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor, nn

EMPTY_COVERAGE = 1e-6  # share of a feature cell; below it a mask counts as empty


class TargetToken(nn.Module):
    """Pool the main camera's features and position encodings under the target mask.

    The mask is averaged over each cell of the feature map; the token is the mean of the cells weighted by that
    coverage. A plain fourth channel must carry the target through the whole backbone; this token hands it to the
    transformer directly, at sub-cell resolution. An empty mask gives a learned token.
    """

    def __init__(self, dim_model: int) -> None:
        super().__init__()
        # Attention adds position encodings to queries and keys only; values need the position in the content.
        self.position_proj = nn.Linear(dim_model, dim_model)
        self.kind_embed = nn.Parameter(torch.zeros(dim_model))
        self.no_target_embed = nn.Parameter(torch.zeros(dim_model))
        nn.init.normal_(self.kind_embed, std=0.02)
        nn.init.normal_(self.no_target_embed, std=0.02)

    def forward(self, features: Tensor, pos_embed: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """Return the token and its position encoding.

        Args:
            features: Projected feature map of the main camera, shape (B, D, h, w).
            pos_embed: Position encodings of its cells, shape (1, D, h, w).
            mask: Target mask, 0 or 1, shape (B, 1, H, W).

        Returns:
            Token and position encoding, each (B, D); without a target `no_target_embed` and zeros.
        """
        coverage = F.adaptive_avg_pool2d(mask, (features.shape[-2], features.shape[-1]))  # (B, 1, h, w)
        total = coverage.sum(dim=(2, 3))  # (B, 1)
        weights = coverage / total.clamp_min(EMPTY_COVERAGE)[..., None, None]
        content = (features * weights).sum(dim=(2, 3))  # (B, D)
        position = (pos_embed * weights).sum(dim=(2, 3))  # (B, D)
        has_target = total > EMPTY_COVERAGE
        token = torch.where(
            has_target, content + self.position_proj(position) + self.kind_embed, self.no_target_embed
        )
        return token, torch.where(has_target, position, torch.zeros_like(position))
