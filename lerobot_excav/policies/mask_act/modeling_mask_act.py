"""The policy of `--policy.type=mask_act`: loss, planning and the plans in progress."""

import copy
from pathlib import Path
from typing import Any, Self, override

import torch
import torch.nn.functional as F  # noqa: N812
from lerobot.configs import PreTrainedConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_STATE
from torch import Tensor

from lerobot_excav.errors import require_choice
from lerobot_excav.policies.mask_act.checkpoint import PROCESSORS, load_weights, require_processors
from lerobot_excav.policies.mask_act.command_changes import CommandChanges
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig, resolved
from lerobot_excav.policies.mask_act.framing import framed
from lerobot_excav.policies.mask_act.held_mask import HeldMask
from lerobot_excav.policies.mask_act.mask_shape import shaped
from lerobot_excav.policies.mask_act.mask_shift import shift_alone
from lerobot_excav.policies.mask_act.network import Demonstration, Latent, MaskACTNetwork
from lerobot_excav.policies.mask_act.pending_actions import ActionQueue, TemporalEnsembles
from lerobot_excav.policies.mask_act.picture_shift import shift_together
from lerobot_excav.policies.mask_act.target_watch import TargetWatch
from lerobot_excav.policies.mask_act.training_masks import TrainingMasks, require_statistics
from lerobot_excav.policies.mask_act.views import Batch, masked_views, pictures, target_mask
from lerobot_excav.policies.mask_act.way_back import WayBack


class MaskACTPolicy(ACTPolicy):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """ACT that acts on the place that a mask of its main camera points at.

    Batches hold, after the preprocessor:

    | key | content |
    |---|---|
    | `observation.images.*` | normalised RGB of each camera, (B, 3, H, W) |
    | `observation.images.target_mask` (`mask_key`) | target mask in [0, 1], not normalised, (B, 1 or 3, H, W) |
    | `observation.state` | normalised robot state, (B, S), if the policy has one |
    | `observation.environment_state` | normalised environment state, (B, E), if the policy has one |
    | `action`, `action_is_pad` | training only: (B, chunk_size, A), (B, chunk_size) |
    | `index`, `episode_index` | training only: (B,), the frames whose masks and commands are looked up |

    Actions are float32, also where `use_amp` computes them in fewer bits.

    Args:
        config: Settings, with the features of dataset or environment.
        **kwargs: What LeRobot passes to every policy. `dataset_meta`, if a policy is built for training, is the
            dataset whose masks `TrainingMasks` checks.

    Raises:
        ConfigurationError: The features do not fit, or the dataset's masks cannot be used.
    """

    config_class = MaskACTConfig
    name = "mask_act"

    def __init__(self, config: MaskACTConfig, **kwargs: Any) -> None:
        # Past ACTPolicy's own constructor, which would build stock ACT's network.
        super(ACTPolicy, self).__init__(config)
        config.validate_features()
        self.config = config
        meta = kwargs.get("dataset_meta")
        if meta is not None:
            require_statistics(config, meta)
        self._training_masks = TrainingMasks(config, meta)
        self._command_changes = CommandChanges(meta)
        self.model = MaskACTNetwork(config)
        self._held = HeldMask(config.hold_mask_frames)
        self._watch = TargetWatch(config.replan_iou)
        self._way_back = WayBack(config.backtrack_frames, config.backtrack_stride)
        # LeRobot's `drop_queued_actions` clears what has this name.
        self._action_queue = (
            ActionQueue(resolved(config.n_action_steps))
            if config.temporal_ensemble_coeff is None
            else TemporalEnsembles(config.temporal_ensemble_coeff, config.chunk_size)
        )

    @classmethod
    def from_pretrained(
        cls, pretrained_name_or_path: str | Path, *, config: MaskACTConfig | None = None, **kwargs: Any
    ) -> Self:
        """Load a policy as LeRobot does, strictly, and without fetching the weights its backbone once started from.

        Raises:
            ConfigurationError: Weights are missing, left over, misshaped or not finite, or the processors beside them
                are damaged.
        """
        if config is None:
            hub = {key: value for key, value in kwargs.items() if key != "strict"}
            config = PreTrainedConfig.from_pretrained(pretrained_name_or_path, **hub)
        if config.pretrained_path is None:
            config = copy.copy(config)
            config.pretrained_path = Path(pretrained_name_or_path)
        folder = Path(pretrained_name_or_path)
        # LeRobot names what is missing if none is there, as beside a policy that was saved alone.
        if any((folder / name).exists() for name in PROCESSORS):
            require_processors(folder)
        policy: Self = super().from_pretrained(pretrained_name_or_path, config=config, **kwargs)
        return policy

    @classmethod
    @override
    def _load_as_safetensor(cls, model: Self, model_file: str, map_location: str, strict: bool) -> Self:
        # LeRobot asks for no strictness: a policy would act on random weights in place of missing ones.
        load_weights(model, Path(model_file))
        return model

    def reset(self) -> None:
        """Forget plans and targets; call it whenever the environments are reset."""
        self._held.clear()
        self._watch.clear()
        self._way_back.clear()
        self._action_queue.clear()

    def forward(self, batch: Batch, reduction: str = "mean") -> tuple[Tensor, dict[str, float]]:
        """Return the training loss: mean absolute error, plus `kl_weight` times the latent's divergence.

        Args:
            batch: Observations and demonstrated actions; left as it is.
            reduction: "mean" over the batch (over all actions inside their episodes, as in ACT), or "none" for one
                loss per sample, which `--sample_weighting` asks for.

        Returns:
            Loss, a scalar or shape (B,), and its parts for the log.

        Raises:
            ConfigurationError: Unknown reduction, observations that do not fit the policy, or a mask that is not the
                one that the dataset holds.
        """
        require_choice("reduction", reduction, ("mean", "none"))
        # Other batches may be of another dataset, with frames of the same numbers.
        is_pad = self._command_changes.is_pad(batch) if self.training else batch["action_is_pad"]
        demonstration = Demonstration(batch[ACTION], is_pad)
        mask = target_mask(self.config, batch, is_training=True)
        if self.training:
            self._training_masks.check(batch, mask)
            batch, mask = self._augmented(batch, mask)
        actions, latent = self._run(batch, mask, demonstration if self.training else None)
        error = F.l1_loss(actions, demonstration.actions, reduction="none").mean(dim=-1)  # (B, chunk_size)
        valid = ~demonstration.is_pad
        over = (0, 1) if reduction == "mean" else 1
        loss = (error * valid).sum(dim=over) / valid.sum(dim=over).clamp_min(1)
        parts = {"l1_loss": loss.mean().item()}
        if latent is not None:
            divergence = latent.kl_divergence()
            parts["kld_loss"] = divergence.mean().item()
            loss = loss + self.config.kl_weight * (divergence.mean() if reduction == "mean" else divergence)
        return loss, parts

    @torch.no_grad()
    def predict_action_chunk(self, batch: Batch, **kwargs: Any) -> Tensor:
        """Return a plan for each environment: normalised actions, float32, shape (B, chunk_size, A).

        Raises:
            ConfigurationError: The observations do not fit the policy, or the mask is not binary.
        """
        self.eval()
        return self._run(batch, target_mask(self.config, batch), None)[0].float()

    @torch.no_grad()
    def select_action(self, batch: Batch, **kwargs: Any) -> Tensor:
        """Return the next action of each environment, float32, shape (B, A), normalised.

        An environment gets a new plan when its plan has run out, or when its mask shows another target than the plan's
        (`replan_iou`). The other environments keep their plans. An empty mask is replaced by the last one that was not
        (`hold_mask_frames`). With `backtrack_frames`, one whose mask shows another target goes back the way it has come
        before that.

        Args:
            batch: Observations of all environments.
            **kwargs: Accepted for LeRobot's interface, without effect.

        Raises:
            ConfigurationError: The observations do not fit the policy, the mask is not binary, or the number of
                environments changed without `reset`.
        """
        self.eval()
        mask = self._held.filled(target_mask(self.config, batch))
        batch = {**batch, self.config.mask_key: mask}
        changed = self._watch.changed(mask)
        if not self.config.backtrack_frames:
            return self._planned(batch, changed)
        arrived = self._way_back.look(mask).to(changed.device)
        changed = (changed & ~self._way_back.is_leading.to(changed.device)) | arrived
        return self._way_back.led(self._planned(batch, changed))

    def _planned(self, batch: Batch, changed: Tensor) -> Tensor:
        """Return the next action of each environment's plan, a new one where its target has `changed`."""
        mask: Tensor = batch[self.config.mask_key]
        if isinstance(self._action_queue, TemporalEnsembles):
            self._watch.planned(torch.ones_like(changed), mask)
            return self._action_queue.update(self.predict_action_chunk(batch), changed)
        stale = self._action_queue.stale(changed)
        if stale.any():
            self._watch.planned(stale, mask)
            self._action_queue.put(stale, self.predict_action_chunk(rows(batch, stale)))
        return self._action_queue.pop()

    def _augmented(self, batch: Batch, mask: Tensor) -> tuple[Batch, Tensor]:
        """Return batch and mask for one training step, by the `augment_...` settings."""
        if shift_px := self.config.augment_shift_px:
            main = self.config.main_camera_key
            picture, mask = shift_together(batch[main], mask, shift_px)
            batch = {**batch, main: picture}
        if mask_px := self.config.augment_mask_px:
            mask = shift_alone(mask, mask_px, self.config.crop)
        return batch, mask

    def _run(self, batch: Batch, mask: Tensor, demonstration: Demonstration | None) -> tuple[Tensor, Latent | None]:
        config = self.config
        main = config.camera_keys.index(config.main_camera_key)
        rgb, mask = framed(pictures(config, batch), mask, main=main, crop=config.crop, resize_to=config.resize_to)
        mask = shaped(mask, config.mask_shape)
        plan: tuple[Tensor, Latent | None] = self.model(
            masked_views(rgb, mask, main),
            mask,
            state=batch[OBS_STATE] if self.config.robot_state_feature else None,
            env_state=batch[OBS_ENV_STATE] if self.config.env_state_feature else None,
            demonstration=demonstration,
        )
        return plan


def rows(batch: Batch, chosen: Tensor) -> Batch:
    """Return a new batch with the observation tensors of the chosen environments, bool (B,)."""
    tensors = {key: value for key, value in batch.items() if isinstance(value, Tensor)}
    return {key: value[chosen] for key, value in tensors.items() if key.startswith("observation.")}
