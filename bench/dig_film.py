"""A film of one scoop: digging and dumping in slow motion, the ways between them in quick motion.

python -m bench.dig_film outputs/dig.mp4
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICKS_PER_SECOND
from lerobot_excav.envs.machines.excavator.viewing import WorksiteView
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator
from lerobot_excav.evaluation.video import write_video

FRAMES_PER_SECOND = 20
"""With one tick to a picture, 2.5 times slower than real time."""

_QUICK_TICKS = 6
_MOVING_KG = 2.0
_QUALITY = 24
_SCENE, _TARGET = 3, 2
_LONGEST_S = 40


def ticks_per_picture(phase: str, *, payload_kg: float, airborne_kg: float) -> int:
    """Return the ticks until the next picture: few while soil is in the cutting bucket or loose outside, else more."""
    loads = phase in ("cut", "curl") and payload_kg > 0.0
    return 1 if loads or airborne_kg > _MOVING_KG else _QUICK_TICKS


def pictures(height: int = 480, width: int = 848) -> Iterator[NDArray[np.uint8]]:
    """Play the scripted operator's cycle in a scene of the set `train`; yield the film, (height, width, 3) each.

    Raises:
        RenderingError: Pictures cannot be made on this machine.
    """
    env = ExcavatorEnv(obs_type="agent_pos", fps=TICKS_PER_SECOND)
    env.reset(options={"scene_id": _SCENE, "target_id": _TARGET})
    operator = DigOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    soil = env.worksite.soil
    view = WorksiteView(env.worksite, height=height, width=width)
    view.mark(env.target.corners_w)
    wait = 0
    for _ in range(_LONGEST_S * TICKS_PER_SECOND):
        if env.cycle.is_complete:
            break
        env.step(operator.act(env))
        stride = ticks_per_picture(operator.phase, payload_kg=soil.payload_mass_kg, airborne_kg=soil.airborne_mass_kg)
        wait = min(wait, stride) - 1
        if wait <= 0:
            yield view.render("side")
            wait = stride
    view.close()


if __name__ == "__main__":
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".mp4"):
        sys.exit("Give one file that ends in .mp4: python -m bench.dig_film outputs/dig.mp4")
    if Path(sys.argv[1]).exists():
        sys.exit(f"{sys.argv[1]} exists; choose another file, or remove it first")
    write_video(Path(sys.argv[1]), pictures(), FRAMES_PER_SECOND, crf=_QUALITY)
