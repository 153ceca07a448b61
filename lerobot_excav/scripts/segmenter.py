"""Train the small network that turns a click into a mask, or measure one.

With --out a network learns from masks of the simulator, within twenty minutes on two cores, and is written to that
file; `mask_source=click` takes it by `model = "FILE"` in its options. Then, or without --out at once, it clicks on
every target of other scenes and prints how well the masks fit (intersection over union, at 96 x 128).

Examples:
  lerobot-excav segmenter
      measure the network that comes with the package, on val scenes
  lerobot-excav segmenter --scene_set=test --score_scenes=200
      ... on test scenes, as reported
  lerobot-excav segmenter --out=outputs/clicks.safetensors
      train one in the same way
  lerobot-excav segmenter --env_types=fr5_grasp --scenes=600 --out=outputs/arm_clicks.safetensors
      ... for the arm alone, with more scenes
"""

import itertools
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.envs.tasks.settings import SCENE_SETS
from lerobot_excav.errors import DatasetError, require
from lerobot_excav.scripts.arguments import Arguments
from lerobot_excav.setting import setting

if TYPE_CHECKING:
    from lerobot_excav.envs.masks.click.segmenter import ClickSegmenter


@dataclass(kw_only=True)
class SegmenterArguments(Arguments):
    """Arguments of `lerobot-excav segmenter`."""

    env_types: str = setting("Environments whose scenes it sees, parted by commas", default="excavator,fr5_grasp")
    out: Path | None = setting("File of the new network; left out: none is trained", default=None)
    model: Path | None = setting(
        "Network to measure, where none is trained; left out: the one that comes with the package", default=None
    )
    scenes: int = setting("Train scenes of each environment to learn from", default=300, low=1, high=10_000)
    steps: int = setting("Training steps", default=1500, low=10, high=1_000_000)
    batch_size: int = setting("Clicks of a step", default=16, low=2, high=1024)
    seed: int = setting("Seed of network and clicks", default=0, low=0, high=2**31 - 1)
    scene_set: str = setting("Stream of the scenes that it is measured on", default="val", choices=SCENE_SETS)
    score_scenes: int = setting("How many of each environment", default=50, low=1, high=10_000)

    def __post_init__(self) -> None:
        super().__post_init__()
        known = tuple(env_types())
        require(
            all(name in known for name in self.names),
            f"--env_types={self.env_types!r} is not a list of environments; allowed, parted by commas: "
            f"{', '.join(known)}",
        )
        require(
            self.out is None or self.model is None,
            f"--model={self.model} is measured where nothing is trained; leave --out={self.out} or --model out",
        )
        require(
            self.out is None or self.scene_set != "train",
            f"--scene_set=train with --out={self.out} would measure on what was learned; give val or test",
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The environments."""
        return tuple(dict.fromkeys(name.strip() for name in self.env_types.split(",")))


def run(arguments: SegmenterArguments) -> int:
    """Train if asked to, and print the scores."""
    # PyTorch takes seconds to load, so after the arguments are known to be right.
    from lerobot_excav.datasets.clicks.clicked_scenes import clicked_scenes
    from lerobot_excav.datasets.clicks.score import score
    from lerobot_excav.envs.masks.click.segmenter import BUILT_IN, ClickSegmenter

    out, model = arguments.out, arguments.model or BUILT_IN
    segmenter = ClickSegmenter.load(model) if out is None else _trained(arguments, out)
    print(f"| environment | {arguments.scene_set} scenes | targets | mean IoU | IoU above 0.5 | worst |")
    print("|---|---|---|---|---|---|")
    for name in arguments.names:
        scenes = clicked_scenes(name, arguments.scene_set, range(arguments.score_scenes))
        found = score(segmenter, scenes, np.random.default_rng(arguments.seed))
        print(
            f"| {name} | {found.scenes} | {len(found.ious)} | {found.mean:.3f} | {100 * found.share_above_half:.1f} % "
            f"| {found.ious.min():.2f} |",
            flush=True,
        )
    return 0


def _trained(arguments: SegmenterArguments, out: Path) -> "ClickSegmenter":
    from tqdm import tqdm

    from lerobot_excav.datasets.clicks.clicked_scenes import clicked_scenes
    from lerobot_excav.datasets.clicks.training import train
    from lerobot_excav.envs.masks.click.segmenter import ClickSegmenter

    if out.exists():
        raise DatasetError(f"--out={out} exists; choose another file, or remove it first")
    start = time.monotonic()
    streams = [clicked_scenes(name, "train", range(arguments.scenes)) for name in arguments.names]
    total = arguments.scenes * len(streams)
    scenes = list(tqdm(itertools.chain(*streams), total=total, desc="drawing", unit="scene"))
    network = train(
        scenes, steps=arguments.steps, batch_size=arguments.batch_size, seed=arguments.seed, show_progress=True
    )
    facts = {
        "trained_on": f"{', '.join(arguments.names)}: train scenes 0 to {arguments.scenes - 1} of each",
        "steps": str(arguments.steps),
        "batch_size": str(arguments.batch_size),
        "seed": str(arguments.seed),
    }
    segmenter = ClickSegmenter(network, facts)
    out.parent.mkdir(parents=True, exist_ok=True)
    segmenter.save(out)
    size_mb = out.stat().st_size / 1e6
    print(f"{out}: {size_mb:.2f} MB, trained in {(time.monotonic() - start) / 60.0:.1f} minutes")
    return ClickSegmenter.load(out)


ARGUMENTS = SegmenterArguments
