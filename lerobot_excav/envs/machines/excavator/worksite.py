"""The worksite: machine, soil and target box, advanced together one tick at a time."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, TARGET_BOX
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import Reaction, Soil, Tool
from lerobot_excav.envs.tasks.scoop.scene import SOIL_CELL_SIZE_M, Scene


class Worksite:
    """Machine, soil and target box.

    Args:
        soil: Name of the soil preset.
        fidelity: Numerical effort of the soil: `fast`, `standard` or `fine`.

    Attributes:
        machine: The excavator.
        soil: The soil, with the box.
        time_s: Time since the reset.
        reaction: What the soil did to the bucket in the last tick; None before the first one.
    """

    def __init__(self, *, soil: str = "sand", fidelity: str = "standard") -> None:
        self.machine = ExcavatorMachine(container=TARGET_BOX, terrain_shape_m=DIG_AREA_EXTENT_M)
        self.soil = Soil(
            preset=soil,
            extent_m=DIG_AREA_EXTENT_M,
            cell_size_m=SOIL_CELL_SIZE_M,
            fidelity=fidelity,
            container=TARGET_BOX,
        )
        self.time_s = 0.0
        self.reaction: Reaction | None = None
        self._ticks = 0

    def reset(self, scene: Scene) -> None:
        """Restore the start of a scene exactly."""
        self.machine.set_appearance(scene.appearance)
        self.machine.reset(scene.joint_pos)
        self.soil.reset(scene.heights_m)
        self._ticks, self.time_s = 0, 0.0
        self.reaction = None

    def tick(self, action: NDArray[np.float64]) -> Reaction:
        """Advance by `TICK_S` under joystick commands.

        Args:
            action: Swing, boom, arm, bucket in [-1, 1], shape (4,).

        Returns:
            What the soil did to the bucket during the tick.
        """
        reaction = self.soil.step(TICK_S, self.machine.tool())
        self.machine.tick(action, reaction)
        self.reaction = reaction
        self._ticks += 1
        self.time_s = self._ticks * TICK_S
        return reaction

    @property
    def tool(self) -> Tool:
        """The bucket as the soil sees it."""
        return self.machine.tool()

    @property
    def box_mass_kg(self) -> float:
        """Soil in the target box [kg]."""
        return self.soil.box_mass_kg
