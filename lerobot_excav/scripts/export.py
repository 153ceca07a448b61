r"""Write a small copy of a trained policy, with a model card: half precision, nothing that only training needs.

The copy of a mask_act checkpoint loads with --policy.path in lerobot-eval, lerobot-rollout and lerobot-train like any
other. `training.json` in it says how it was trained, for reports: steps, seed, time, and the command if the log of a
workflow tells.

Examples:
  lerobot-excav export outputs/train/checkpoints/last/pretrained_model --out=checkpoints/digging
      write checkpoints/digging
  lerobot-excav export outputs/train/checkpoints/last/pretrained_model --out=checkpoints/grasping \
      --title="FR5 grasping" --env=fr5_grasp --results=results/table.md
      ... with a title, a command to run it, and results in the card
"""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.scripts.arguments import Arguments
from lerobot_excav.setting import setting


@dataclass(kw_only=True)
class ExportArguments(Arguments):
    """Arguments of `lerobot-excav export`."""

    POSITIONAL: ClassVar[str] = "checkpoint"

    checkpoint: Path | None = setting("pretrained_model folder of a run of lerobot-train", default=None)
    out: Path | None = setting("Folder to write; must not exist", default=None)
    title: str = setting("Heading of the card", default="mask_act")
    env: str = setting(
        "Environment in the card's command, as in --env.type", default="excavator", choices=lambda: tuple(env_types())
    )
    results: Path | None = setting("Markdown file for the card's section Evaluation", default=None)
    license: str = setting("Licence in the card, as the Hugging Face Hub spells it", default="apache-2.0")


def run(arguments: ExportArguments) -> int:
    """Export, and print what was written.

    Raises:
        ConfigurationError: The checkpoint is not given, or cannot be exported.
    """
    from lerobot_excav.evaluation.training import FACTS, read_training
    from lerobot_excav.policies.mask_act.export import export_checkpoint
    from lerobot_excav.policies.mask_act.model_card import CardFacts

    checkpoint = arguments.given(
        "checkpoint",
        "the pretrained_model folder of a run of lerobot-train, for example "
        "lerobot-excav export outputs/train/checkpoints/last/pretrained_model --out=checkpoints/digging",
    )
    out = arguments.given("out", "the folder to write, such as --out=checkpoints/digging")
    facts = CardFacts(
        title=arguments.title,
        env_type=arguments.env,
        results=_text(arguments.results) if arguments.results is not None else "",
        license=arguments.license,
    )
    training = read_training(checkpoint)
    beside = {} if training is None else {FACTS: training.model_dump_json(indent=1) + "\n"}
    export_checkpoint(checkpoint, out, facts, beside=beside)
    size = sum(file.stat().st_size for file in out.iterdir())
    print(f"{out}: {size / 1e6:.1f} MB; run it with lerobot-eval --policy.path={out}")
    return 0


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"--results={path} is not text in UTF-8 ({error}); give a Markdown file") from error


ARGUMENTS = ExportArguments
