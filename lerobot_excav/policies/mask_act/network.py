"""The network of `mask_act`."""

from itertools import chain
from typing import NamedTuple

import torch
from lerobot.policies.act.modeling_act import ACTDecoder, ACTEncoder, ACTSinusoidalPositionEmbedding2d
from torch import Tensor, nn

from lerobot_excav.policies.mask_act.action_encoder import ActionEncoder
from lerobot_excav.policies.mask_act.backbone import Backbone
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig, resolved
from lerobot_excav.policies.mask_act.target_token import TargetToken


class Demonstration(NamedTuple):
    """Normalised actions, (B, chunk_size, A), and where they lie beyond their episode, (B, chunk_size)."""

    actions: Tensor
    is_pad: Tensor


class Latent(NamedTuple):
    """Gaussian latent of a demonstration: mean and log variance, each (B, latent_dim)."""

    mean: Tensor
    log_variance: Tensor

    def sample(self) -> Tensor:
        """Draw one latent per row, differentiable in mean and variance."""
        return self.mean + (self.log_variance / 2).exp() * torch.randn_like(self.mean)

    def kl_divergence(self) -> Tensor:
        """Return the divergence from the standard normal, shape (B,) (Kingma and Welling 2014, appendix B)."""
        terms = 1 + self.log_variance - self.mean.square() - self.log_variance.exp()
        return -0.5 * terms.sum(dim=-1)


class MaskACTNetwork(nn.Module):
    """Action chunking transformer over four-channel views.

        main RGB + mask ─┐                                          decoder queries, one per
        cab RGB + zeros ─┴► backbone ► 1x1 conv ─► image tokens ─┐  `actions_per_token` actions
                                │                                │             │
        mask ───────────────────┴─► target token (optional) ─────┤             ▼
        state ──────────────────────► linear ─► state token ─────┼─► encoder ► decoder ► linear ► actions
        demonstrated actions ► action encoder ► latent token ────┘
        (training with use_vae; else zeros)

    Tokens of the encoder, in this order:

    | token | count | position encoding |
    |---|---|---|
    | latent | 1 | learned |
    | state (`observation.state`) | 0 or 1 | learned |
    | environment state | 0 or 1 | learned |
    | cells of each camera's feature map, row by row | h w per camera | 2-D sines and cosines |
    | target | 0 or 1 | mean of the 2-D sines and cosines over the pixels of the mask |

    The transformer layers are LeRobot's own. Differences from its ACT: four input channels; all views of one size
    pass the backbone as one batch, so batch statistics are taken over all cameras; several actions per decoder query.
    """

    def __init__(self, config: MaskACTConfig) -> None:
        super().__init__()
        dim = resolved(config.dim_model)
        self.latent_dim = config.latent_dim
        self.main_index = config.camera_keys.index(config.main_camera_key)
        self.action_encoder = ActionEncoder(config) if config.use_vae else None

        self.backbone = Backbone(config)
        self.image_proj = nn.Conv2d(self.backbone.feature_count, dim, kernel_size=1)
        self.image_pos_embed = ACTSinusoidalPositionEmbedding2d(dim // 2)
        self.target_token = TargetToken(dim) if config.target_token else None

        state, env_state = config.robot_state_feature, config.env_state_feature
        self.latent_proj = nn.Linear(config.latent_dim, dim)
        self.state_proj = nn.Linear(state.shape[0], dim) if state is not None else None
        self.env_state_proj = nn.Linear(env_state.shape[0], dim) if env_state is not None else None
        vector_count = 1 + (state is not None) + (env_state is not None)
        self.vector_pos_embed = nn.Embedding(vector_count, dim)

        self.encoder = ACTEncoder(config)
        self.decoder = ACTDecoder(config)
        per_token = resolved(config.actions_per_token)
        self.action_shape = (config.chunk_size, config.action_feature.shape[0])
        self.query_embed = nn.Embedding(config.chunk_size // per_token, dim)
        self.action_head = nn.Linear(dim, per_token * self.action_shape[1])
        for parameter in chain(self.encoder.parameters(), self.decoder.parameters()):
            if parameter.dim() > 1:
                nn.init.xavier_uniform_(parameter)

    def forward(
        self,
        views: list[Tensor],
        mask: Tensor,
        *,
        state: Tensor | None = None,
        env_state: Tensor | None = None,
        demonstration: Demonstration | None = None,
    ) -> tuple[Tensor, Latent | None]:
        """Predict a chunk of actions.

        Args:
            views: One (B, 4, H, W) tensor per camera: normalised RGB, and the mask or zeros.
            mask: Target mask, 0 or 1, shape (B, 1, H, W).
            state: Normalised robot state, shape (B, S).
            env_state: Normalised environment state, shape (B, E).
            demonstration: Actions to encode into the latent; None leaves the latent at zero.

        Returns:
            Normalised actions, shape (B, chunk_size, A), and the latent of the demonstration, if there is one.
        """
        latent = None
        if self.action_encoder is not None and demonstration is not None:
            latent = Latent(*self.action_encoder(*demonstration, state))
        batch_size = views[0].shape[0]
        z = latent.sample() if latent is not None else views[0].new_zeros(batch_size, self.latent_dim)
        tokens, pos_embed = self._tokens(views, mask, z, state, env_state)
        encoded = self.encoder(tokens, pos_embed=pos_embed)
        queries = self.query_embed.weight.unsqueeze(1)  # (queries, 1, D)
        decoded = self.decoder(
            torch.zeros_like(queries).expand(-1, batch_size, -1),
            encoded,
            encoder_pos_embed=pos_embed,
            decoder_pos_embed=queries,
        )
        actions = self.action_head(decoded.transpose(0, 1))  # (B, queries, actions_per_token * A)
        return actions.reshape(batch_size, *self.action_shape), latent

    def _tokens(
        self, views: list[Tensor], mask: Tensor, z: Tensor, state: Tensor | None, env_state: Tensor | None
    ) -> tuple[Tensor, Tensor]:
        """Return tokens and position encodings, each (sequence, B, D) (encodings of batch size 1 if equal)."""
        vectors = [self.latent_proj(z)]
        if self.state_proj is not None:
            vectors.append(self.state_proj(state))
        if self.env_state_proj is not None:
            vectors.append(self.env_state_proj(env_state))
        tokens, pos_embeds = [torch.stack(vectors)], [self.vector_pos_embed.weight.unsqueeze(1)]

        maps = self._feature_maps(views)
        grids = [self.image_pos_embed(feature_map) for feature_map in maps]
        tokens += [feature_map.flatten(2).permute(2, 0, 1) for feature_map in maps]
        pos_embeds += [grid.flatten(2).permute(2, 0, 1) for grid in grids]

        if self.target_token is not None:
            token, position = self.target_token(maps[self.main_index], mask)
            tokens.append(token.unsqueeze(0))
            pos_embeds = [pos_embed.expand(-1, mask.shape[0], -1) for pos_embed in pos_embeds]
            pos_embeds.append(position.unsqueeze(0))
        return torch.cat(tokens), torch.cat(pos_embeds)

    def _feature_maps(self, views: list[Tensor]) -> list[Tensor]:
        """Return the projected feature map, (B, D, h, w), of each view."""
        if len({view.shape for view in views}) == 1:
            return list(self.image_proj(self.backbone(torch.cat(views))).chunk(len(views)))
        return [self.image_proj(self.backbone(view)) for view in views]
