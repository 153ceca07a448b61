"""Give a dataset masks of another source, or a dataset that has none its first ones.

The result is a new dataset with the column observation.images.target_mask; all other values and videos stay as they
are, and meta/excav_masks.json tells how every mask came about. Demonstrations of this package are shown again by the
simulator, so that sources which need depth work; of anybody else's dataset the source sees the first picture of every
episode. The same command goes on after an interruption.

Examples:
  lerobot-excav masks outputs/paired --source=geometry --out=outputs/by_depth
      what depth tells, without the simulator's knowledge
  lerobot-excav masks outputs/so101 --source=grounded_sam --mask.text="the red block" \
      --main_camera=observation.images.top --out=outputs/so101_masks
      words lead to a box, and the box to a mask; for somebody else's robot
  lerobot-excav masks outputs/so101 --source=manual --mask.options=drawn.toml --main_camera=observation.images.top \
      --out=outputs/so101_masks
      masks that a person has drawn, with key = "episode/0" and so on
"""

from dataclasses import dataclass, field
from pathlib import Path

from lerobot_excav.envs.masks.source import mask_source_names
from lerobot_excav.scripts.arguments import Arguments
from lerobot_excav.scripts.qc import DatasetArguments
from lerobot_excav.setting import setting


@dataclass(kw_only=True)
class MaskArguments(Arguments):
    """What the source is told."""

    PREFIX = "--mask."

    text: str | None = setting("What to look for; left out: what the options say, or the task", default=None)
    options: str | None = setting("TOML file of all that the source can be told", default=None)
    snap: bool = setting(
        "Whether a small network marks the object under the middle of each mask, and that is taken in its place: mends "
        "masks that lie a little off their object",
        default=False,
    )


@dataclass(kw_only=True)
class MasksArguments(DatasetArguments):
    """Arguments of `lerobot-excav masks`."""

    source: str | None = setting("Source of the masks", default=None, choices=mask_source_names)
    out: Path | None = setting("Folder of the new dataset; must not exist", default=None)
    main_camera: str | None = setting(
        "Camera that the masks belong to, of a dataset of somebody else; left out: observation.images.main",
        default=None,
    )
    mask: MaskArguments = field(default_factory=MaskArguments)


def run(arguments: MasksArguments) -> int:
    """Make the masks, and say what comes next."""
    from lerobot_excav.datasets.masks.make_masks import make_masks

    source = arguments.given("source", "one of the sources, such as --source=geometry")
    out = arguments.given("out", "the folder of the new dataset, such as --out=outputs/masks")
    count = make_masks(
        arguments.root,
        out,
        source=source,
        options=arguments.mask.options,
        text=arguments.mask.text,
        snap=arguments.mask.snap,
        main_camera=arguments.main_camera,
        show_progress=True,
    )
    print(f"{out}: masks of {count} episodes by {source}")
    return 0


ARGUMENTS = MasksArguments
