"""The encoder half of ACT's conditional variational auto-encoder."""

import torch
from lerobot.policies.act.modeling_act import ACTEncoder, create_sinusoidal_pos_embedding
from torch import Tensor, nn

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig, resolved


class ActionEncoder(nn.Module):
    """Compress a demonstrated chunk of actions to the parameters of a Gaussian latent.

    Used in training only; tokens are [cls, (state), action 1 ... action chunk_size], the same as in LeRobot's ACT.
    """

    def __init__(self, config: MaskACTConfig) -> None:
        super().__init__()
        dim = resolved(config.dim_model)
        self.latent_dim = config.latent_dim
        self.encoder = ACTEncoder(config, is_vae_encoder=True)
        self.cls_embed = nn.Embedding(1, dim)
        state = config.robot_state_feature
        self.state_proj = nn.Linear(state.shape[0], dim) if state is not None else None
        self.action_proj = nn.Linear(config.action_feature.shape[0], dim)
        self.latent_proj = nn.Linear(dim, 2 * config.latent_dim)
        token_count = (2 if state is not None else 1) + config.chunk_size
        self.register_buffer("pos_embed", create_sinusoidal_pos_embedding(token_count, dim).unsqueeze(1))

    def forward(self, actions: Tensor, action_is_pad: Tensor, state: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return mean and log variance of the latent, each (B, latent_dim).

        Args:
            actions: Normalised demonstrated actions, shape (B, chunk_size, A).
            action_is_pad: True where an action lies beyond its episode, shape (B, chunk_size).
            state: Normalised robot state, shape (B, S), or None for a policy without one.
        """
        batch_size = actions.shape[0]
        head = [self.cls_embed.weight.expand(batch_size, 1, -1)]
        if self.state_proj is not None:
            head.append(self.state_proj(state).unsqueeze(1))
        tokens = torch.cat([*head, self.action_proj(actions)], dim=1).transpose(0, 1)  # (sequence, B, D)
        never_pad = action_is_pad.new_zeros(batch_size, len(head))
        out = self.encoder(
            tokens, pos_embed=self.pos_embed, key_padding_mask=torch.cat([never_pad, action_is_pad], dim=1)
        )
        mean, log_variance = self.latent_proj(out[0]).split(self.latent_dim, dim=-1)
        return mean, log_variance
