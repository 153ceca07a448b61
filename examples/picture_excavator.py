"""Draw the picture of the README: the excavator at work, with the commanded dig region tinted.

Usage: python examples/picture_excavator.py outputs/dig.png [SCENE_ID TARGET_ID]
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from lerobot_excav.envs.machines.excavator.viewing import WorksiteView
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator


def main(path: Path, scene_id: int, target_id: int) -> None:
    """Play one cycle until the bucket comes up full, and save the overview beside the cab's view."""
    env = ExcavatorEnv(scene_set="train", obs_type="agent_pos")
    env.reset(options={"scene_id": scene_id, "target_id": target_id})
    operator = DigOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    while operator.phase != "carry":
        env.step(operator.act(env))
    # Drawn at twice the size and reduced, for finer edges still.
    view = WorksiteView(env.worksite, height=960, width=1280)
    view.mark(env.target.corners_w)
    overview, cab_view = view.render("overview"), view.render("cab")
    view.close()
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = Image.fromarray(np.concatenate([overview, cab_view], axis=1))
    small = picture.resize((1120, 420), Image.Resampling.LANCZOS)
    small.quantize(256, method=Image.Quantize.FASTOCTREE).save(path, optimize=True)  # keeps rare colours: the red


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if Path(sys.argv[1]).exists():
        sys.exit(f"{sys.argv[1]} exists; choose another file, or remove it first")
    numbers = [int(word) for word in sys.argv[2:4]] or [3, 2]
    main(Path(sys.argv[1]), *numbers)
