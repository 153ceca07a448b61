"""The README of a checkpoint, in the form of LeRobot's model cards."""

import json
import math
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from huggingface_hub import ModelCardData
from lerobot.configs.types import PolicyFeature

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig

TRAINING_CONFIG = "train_config.json"
TRAINING_STEP = Path("../training_state/training_step.json")


@dataclass(frozen=True, kw_only=True)
class CardFacts:
    """What a model card tells beyond what the checkpoint knows.

    Attributes:
        title: Heading of the card.
        env_type: Environment that the policy was trained for, for the command that runs it.
        results: Markdown for the section "Evaluation", such as the table of `lerobot-excav report`.
        license: Name of the licence, as the Hugging Face Hub spells it.
    """

    title: str = "mask_act"
    env_type: str = "excavator"
    results: str = ""
    license: str = "apache-2.0"


def model_card(checkpoint: Path, config: MaskACTConfig, parameters: int, facts: CardFacts) -> str:
    """Write the card of a policy.

    Args:
        checkpoint: Its `pretrained_model` folder; training settings are read from it if they lie there.
        config: Its settings.
        parameters: Number of its parameters.
        facts: What the checkpoint does not know.

    Returns:
        Markdown with a YAML front matter.
    """
    training = training_facts(checkpoint)
    sections = [
        front_matter(facts, training.get("Dataset")),
        f"# {facts.title}",
        description(config),
        "## Inputs and outputs\n\n" + feature_table(config),
        "## Network\n\n" + fact_table(network_facts(config, parameters)),
    ]
    if training:
        sections.append("## Training\n\n" + fact_table(training))
    sections.append("## How to run it\n\n" + how_to_run(facts))
    results = facts.results.strip()
    sections.append("## Evaluation\n\n" + (results or "No evaluation was given when this card was written."))
    return "\n\n".join(sections) + "\n"


def front_matter(facts: CardFacts, dataset: str | None) -> str:
    """Return the metadata that the Hugging Face Hub reads.

    Args:
        facts: Licence.
        dataset: Name of the training dataset, if known.
    """
    data = ModelCardData(
        library_name="lerobot",
        license=facts.license,
        model_name="mask_act",
        pipeline_tag="robotics",
        tags=["lerobot", "mask_act", "robotics"],
        datasets=dataset,
    )
    return f"---\n{data.to_yaml()}\n---"


def description(config: MaskACTConfig) -> str:
    """Say what the policy sees and does, and which of its inputs point at the target."""
    paths = ["a fourth channel of the main camera"]
    if config.target_token:
        paths.append("a token pooled under the mask")
    condition = (
        "It never sees the mask (`withhold_mask`): the no-condition variant."
        if config.withhold_mask
        else f"A binary mask of the main camera names the target; the network reads it as {' and '.join(paths)}."
    )
    views = "four-channel views"
    if config.coordinate_channels:
        views += ", to which the network adds the row and column of every pixel as two more channels"
    return (
        f"[Action chunking with transformers](https://arxiv.org/abs/2304.13705) over {views}; trained with "
        f"[LeRobot](https://github.com/huggingface/lerobot). {condition} Weights are in half precision and without "
        "what only training needs."
    )


def feature_table(config: MaskACTConfig) -> str:
    """Return a table of inputs and outputs with their shapes."""
    rows = ["| feature | kind | shape |", "|---|---|---|"]
    features: dict[str, PolicyFeature] = {**config.input_features, **config.output_features}
    for name, feature in features.items():
        rows.append(f"| `{name}` | {feature.type.value} | {tuple(feature.shape)} |")
    return "\n".join(rows)


def network_facts(config: MaskACTConfig, parameters: int) -> dict[str, str]:
    """Return the settings that make the network, by what they are called in a table."""
    return {
        "Parameters": f"{parameters / 1e6:.1f} million",
        "Preset": str(config.preset),
        "Backbone": str(config.vision_backbone),
        "Width": str(config.dim_model),
        "Actions per plan": f"{config.chunk_size}, of which {config.n_action_steps} are executed",
        "Target token": "yes" if config.target_token else "no",
        "Coordinate channels": "yes" if config.coordinate_channels else "no",
    }


def training_facts(checkpoint: Path) -> dict[str, str]:
    """Return how a checkpoint was trained, as far as the files beside it tell; no local paths.

    Args:
        checkpoint: A `pretrained_model` folder.
    """
    settings = _read(checkpoint / TRAINING_CONFIG)
    if not settings:
        return {}
    dataset, optimizer = settings["dataset"], settings.get("optimizer") or {}
    step = _read(checkpoint / TRAINING_STEP).get("step", settings["steps"])
    facts = {
        "Dataset": dataset["repo_id"],
        "Episodes": len(dataset["episodes"]) if dataset.get("episodes") else "all",
        "Held out for validation": _held_out(dataset),
        "Steps": step,
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


def fact_table(facts: dict[str, str]) -> str:
    """Lay out names and values as a Markdown table."""
    rows = [f"| {name} | {value} |" for name, value in facts.items()]
    return "\n".join(["| | |", "|---|---|", *rows])


def how_to_run(facts: CardFacts) -> str:
    """Return the commands that evaluate the policy and train it further."""
    return (
        "```bash\n"
        f"lerobot-eval --policy.path=FOLDER --env.type={facts.env_type} --env.scene_set=test \\\n"
        "    --policy.device=cpu --eval.n_episodes=50 --eval.batch_size=1 --output_dir=outputs/eval\n"
        "```\n\n"
        "`FOLDER` is the folder of this card. `--policy.path=FOLDER` in `lerobot-train` goes on from here."
    )


def _read(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text())) if path.is_file() else {}
