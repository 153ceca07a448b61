"""Which dig region is the nearest, as people in a hurry take it: the one with the shortest swing to the box."""

from typing import cast

import numpy as np

from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX, cylinder_from_world
from lerobot_excav.envs.tasks.scoop.scene import Scene
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.envs.tasks.scoop.stage import start_of
from lerobot_excav.envs.tasks.settings import TaskSettings


def swings_to_box_rad(scene: Scene) -> list[float]:
    """Return by how much the machine has to turn from each region of a scene to the middle of the box [rad]."""
    box_rad = cylinder_from_world(np.asarray(TARGET_BOX.center_w))[1]
    return [abs(box_rad - cylinder_from_world(target.center_w)[1]) for target in scene.targets]


def nearest_target(settings: TaskSettings, scene_id: int, stage: int) -> int:
    """Return the region with the shortest swing to the box, whatever its rank; 0 if the start has none."""
    swings_rad = swings_to_box_rad(start_of(cast(ExcavatorSettings, settings), scene_id, stage))
    return int(np.argmin(swings_rad)) if swings_rad else 0
