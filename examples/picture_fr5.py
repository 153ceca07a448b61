"""Draw the picture of the FR5 environment: the start with the commanded block framed, and the arm with it in the air.

Usage: python examples/picture_fr5.py outputs/blocks.png [SCENE_ID TARGET_ID]
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from lerobot_excav.envs.machines.fr5.viewing import WorkcellView
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.operator import GraspOperator

LIFTED = 2.0  # reward of a lifted block


def main(path: Path, scene_id: int, target_id: int) -> None:
    """Play until the block is well up, and save the main view of the start beside the overview of that moment."""
    env = FR5GraspEnv(obs_type="agent_pos")
    env.reset(options={"scene_id": scene_id, "target_id": target_id})
    # Drawn at twice the size and reduced, for finer edges still.
    view = WorkcellView(env.workcell, height=960, width=1280)
    view.mark(target_id)
    start = view.render("main")
    operator = GraspOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    lifted = 0
    while lifted < 25:
        lifted += env.step(operator.act(env))[1] >= LIFTED
    overview = view.render("overview")
    view.close()
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = Image.fromarray(np.concatenate([start, overview], axis=1))
    picture.resize((1280, 480), Image.Resampling.LANCZOS).save(path, optimize=True)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if Path(sys.argv[1]).exists():
        sys.exit(f"{sys.argv[1]} exists; choose another file, or remove it first")
    numbers = [int(word) for word in sys.argv[2:4]] or [3, 1]
    main(Path(sys.argv[1]), *numbers)
