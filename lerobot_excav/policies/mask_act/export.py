"""Checkpoints to hand on: half precision, without what only training needs."""

import copy
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

import torch
from draccus.utils import DraccusException
from lerobot.configs import PreTrainedConfig
from safetensors import SafetensorError
from safetensors.torch import save_file
from torch import Tensor

from lerobot_excav.errors import ConfigurationError, require
from lerobot_excav.policies.mask_act.checkpoint import PROCESSORS, read_json, require_processors
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.model_card import CardFacts, model_card
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

WEIGHTS, CONFIG, CARD = "model.safetensors", "config.json", "README.md"
TRAINING_ONLY = "model.action_encoder."  # the encoder of the variational latent, which is zero at run time


def export_checkpoint(
    checkpoint: Path, out: Path, facts: CardFacts | None = None, *, beside: Mapping[str, str] | None = None
) -> Path:
    """Write a small copy of a trained policy that LeRobot loads like any other.

    Parameters are stored in half precision (float16: 11 significant bits) and load into a float32 network as usual;
    running statistics stay in float32, they are few and small. The encoder of the variational latent, the optimizer
    and the training settings with their local paths are left out. `use_vae` is false in the copy, so nothing is
    missing when it is loaded; fine-tuning it trains without a latent.

    Args:
        checkpoint: A `pretrained_model` folder of lerobot-train.
        out: Folder to write, which appears when it is complete: `config.json`, `model.safetensors`, the processors,
            `README.md`; it is returned.
        facts: What the model card tells beyond what the checkpoint knows.
        beside: Further texts by the names of their files.

    Raises:
        ConfigurationError: The folder does not hold a whole checkpoint of `mask_act`, or holds a weight beyond half
            precision, or there is something in the place of the one to write.
    """
    config = read_config(checkpoint)
    place = Path(os.path.realpath(out))
    is_free = not any(place.iterdir()) if place.is_dir() else not place.exists()
    require(is_free, f"out={out} exists; choose another folder, or remove it first.")
    require_processors(checkpoint)
    policy = MaskACTPolicy.from_pretrained(checkpoint, config=config)
    weights = run_time_weights(policy)
    config = copy.copy(policy.config)
    config.use_vae, config.pretrained_path = False, None
    card = model_card(checkpoint, config, parameter_count(policy), facts or CardFacts())
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{place.name}.", dir=place.parent) as temporary:
        folder = Path(temporary) / place.name
        folder.mkdir()
        try:
            save_file(weights, folder / WEIGHTS, metadata={"format": "pt"})
        except SafetensorError as error:
            raise ConfigurationError(
                f"out={out} cannot be written: {error}; free some space, or write elsewhere."
            ) from error
        config.save_pretrained(folder)
        for name in PROCESSORS:
            for file in sorted(checkpoint.glob(f"{Path(name).stem}*")):
                shutil.copyfile(file, folder / file.name)
        card.save(folder / CARD)
        for name, text in (beside or {}).items():
            (folder / name).write_text(text, encoding="utf-8")
        if place.is_dir():
            place.rmdir()  # it is empty
        folder.rename(place)
    return out


def run_time_weights(policy: MaskACTPolicy) -> dict[str, Tensor]:
    """Return what acting needs of a trained policy: parameters in half precision, statistics as they are.

    Raises:
        ConfigurationError: A parameter does not fit into half precision (beyond 65504, or not a number).
    """
    parameters = {name for name, _ in policy.named_parameters()}
    weights = {}
    for name, value in policy.state_dict().items():
        if name.startswith(TRAINING_ONLY):
            continue
        weights[name] = value.half() if name in parameters else value
        require(
            bool(torch.isfinite(weights[name]).all()),
            f"{name} holds values up to {value.abs().max():g}, beyond half precision (65504): the training diverged. "
            "Export an earlier checkpoint.",
        )
    return weights


def parameter_count(policy: MaskACTPolicy) -> int:
    """Return the number of parameters that acting needs."""
    return sum(value.numel() for name, value in policy.named_parameters() if not name.startswith(TRAINING_ONLY))


def read_config(checkpoint: Path) -> MaskACTConfig:
    """Return the settings of the policy in a folder.

    Raises:
        ConfigurationError: There is none, it is of another type than `mask_act`, or its settings cannot be used.
    """
    missing = [name for name in (CONFIG, WEIGHTS) if not (checkpoint / name).is_file()]
    require(
        not missing,
        f"checkpoint={checkpoint} lacks {' and '.join(missing)}; give the pretrained_model folder of a run of "
        "lerobot-train, for example outputs/train/checkpoints/last/pretrained_model.",
    )
    kind = read_json(checkpoint / CONFIG).get("type")
    require(
        kind == MaskACTConfig.get_choice_name(MaskACTConfig),
        f"checkpoint={checkpoint} holds a policy of type {kind!r}; only mask_act can be exported.",
    )
    try:
        config: MaskACTConfig = PreTrainedConfig.from_pretrained(checkpoint)
    except (ConfigurationError, DraccusException, TypeError, ValueError) as error:
        raise ConfigurationError(f"{checkpoint / CONFIG} cannot be used: {' '.join(str(error).split())}") from error
    config.validate_features()
    require(
        config.withhold_mask or config.mask_key in config.image_features,
        f"{checkpoint / CONFIG}: mask_key={config.mask_key!r} is none of its image features "
        f"({', '.join(sorted(config.image_features))}); take an undamaged copy of the checkpoint.",
    )
    return config
