"""Settings of `--policy.type=mask_act`."""

from dataclasses import dataclass
from typing import Any

from lerobot.configs import PreTrainedConfig
from lerobot.optim import AdamWConfig, LRSchedulerConfig
from lerobot.optim.schedulers import ConstantWithWarmupSchedulerConfig, CosineAnnealingWithWarmupSchedulerConfig
from lerobot.policies.act.configuration_act import ACTConfig

from lerobot_excav.errors import ConfigurationError, require, require_choice
from lerobot_excav.policies.mask_act.fused_adamw import FusedAdamWConfig
from lerobot_excav.policies.mask_act.presets import PRESETS

TARGET_MASK_KEY = "observation.images.target_mask"


def resolved[T](value: T | None) -> T:
    """Return a setting that `MaskACTConfig` has filled in; None means the configuration was tampered with."""
    if value is None:
        raise ConfigurationError("a setting of mask_act is None; build a new configuration from a preset.")
    return value


@PreTrainedConfig.register_subclass("mask_act")
@dataclass
class MaskACTConfig(ACTConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Configure ACT with a target mask as the fourth channel of its main camera.

    Fields that ACT has keep ACT's meaning. A field whose default is None is filled by `preset` (or by the rule given
    here) when the configuration is built, and a checkpoint stores the filled value.

    Args:
        preset: "paper" is LeRobot's ACT; "fast" trains many times faster on a CPU. See `presets`.
        preset_applied: The preset that filled this configuration; written by it, never by hand.
        mask_key: Image feature that holds the target mask, {0, 255}, registered with the main camera.
        main_camera: Image feature that the mask belongs to. None: the first camera that is not the mask.
        withhold_mask: Silence every path of the mask: the no-condition variant.
        target_token: Add one token pooled under the mask to the transformer encoder.
        coordinate_channels: Show the backbone the row and column of every pixel, as two more channels.
        vision_backbone: "resnet_small", or a ResNet of torchvision ("resnet18", "resnet34", ...).
        pretrained_backbone_weights: torchvision weights to start from. None, the default, downloads nothing.
        backbone_norm: "batch" learns and averages batch statistics, "frozen" is ACT's fixed affine map. None:
            "frozen" with pretrained weights, else "batch", which a backbone trained from scratch needs.
        actions_per_token: Consecutive actions that one decoder query predicts; divides `chunk_size`.
        n_action_steps: Actions executed before the next plan. None: all of `chunk_size`, or one with
            temporal ensembling.
        lr_schedule: "constant", or "cosine": decay to zero over the training run.
        lr_warmup_steps: Steps over which the learning rate rises from zero.
        optimizer_fused: Update the parameters with PyTorch's fused AdamW.

    Raises:
        ConfigurationError: A setting has a value that cannot be used, or two settings contradict each other.
    """

    preset: str = "paper"
    preset_applied: str | None = None

    mask_key: str = TARGET_MASK_KEY
    main_camera: str | None = None
    withhold_mask: bool = False
    target_token: bool = False
    coordinate_channels: bool = False

    vision_backbone: str | None = None
    pretrained_backbone_weights: str | None = None
    backbone_norm: str | None = None
    dim_model: int | None = None
    dim_feedforward: int | None = None
    n_encoder_layers: int | None = None
    pre_norm: bool | None = None
    dropout: float | None = None
    use_vae: bool | None = None
    actions_per_token: int | None = None
    n_action_steps: int | None = None

    optimizer_lr: float | None = None
    optimizer_lr_backbone: float | None = None
    optimizer_fused: bool = True
    lr_schedule: str | None = None
    lr_warmup_steps: int | None = None

    def __post_init__(self) -> None:
        """Fill what the preset decides, then check every field."""
        self._apply_preset()
        self._apply_rules()
        self._check_network()
        self._check_training()
        super().__post_init__()

    def _apply_rules(self) -> None:
        if self.n_action_steps is None:
            self.n_action_steps = 1 if self.temporal_ensemble_coeff is not None else self.chunk_size
        if self.backbone_norm is None:
            self.backbone_norm = "batch" if self.pretrained_backbone_weights is None else "frozen"

    def _apply_preset(self) -> None:
        require_choice("preset", self.preset, PRESETS)
        require(
            self.preset_applied in (None, self.preset),
            f"preset={self.preset!r} cannot change a configuration that preset={self.preset_applied!r} has filled: "
            "a checkpoint keeps its network. Set single fields instead (for example --policy.optimizer_lr=1e-4), or "
            "start from --policy.type=mask_act.",
        )
        for name, value in PRESETS[self.preset].items():
            if getattr(self, name) is None:
                setattr(self, name, value)
        self.preset_applied = self.preset

    def _check_network(self) -> None:
        k, chunk = resolved(self.actions_per_token), self.chunk_size
        require(
            k >= 1 and chunk % k == 0,
            f"actions_per_token={k} must divide chunk_size={chunk}; allowed: "
            f"{', '.join(str(d) for d in range(1, chunk + 1) if chunk % d == 0)}.",
        )
        steps = resolved(self.n_action_steps)
        require(1 <= steps <= chunk, f"n_action_steps={steps} must lie between 1 and chunk_size={chunk}, inclusive.")
        require(
            self.temporal_ensemble_coeff is None or steps == 1,
            f"n_action_steps={steps} must be 1 with temporal_ensemble_coeff={self.temporal_ensemble_coeff}: an "
            "ensemble needs a plan at every step. Leave n_action_steps unset or set it to 1.",
        )
        dim = resolved(self.dim_model)
        require(
            dim % self.n_heads == 0 and dim % 4 == 0,
            f"dim_model={dim} must be a multiple of n_heads={self.n_heads} and of 4 (sines and cosines of two axes).",
        )
        require_choice("backbone_norm", self.backbone_norm, ("batch", "frozen"))
        backbone = resolved(self.vision_backbone)
        require(
            backbone.startswith("resnet"),
            f"vision_backbone={backbone!r} is not a ResNet; allowed: resnet_small, resnet18, resnet34, resnet50, ...",
        )
        require(
            backbone != "resnet_small" or self.pretrained_backbone_weights is None,
            f"pretrained_backbone_weights={self.pretrained_backbone_weights!r} do not exist for "
            "vision_backbone='resnet_small'; set them to null or use resnet18.",
        )
        require(
            backbone != "resnet_small" or not self.replace_final_stride_with_dilation,
            "replace_final_stride_with_dilation has no meaning for vision_backbone='resnet_small', whose stride is "
            "16 already; set it to false.",
        )

    def _check_training(self) -> None:
        require_choice("lr_schedule", self.lr_schedule, ("constant", "cosine"))
        warmup = resolved(self.lr_warmup_steps)
        require(warmup >= 0, f"lr_warmup_steps={warmup} must not be negative; 0 starts at the full rate.")
        for name in ("optimizer_lr", "optimizer_lr_backbone"):
            rate = getattr(self, name)
            require(rate > 0, f"{name}={rate} must be positive.")
        rate = resolved(self.dropout)
        require(0 <= rate < 1, f"dropout={rate} must lie in [0, 1).")

    @property
    def camera_keys(self) -> list[str]:
        """Image features that are cameras, in the order of the network's tokens: all but the mask."""
        return [key for key in self.image_features if key != self.mask_key]

    @property
    def main_camera_key(self) -> str:
        """Image feature that the mask is joined to."""
        return self.main_camera if self.main_camera is not None else self.camera_keys[0]

    def validate_features(self) -> None:
        """Check the image features against each other.

        A missing mask is accepted here, because LeRobot also builds policies for features that are not final.
        `set_dataset_feature_metadata` refuses a dataset without a mask, `views` refuses such a batch.

        Raises:
            ConfigurationError: No camera, an unknown main camera, a camera that is not RGB, or a mask whose size is
                not that of the main camera.
        """
        cameras = self.camera_keys
        require(bool(cameras), f"mask_act needs a camera; its image features are {sorted(self.image_features)}.")
        require(
            self.main_camera_key != self.mask_key,
            f"main_camera={self.main_camera!r} is the mask itself (mask_key); allowed: {', '.join(cameras)}.",
        )
        require_choice("main_camera", self.main_camera_key, cameras, hint="Set --policy.main_camera.")
        for key in cameras:
            shape = tuple(self.image_features[key].shape)
            require(
                shape[0] == 3,
                f"{key} has {shape[0]} channel(s), shape {shape}; mask_act reads RGB cameras. Leave it out of "
                "--policy.input_features.",
            )
        mask = self.image_features.get(self.mask_key)
        if mask is not None:
            main_shape = tuple(self.image_features[self.main_camera_key].shape)
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


MISSING_MASK_HINT = (
    "Record or generate demonstrations with the target mask (`lerobot-excav demos` writes it), name another feature "
    "with --policy.mask_key, or train the no-condition variant with --policy.withhold_mask=true."
)


def require_mask_shape(mask_key: str, mask_shape: tuple[int, ...], main_key: str, main_shape: tuple[int, ...]) -> None:
    """Raise `ConfigurationError` unless the shape of a mask fits its camera: ([B,] 1 or 3, H, W) to ([B,] 3, H, W)."""
    *batch, _, height, width = main_shape
    allowed = [(*batch, channels, height, width) for channels in (1, 3)]
    require(
        mask_shape in allowed,
        f"{mask_key} has shape {mask_shape}, {main_key} has shape {main_shape}; a mask marks pixels of its camera, so "
        f"its shape must be {allowed[0]} or {allowed[1]} (channels, height, width). Render both at one size, or set "
        "--policy.main_camera to the camera that the mask belongs to.",
    )
