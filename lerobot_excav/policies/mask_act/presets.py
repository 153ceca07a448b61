"""Named sets of network and training settings.

A preset fills the fields of `MaskACTConfig` that were left at None. A value that is set by hand wins.
"""

from typing import Any

PAPER: dict[str, Any] = {
    # LeRobot's ACT, setting by setting (arXiv:2304.13705, table III). The original code asks for 7 decoder layers but
    # runs one; LeRobot's single layer is that network.
    "vision_backbone": "resnet18",
    "dim_model": 512,
    "dim_feedforward": 3200,
    "n_encoder_layers": 4,
    "pre_norm": False,
    "dropout": 0.1,
    "use_vae": True,
    "actions_per_token": 1,
    "optimizer_lr": 1e-5,
    "optimizer_lr_backbone": 1e-5,
    "lr_schedule": "constant",
    "lr_warmup_steps": 0,
}

FAST: dict[str, Any] = {
    # Stage widths 32, 64, 128 at stride 16: 48 tokens for a view of 96 x 128, where resnet18 gives 12.
    "vision_backbone": "resnet_small",
    # ACT's feed-forward layers hold three quarters of the encoder's weights and of its time.
    "dim_model": 256,
    "dim_feedforward": 512,
    "n_encoder_layers": 3,
    # Normalising before each block is the usual companion of a larger learning rate; the alternative was not tried.
    "pre_norm": True,
    # Small demonstration sets are fitted in few epochs; dropout only lengthens that.
    "dropout": 0.0,
    # The action encoder reads chunk_size + 2 tokens, more than the pictures; and its latent can carry the target's
    # identity in training, where it is zero at run time.
    "use_vae": False,
    # 25 queries for a chunk of 100.
    "actions_per_token": 4,
    "optimizer_lr": 3e-4,
    "optimizer_lr_backbone": 3e-4,
    "lr_schedule": "cosine",
    "lr_warmup_steps": 200,
}

PRESETS: dict[str, dict[str, Any]] = {"paper": PAPER, "fast": FAST}
DEFAULT_PRESET = "paper"


def differences(settings: Any, preset: str) -> dict[str, Any]:
    """Return the settings that a preset would decide and that have another value, by name."""
    values = {name: getattr(settings, name) for name in PRESETS[preset]}
    return {name: value for name, value in values.items() if value not in (None, PRESETS[preset][name])}
