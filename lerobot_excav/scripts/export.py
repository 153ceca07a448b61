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

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("checkpoint", type=Path, help="pretrained_model folder of a run of lerobot-train")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    parser.add_argument("--title", default="mask_act", help="heading of the card (default: mask_act)")
    parser.add_argument(
        "--env",
        default="excavator",
        help="environment in the card's command, as in --env.type (default: excavator)",
    )
    parser.add_argument("--results", type=Path, help="Markdown file for the card's section Evaluation")
    parser.add_argument("--license", default="apache-2.0", help="licence in the card (default: apache-2.0)")


def run(arguments: argparse.Namespace) -> int:
    """Export, and print what was written."""
    from lerobot_excav.policies.mask_act.export import export_checkpoint
    from lerobot_excav.policies.mask_act.model_card import CardFacts

    results = arguments.results.read_text() if arguments.results is not None else ""
    facts = CardFacts(
        title=arguments.title, env_type=arguments.env, results=results, license=arguments.license
    )
    out = export_checkpoint(arguments.checkpoint, arguments.out, facts)
    size = sum(file.stat().st_size for file in out.iterdir())
    print(f"{out}: {size / 1e6:.1f} MB; run it with lerobot-eval --policy.path={out}")
    return 0
