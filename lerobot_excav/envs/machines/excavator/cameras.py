"""Poses of the cameras."""

from lerobot_excav.envs.machines.pinhole import CameraPose

MAIN = CameraPose(position=(3.6, -4.6, 7.4), target=(-0.5, 0.25, 0.2), fovy_deg=46.0)
"""Fixed to the world: the pile and the ground around it, the carrier and most of the target box, from the front right.

Every point of a pile is seen from more than 40 degrees above the horizontal, steeper than its slope (39 degrees for
sand), so that no dig region hides behind the ridge.
"""

OVERVIEW = CameraPose(position=(3.8, -9.0, 4.2), target=(-1.7, 0.9, 0.8), fovy_deg=39.0)
"""Fixed to the world, from the same side but lower and from farther away: machine, piles and target box, up to the
horizon. For people, not policies; their box has clear walls on this side."""

CAB = CameraPose(position=(0.95, 1.3, 2.0), target=(4.8, 0.8, -0.6), fovy_deg=62.0)
"""Fixed to the house (swing frame, origin on the slewing ring), on a bracket left of the cab's windscreen, as a mirror
is: past the boom, which covers 3 % of the picture on average over three operator's cycles and 11 % at most, down to the
dig area, and over the wall of the target box to the soil in it."""

SIDE = CameraPose(position=(4.0, -4.6, 3.2), target=(4.4, 0.0, 0.0), fovy_deg=44.0)
"""Fixed to the house (swing frame): the bucket from the right, wherever it digs or dumps. For people, not policies."""
