"""Write the card of a dataset: its README, with scenes, targets, who commanded, soil, quality check and a picture.

The dataset is checked first, as by `lerobot-excav qc`; one that does not pass gets no card. A README that somebody else
has written stays. With --push_to the dataset is then uploaded by LeRobot's own upload, which needs `hf auth login`.

Examples:
  lerobot-excav card outputs/paired
      write outputs/paired/README.md and outputs/paired/meta/excav_card.png
  lerobot-excav card outputs/paired --title="Excavator, 50 paired scenes" --push_to=USER/excavator_paired --private=true
      ... and upload it, for nobody else to see
"""

from dataclasses import dataclass

from lerobot_excav.errors import require
from lerobot_excav.scripts.qc import DatasetArguments
from lerobot_excav.setting import setting


@dataclass(kw_only=True)
class CardArguments(DatasetArguments):
    """Arguments of `lerobot-excav card`."""

    title: str | None = setting("Heading of the card; left out: the name of the folder", default=None)
    license: str = setting("Licence in the card, as the Hugging Face Hub spells it", default="apache-2.0")
    replays: int = setting("How many episodes to replay", default=3, low=0)
    seed: int = setting("Seed of the choice of replays", default=0, low=0)
    push_to: str | None = setting("Upload to this dataset of the Hugging Face Hub, as USER/NAME", default=None)
    private: bool | None = setting(
        "With --push_to: whether only its owner sees it; left out: what the Hub does by default", default=None
    )


def run(arguments: CardArguments) -> int:
    """Write the card, and say where it lies."""
    from lerobot_excav.datasets.card.dataset_card import CARD_PATH, PICTURE_PATH, write_card

    target = arguments.push_to
    require(
        target is None or is_repo_id(target), f"--push_to={target} is not USER/NAME, such as --push_to=someone/digging"
    )
    require(target is not None or arguments.private is None, "--private is of use with --push_to only")
    card = write_card(
        arguments.root,
        title=arguments.title,
        license=arguments.license,
        replays=arguments.replays,
        seed=arguments.seed,
    )
    print(f"{arguments.root / CARD_PATH}, {arguments.root / PICTURE_PATH}")
    if target is not None:
        card.push(arguments.root, target, private=arguments.private)
        print(f"uploaded to {target}")
    return 0


def is_repo_id(name: str) -> bool:
    """Tell whether a name is one that the Hugging Face Hub gives to a dataset of somebody."""
    from huggingface_hub.utils import HFValidationError, validate_repo_id

    try:
        validate_repo_id(name)
    except HFValidationError:
        return False
    return name.count("/") == 1


ARGUMENTS = CardArguments
