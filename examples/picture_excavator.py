"""Draw the picture of the README: the excavator at work, with the commanded dig region tinted.

Usage: python examples/picture_excavator.py outputs/dig.png [SCENE_ID TARGET_ID]
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from lerobot_excav.envs.machines.excavator.rendering import WorksiteRenderer
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator

TINT_RGB = np.array([235, 60, 40])


def main(path: Path, scene_id: int, target_id: int) -> None:
    """Play one cycle until the bucket comes up full, and save the main view beside the cab's."""
    env = ExcavatorEnv(scene_set="train", obs_type="agent_pos")
    env.reset(options={"scene_id": scene_id, "target_id": target_id})
    operator = DigOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    while operator.phase != "carry":
        env.step(operator.act(env))
    # Drawn at twice the size and reduced: the renderer does not smooth edges.
    renderer = WorksiteRenderer(env.worksite, height=960, width=1280)
    main_view, cab_view = renderer.render("main"), renderer.render("cab")
    region = env.target.contains(renderer.terrain_points_w())
    main_view[region] = (0.45 * main_view[region] + 0.55 * TINT_RGB).astype(np.uint8)
    renderer.close()
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = Image.fromarray(np.concatenate([main_view, cab_view], axis=1))
    picture.resize((1280, 480), Image.Resampling.LANCZOS).save(path, optimize=True)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if Path(sys.argv[1]).exists():
        sys.exit(f"{sys.argv[1]} exists; choose another file, or remove it first")
    numbers = [int(word) for word in sys.argv[2:4]] or [3, 2]
    main(Path(sys.argv[1]), *numbers)
