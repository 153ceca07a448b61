r"""Write a small copy of a trained policy, with a model card: half precision, nothing that only training needs.

The copy of a mask_act checkpoint loads with --policy.path in lerobot-eval, lerobot-rollout and lerobot-train like any
other.

Examples:
  lerobot-excav export outputs/train/checkpoints/last/pretrained_model --out=checkpoints/digging
      write checkpoints/digging
  lerobot-excav export outputs/train/checkpoints/last/pretrained_model --out=checkpoints/grasping \
      --title="FR5 grasping" --env=fr5_grasp --results=results/table.md
      ... with a title, a command to run it, and results in the card
"""

from dataclasses import dataclass, field
from pathlib import Path

from lerobot_excav.errors import ConfigurationError


@dataclass(kw_only=True)
class ExportArguments:
    """Arguments of `lerobot-excav export`."""

    checkpoint: Path | None = field(
        default=None, metadata={"custom_args": {"help": "pretrained_model folder of a run of lerobot-train"}}
    )
    out: Path = field(metadata={"custom_args": {"help": "folder to write"}})
    title: str = field(default="mask_act", metadata={"custom_args": {"help": "heading of the card"}})
    env: str = field(
        default="excavator",
        metadata={"custom_args": {"help": "environment in the card's command, as in --env.type"}},
    )
    results: Path | None = field(
        default=None, metadata={"custom_args": {"help": "Markdown file for the card's section Evaluation"}}
    )
    license: str = field(
        default="apache-2.0",
        metadata={"custom_args": {"help": "licence in the card, as the Hugging Face Hub spells it"}},
    )


def run(arguments: ExportArguments) -> int:
    """Export, and print what was written.

    Raises:
        ConfigurationError: The checkpoint is not given, or cannot be exported.
    """
    from lerobot_excav.policies.mask_act.export import export_checkpoint
    from lerobot_excav.policies.mask_act.model_card import CardFacts

    if arguments.checkpoint is None:
        raise ConfigurationError(
            "checkpoint is missing; give the pretrained_model folder of a run of lerobot-train, for example "
            "lerobot-excav export outputs/train/checkpoints/last/pretrained_model --out=checkpoints/digging"
        )
    facts = CardFacts(
        title=arguments.title,
        env_type=arguments.env,
        results=arguments.results.read_text() if arguments.results is not None else "",
        license=arguments.license,
    )
    out = export_checkpoint(arguments.checkpoint, arguments.out, facts)
    size = sum(file.stat().st_size for file in out.iterdir())
    print(f"{out}: {size / 1e6:.1f} MB; run it with lerobot-eval --policy.path={out}")
    return 0
