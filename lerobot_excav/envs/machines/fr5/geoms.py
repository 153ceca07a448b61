"""How the parts of the work cell collide and which group draws them."""

from typing import NamedTuple


class Kind(NamedTuple):
    """Collision bits and drawing group of a geom: two geoms touch if one's `type` meets the other's `affinity`."""

    type: int
    affinity: int
    group: int

    @property
    def arguments(self) -> dict[str, int]:
        """The arguments of `add_geom` that say so."""
        return {"contype": self.type, "conaffinity": self.affinity, "group": self.group}


_CELL_BIT, _ARM_BIT = 1, 2

CELL = Kind(type=_CELL_BIT, affinity=_CELL_BIT | _ARM_BIT, group=0)
"""Table and tray."""
ARM = Kind(type=_ARM_BIT, affinity=_CELL_BIT, group=1)
"""Arm and gripper: they touch the cell and the blocks, never each other."""
BLOCK = Kind(type=_CELL_BIT, affinity=_CELL_BIT | _ARM_BIT, group=2)
"""Blocks touch everything."""
DECORATION = Kind(type=0, affinity=0, group=1)
"""Parts of the arm that are drawn and touch nothing: they overlap their neighbours."""

HARD_SOLREF = (0.004, 1.0)
"""Time constant [s] and damping ratio of a contact: two time steps, the hardest that stays stable (kind: derived)."""
