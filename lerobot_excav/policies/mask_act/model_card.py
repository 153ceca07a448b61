"""The README of a checkpoint, in the form of LeRobot's model cards."""

import json
import math
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from huggingface_hub import ModelCard, ModelCardData

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig

TEMPLATE = Path(__file__).with_name("model_card.md.jinja")
TRAINING_CONFIG = "train_config.json"
TRAINING_STEP = Path("../training_state/training_step.json")


@dataclass(frozen=True, kw_only=True)
class CardFacts:
    """What a model card tells beyond what the checkpoint knows."""

    title: str = "mask_act"
    env_type: str = "excavator"  # that the policy was trained for, for the command that runs it
    results: str = ""  # Markdown for the section "Evaluation", such as the table of `lerobot-excav report`
    license: str = "apache-2.0"  # as the Hugging Face Hub spells it


def model_card(checkpoint: Path, config: MaskACTConfig, parameters: int, facts: CardFacts) -> ModelCard:
    """Write the card of a policy with a number of parameters, and the metadata that the Hugging Face Hub reads.

    Training settings are read from the `pretrained_model` folder if they lie there. `str` gives the card's Markdown.
    """
    training = training_facts(checkpoint)
    metadata = ModelCardData(
        library_name="lerobot",
        license=facts.license,
        model_name="mask_act",
        pipeline_tag="robotics",
        tags=["lerobot", "mask_act", "robotics"],
        datasets=training.get("Dataset"),
    )
    features = {**config.input_features, **config.output_features}
    card: ModelCard = ModelCard.from_template(
        metadata,
        template_path=str(TEMPLATE),
        facts=facts,
        config=config,
        parameters=parameters,
        features=[(name, feature.type.value, tuple(feature.shape)) for name, feature in features.items()],
        training=training,
    )
    card.text += "\n"  # jinja drops the last one
    return card


def training_facts(checkpoint: Path) -> dict[str, str]:
    """Return how a `pretrained_model` folder was trained, as far as the files in and beside it tell; no local paths."""
    settings = _read(checkpoint / TRAINING_CONFIG)
    if not settings:
        return {}
    dataset, optimizer = settings["dataset"], settings.get("optimizer") or {}
    facts = {
        "Dataset": dataset["repo_id"],
        "Episodes": len(dataset["episodes"]) if dataset.get("episodes") else "all",
        "Held out for validation": _held_out(dataset),
        "Steps": _read(checkpoint / TRAINING_STEP).get("step", settings["steps"]),
        "Batch size": settings["batch_size"],
        "Learning rate": optimizer.get("lr"),
        "Seed": settings["seed"],
        "LeRobot": version("lerobot"),
    }
    return {name: str(value) for name, value in facts.items() if value is not None}


def _held_out(dataset: dict[str, Any]) -> str:
    """Say how many episodes a training did not learn from, rounded as LeRobot does, or which share of all."""
    share = dataset.get("eval_split") or 0.0
    if not dataset.get("episodes"):
        return f"{100 * share:g} %"
    return str(math.ceil(len(dataset["episodes"]) * share))


def _read(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else {}
