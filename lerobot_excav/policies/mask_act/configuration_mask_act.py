"""Settings of `--policy.type=mask_act`."""

import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from lerobot.configs import NormalizationMode, PreTrainedConfig
from lerobot.optim import AdamWConfig, LRSchedulerConfig
from lerobot.optim.schedulers import ConstantWithWarmupSchedulerConfig, CosineAnnealingWithWarmupSchedulerConfig
from lerobot.policies.act.configuration_act import ACTConfig

from lerobot_excav.errors import ConfigurationError, require, require_choice
from lerobot_excav.policies.mask_act.backbone_weights import known_weights
from lerobot_excav.policies.mask_act.features import (
    MISSING_MASK_HINT,
    NORMALISED,
    check_features,
    check_normalization,
    require_mask_shape,
    require_rgb,
    require_shown,
    require_way_back,
)
from lerobot_excav.policies.mask_act.framing import require_framing
from lerobot_excav.policies.mask_act.fused_adamw import FusedAdamWConfig
from lerobot_excav.policies.mask_act.mask_input import MAIN_CAMERA_KEY, TARGET_MASK_KEY, MaskInput
from lerobot_excav.policies.mask_act.mask_shape import MASK_SHAPES
from lerobot_excav.policies.mask_act.presets import DEFAULT_PRESET, PRESETS, differences
from lerobot_excav.setting import check_settings, setting

BACKBONES = ("resnet_small", "resnet18", "resnet34", "resnet50", "resnet101", "resnet152")
_UNDILATED = BACKBONES[:3]  # have no dilated last stage
_GREATEST_EXPONENT = 80  # exp of it, times an action, is still a number in single precision


def resolved[T](value: T | None) -> T:
    """Return a setting that `MaskACTConfig` has filled in; None means the configuration was tampered with."""
    if value is None:
        raise ConfigurationError("a setting of mask_act is None; build a new configuration from a preset.")
    return value


@PreTrainedConfig.register_subclass("mask_act")
@dataclass
class MaskACTConfig(MaskInput, ACTConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Configure ACT with a target mask as the fourth channel of its main camera.

    Fields that ACT has keep ACT's meaning. A field whose default is None is filled by `preset` (or by the rule given
    with it) when the configuration is built, and a checkpoint stores the filled value.

    Raises:
        ConfigurationError: A setting has a value that cannot be used, or two settings contradict each other.
    """

    preset: str | None = setting(
        f"Fills the settings that are not given: paper is LeRobot's ACT, fast trains many times faster on a CPU; left "
        f"out: {DEFAULT_PRESET}",
        default=None,
        choices=tuple(PRESETS),
    )
    preset_applied: str | None = setting(
        "The preset that has filled them; a checkpoint says it, nobody gives it", default=None, choices=tuple(PRESETS)
    )

    chunk_size: int = setting("Actions of a plan [frames]", default=100, low=1, high=10_000)
    n_action_steps: int | None = setting(
        "Actions executed per plan [frames]; left out: the whole chunk, or 1 with temporal_ensemble_coeff",
        default=None,
        low=1,
        high=10_000,
    )
    actions_per_token: int | None = setting(
        "Consecutive actions that one decoder query predicts; divides chunk_size", default=None, low=1, high=10_000
    )
    temporal_ensemble_coeff: float | None = setting(
        "Average all plans for a moment: the i-th oldest weighs exp(-coefficient i); left out: no averaging",
        default=None,
        low=-10.0,
        high=10.0,
        hint="ACT's is 0.01.",
    )
    backtrack_frames: int = setting(
        "When the mask shows another target within so many frames of the last one, play the actions of these frames "
        "backwards, and plan from there: for actions that are positions, and a policy that has seen no changes of "
        "mind; 0 never goes back [frames]",
        default=0,
        low=0,
        high=10_000,
    )
    backtrack_stride: int = setting(
        "Play one in so many actions of the way back, which makes it so many times as fast", default=1, low=1, high=100
    )
    n_obs_steps: int = setting("Frames that the policy sees at a time", default=1, choices=(1,))

    vision_backbone: str | None = setting("Convolutional network of the pictures", default=None, choices=BACKBONES)
    pretrained_backbone_weights: str | None = setting(
        "Weights of torchvision to start from, such as ResNet18_Weights.IMAGENET1K_V1; left out: random, no download",
        default=None,
    )
    backbone_norm: str | None = setting(
        "batch learns and averages batch statistics, frozen is ACT's fixed map; left out: frozen with pretrained "
        "weights, else batch",
        default=None,
        choices=("batch", "frozen"),
    )
    replace_final_stride_with_dilation: bool | int = setting(
        "Dilate the backbone's last stage in place of its stride; resnet50 and deeper", default=False, choices=(0, 1)
    )
    dim_model: int | None = setting(
        "Width of the transformer; a multiple of n_heads and of 4", default=None, low=4, high=16_384
    )
    n_heads: int = setting("Heads of every attention", default=8, low=1, high=1024)
    dim_feedforward: int | None = setting("Width of the feed-forward layers", default=None, low=1, high=65_536)
    feedforward_activation: str = setting("Activation in them", default="relu", choices=("relu", "gelu"))
    n_encoder_layers: int | None = setting("Layers of the encoder", default=None, low=1, high=100)
    n_decoder_layers: int = setting("Layers of the decoder", default=1, low=1, high=100)
    pre_norm: bool | None = setting("Normalise before each block, not after it", default=None)
    dropout: float | None = setting("Share of activations dropped in training", default=None, low=0.0, below=1.0)

    use_vae: bool | None = setting("Encode demonstrated actions into a latent in training", default=None)
    latent_dim: int = setting("Width of that latent", default=32, low=1, high=16_384)
    n_vae_encoder_layers: int = setting("Layers of its encoder", default=4, low=1, high=100)
    kl_weight: float = setting("Weight of the latent's divergence in the loss", default=10.0, low=0.0, high=1e6)

    optimizer_lr: float | None = setting("Learning rate", default=None, above=0.0, high=1.0)
    optimizer_lr_backbone: float | None = setting("Learning rate of the backbone", default=None, above=0.0, high=1.0)
    optimizer_weight_decay: float = setting("Weight decay of AdamW", default=1e-4, low=0.0, high=10.0)
    optimizer_fused: bool = setting("Update by PyTorch's fused AdamW; the same formula in one pass", default=True)
    lr_schedule: str | None = setting(
        "Learning rate over the training: constant, or cosine to zero", default=None, choices=("constant", "cosine")
    )
    lr_warmup_steps: int | None = setting(
        "Steps over which the learning rate rises from zero", default=None, low=0, high=2**31 - 1
    )

    # LeRobot's own, for every policy; its features are checked as well.
    normalization_mapping: dict[str, NormalizationMode] = setting(
        "How each kind of feature is normalised",
        default_factory=lambda: dict.fromkeys(NORMALISED, NormalizationMode.MEAN_STD),
    )
    device: str | None = setting("cpu, cuda, cuda:0, mps or xpu; left out: the fastest there is", default=None)
    use_amp: bool = setting("Compute in mixed precision", default=False)
    use_peft: bool = setting("Whether an adapter of PEFT was trained", default=False)
    push_to_hub: bool = setting("Upload the trained policy", default=True)
    repo_id: str | None = setting("Repository to upload to, as user/name", default=None)
    private: bool | None = setting("Whether that repository is private", default=None)
    tags: list[str] | None = setting("Its tags on the Hub", default=None)
    license: str | None = setting("Its licence on the Hub", default=None)
    pretrained_path: Path | None = setting("Checkpoint to start from; --policy.path sets it", default=None)
    pretrained_revision: str | None = setting("Revision of that checkpoint on the Hub", default=None)

    def __post_init__(self) -> None:
        """Check every field, fill what the preset decides, then check fields against each other."""
        check_settings(self, "policy.")
        self.replace_final_stride_with_dilation = bool(self.replace_final_stride_with_dilation)
        self._check_names()
        self._apply_preset()
        self._apply_rules()
        self._check_plan()
        self._check_network()
        require_framing(self.crop, self.resize_to, None)
        super().__post_init__()

    def _check_names(self) -> None:
        for field in ("mask_key", "main_camera"):
            name = getattr(self, field)
            require(
                name is None or re.fullmatch(r"observation\.\S+", name) is not None,
                f"policy.{field}={name!r} is not possible; give an image feature, such as {TARGET_MASK_KEY}.",
            )
        require(
            self.device is None or re.fullmatch(r"cpu|mps|xpu|cuda(:\d{1,2})?", self.device) is not None,
            f"policy.device={self.device!r} is not possible; give cpu, cuda, cuda:0, mps or xpu.",
        )
        check_features("policy.input_features", self.input_features)
        check_features("policy.output_features", self.output_features)
        check_normalization("policy.normalization_mapping", self.normalization_mapping)

    def _apply_rules(self) -> None:
        if self.n_action_steps is None:
            self.n_action_steps = 1 if self.temporal_ensemble_coeff is not None else self.chunk_size
        if self.backbone_norm is None:
            self.backbone_norm = "batch" if self.pretrained_backbone_weights is None else "frozen"

    def _apply_preset(self) -> None:
        require(
            self.preset is None or self.preset_applied in (None, self.preset),
            f"policy.preset={self.preset!r} cannot change a configuration that preset={self.preset_applied!r} has "
            "filled: a checkpoint keeps its network. Set single fields instead (for example "
            "--policy.optimizer_lr=1e-4), or start from --policy.type=mask_act.",
        )
        name = self.preset or self.preset_applied or DEFAULT_PRESET
        is_left = any(getattr(self, field) is None for field in PRESETS[name] if field in _ACTS_OWN)
        if self.preset_applied is None and self.preset is not None and not is_left:
            other = differences(self, name)
            require(
                not other,
                f"policy.preset={name!r} has nothing left to decide: all that ACT has is given, and these otherwise "
                f"than in the preset: {', '.join(f'{key}={value!r}' for key, value in other.items())}. Leave out the "
                "preset, or what it should decide.",
            )
        for field, value in PRESETS[name].items():
            if getattr(self, field) is None:
                setattr(self, field, value)
        if is_left or self.preset is not None:
            self.preset = self.preset_applied = name

    def _check_plan(self) -> None:
        k, chunk = resolved(self.actions_per_token), self.chunk_size
        require(
            chunk % k == 0,
            f"policy.actions_per_token={k} must divide chunk_size={chunk}; allowed: "
            f"{', '.join(str(d) for d in range(1, chunk + 1) if chunk % d == 0)}.",
        )
        require_way_back(self.backtrack_frames, self.backtrack_stride, withheld=self.withhold_mask)
        steps, coefficient = resolved(self.n_action_steps), self.temporal_ensemble_coeff
        require(steps <= chunk, f"policy.n_action_steps={steps} is not possible; give 1 to chunk_size={chunk}.")
        require(
            coefficient is None or steps == 1,
            f"policy.n_action_steps={steps} must be 1 with temporal_ensemble_coeff={coefficient}: an "
            "ensemble needs a plan at every step. Leave n_action_steps unset or set it to 1.",
        )
        require(
            coefficient is None or -coefficient * (chunk - 1) <= _GREATEST_EXPONENT,
            f"policy.temporal_ensemble_coeff={coefficient} with chunk_size={chunk} weighs the newest plan beyond "
            f"single precision; give {-_GREATEST_EXPONENT / max(chunk - 1, 1):.3g} or more. ACT's is 0.01.",
        )

    def _check_network(self) -> None:
        dim = resolved(self.dim_model)
        require(
            dim % self.n_heads == 0 and dim % 4 == 0,
            f"policy.dim_model={dim} must be a multiple of n_heads={self.n_heads} and of 4 (sines and cosines of two "
            "axes).",
        )
        backbone, weights = resolved(self.vision_backbone), self.pretrained_backbone_weights
        require(
            backbone not in _UNDILATED or not self.replace_final_stride_with_dilation,
            f"policy.replace_final_stride_with_dilation=true does not exist for vision_backbone={backbone!r}; set it "
            f"to false, or use {', '.join(BACKBONES[len(_UNDILATED) :])}.",
        )
        require(
            weights is None or weights in known_weights(backbone),
            f"policy.pretrained_backbone_weights={weights!r} do not exist for vision_backbone={backbone!r}; allowed: "
            f"{', '.join(known_weights(backbone)) or 'none; set them to null or use resnet18'}.",
        )

    @property
    def camera_keys(self) -> list[str]:
        """Image features that are cameras, in the order of the network's tokens: all but the mask."""
        return [key for key in self.image_features if key != self.mask_key]

    @property
    def main_camera_key(self) -> str:
        """Image feature that the mask is joined to.

        Raises:
            ConfigurationError: Several cameras have the mask's size, and nothing says which it is.
        """
        cameras, mask = self.camera_keys, self.image_features.get(self.mask_key)
        if self.main_camera is not None:
            return self.main_camera
        if MAIN_CAMERA_KEY in cameras:
            return MAIN_CAMERA_KEY
        size = None if mask is None else tuple(mask.shape)[1:]
        fitting = [key for key in cameras if size in (None, tuple(self.image_features[key].shape)[1:])]
        require(
            len(fitting) < 2 or self.withhold_mask,
            f"policy.main_camera=None is not enough: the mask may belong to {' or '.join(fitting)}. Name the one that "
            f"it marks, for example --policy.main_camera={(fitting or cameras)[0]}.",
        )
        return (fitting or cameras)[0]

    def validate_features(self) -> None:
        """Check the image features against each other.

        A missing mask is accepted here, because LeRobot also builds policies for features that are not final.
        `set_dataset_feature_metadata` refuses a dataset without a mask, `views` refuses such a batch.

        Raises:
            ConfigurationError: No action, no camera, an unknown main camera or several that may be it, a camera that is
                not RGB, or a mask whose size is not that of the main camera.
        """
        cameras = self.camera_keys
        check_features("policy.input_features", self.input_features)
        check_features("policy.output_features", self.output_features)
        require(
            self.action_feature is not None,
            f"policy.output_features={sorted(self.output_features or {})} lacks 'action', which the policy predicts.",
        )
        require(bool(cameras), f"mask_act needs a camera; its image features are {sorted(self.image_features)}.")
        require(
            self.main_camera_key != self.mask_key,
            f"main_camera={self.main_camera!r} is the mask itself (mask_key); allowed: {', '.join(cameras)}.",
        )
        require_choice("main_camera", self.main_camera_key, cameras, hint="Set --policy.main_camera.")
        for key in cameras:
            require_rgb(key, tuple(self.image_features[key].shape))
        main_shape = tuple(self.image_features[self.main_camera_key].shape)
        for name in ("augment_shift_px", "augment_mask_px"):
            value = getattr(self, name)
            require(
                value < min(main_shape[1:]),
                f"policy.{name}={value} would move {self.main_camera_key} of shape {main_shape} "
                f"out of view; allowed: 0 to {min(main_shape[1:]) - 1}, and useful are a few pixels.",
            )
        if self.withhold_mask:
            # How masks are held and compared is left alone: a checkpoint that says so may be asked to act without one.
            changes = {"augment_mask_px": (self.augment_mask_px, 0), "mask_shape": (self.mask_shape, MASK_SHAPES[0])}
            require_shown(withheld="withhold_mask", **changes)
        if self.withhold_pictures:
            require_shown(withheld="withhold_pictures", augment_shift_px=(self.augment_shift_px, 0))
        require_framing(self.crop, self.resize_to, main_shape)
        mask = self.image_features.get(self.mask_key)
        if mask is not None:
            require_mask_shape(self.mask_key, tuple(mask.shape), self.main_camera_key, main_shape)

    def set_dataset_feature_metadata(self, features: dict[str, Any]) -> None:
        """Refuse a dataset without masks before anything is built; LeRobot calls this hook.

        A policy from a checkpoint is accepted: `--rename_map` may rename the features of its dataset, and this hook
        does not see that. `views` checks what arrives.

        Args:
            features: Feature descriptions of the dataset, `dtype` and `shape` among them.

        Raises:
            ConfigurationError: The dataset has no mask although the policy uses one.
        """
        images = sorted(key for key, ft in features.items() if ft["dtype"] in ("image", "video"))
        require(
            self.withhold_mask or self.pretrained_path is not None or self.mask_key in images,
            f"the dataset has no feature {self.mask_key!r}; its image features are {images}. {MISSING_MASK_HINT}",
        )

    def get_optimizer_preset(self) -> AdamWConfig:
        """Return AdamW, fused unless `optimizer_fused` is false."""
        kind = FusedAdamWConfig if self.optimizer_fused else AdamWConfig
        return kind(lr=self.optimizer_lr, weight_decay=self.optimizer_weight_decay)

    def get_scheduler_preset(self) -> LRSchedulerConfig | None:
        """Return the learning-rate schedule; None is a constant rate."""
        warmup = resolved(self.lr_warmup_steps)
        if self.lr_schedule == "cosine":
            return CosineAnnealingWithWarmupSchedulerConfig(num_warmup_steps=warmup)
        return ConstantWithWarmupSchedulerConfig(num_warmup_steps=warmup) if warmup else None


_ACTS_OWN = frozenset(field.name for field in fields(ACTConfig))
