"""The worksite: machine, soil and target box, advanced together one tick at a time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, SOIL_CELL_SIZE_M, TARGET_BOX
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import Reaction, Soil, SoilParameters


@dataclass(frozen=True, kw_only=True)
class WorksiteStart:
    """How a worksite is before the first command. Its arrays are read-only.

    Attributes:
        joint_pos: Swing, boom, arm, bucket [rad], shape (4,).
        heights_m: Soil above the floor [m], shape (nx, ny).
        appearance: Colours and light.
        firm_heights_m: How high soil lies that was never loosened [m], shape (nx, ny); None means all of it.
        box_heights_m: Soil in the target box [m], shape (mx, my); None means that it is empty.
    """

    joint_pos: NDArray[np.float64]
    heights_m: NDArray[np.float64]
    appearance: Appearance
    firm_heights_m: NDArray[np.float64] | None = None
    box_heights_m: NDArray[np.float64] | None = None


class Worksite:
    """Machine, soil and target box.

    Args:
        soil: Name of the soil preset, or parameters of one's own.
        fidelity: Numerical effort of the soil: `fast`, `standard` or `fine`.

    Attributes:
        machine: The excavator.
        soil: The soil, with the box.
        start_heights_m: Heights of the soil at the last reset (nx, ny) [m], read-only.
    """

    def __init__(self, *, soil: str | SoilParameters = "sand", fidelity: str = "standard") -> None:
        self.machine = ExcavatorMachine()
        self.soil = Soil(
            preset=soil,
            extent_m=DIG_AREA_EXTENT_M,
            cell_size_m=SOIL_CELL_SIZE_M,
            fidelity=fidelity,
            container=TARGET_BOX,
        )
        self.start_heights_m: NDArray[np.float64] = self.soil.heights_m.copy()
        self._ticks = 0

    def reset(self, start: WorksiteStart) -> None:
        """Start again, exactly."""
        self.machine.set_appearance(start.appearance)
        self.machine.reset(start.joint_pos)
        self.soil.reset(start.heights_m, firm_heights_m=start.firm_heights_m, container_heights_m=start.box_heights_m)
        self.start_heights_m = start.heights_m
        self._ticks = 0

    def tick(self, action: NDArray[np.float64]) -> Reaction:
        """Advance by `TICK_S` under joystick commands (4,) in [-1, 1], and return what the soil did to the bucket."""
        reaction = self.soil.step(TICK_S, self.machine.tool())
        self.machine.tick(action, reaction)
        self._ticks += 1
        return reaction

    def surface_z_w(self, xy_w: NDArray[np.float64]) -> float:
        """Return the world z [m] of what lies below a point (2,) [m]: soil, in the box or not, or the bare ground."""
        boxed, box = self.soil.container_heights_m, self.machine.container
        place = box.to_local(xy_w)
        if boxed is None or (np.abs(place) >= box.half_extent_m).any():
            return float(self.soil.height_at(xy_w))
        cell = ((0.5 * place / box.half_extent_m + 0.5) * boxed.shape).astype(int)
        return float(box.center_w[2] + boxed[tuple(cell)])

    @property
    def bucket_height_m(self) -> float:
        """How high the cutting edge is over what lies below it [m]; below 0 in the soil."""
        edge_w = self.machine.cutting_edge_pos_w
        return float(edge_w[2] - self.surface_z_w(edge_w[:2]))

    @property
    def time_s(self) -> float:
        """Time since the reset [s]."""
        return self._ticks * TICK_S
