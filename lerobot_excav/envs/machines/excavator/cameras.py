"""Poses of the cameras."""

from lerobot_excav.envs.machines.pinhole import CameraPose

MAIN = CameraPose(position=(3.6, -4.6, 7.4), target=(-0.5, 0.25, 0.2), fovy_deg=46.0)
"""Fixed to the world: the pile and the ground around it, the carrier and most of the target box, from the front right.

Every point of a pile is seen from more than 40 degrees above the horizontal, steeper than its slope (39 degrees for
sand), so that no dig region hides behind the ridge.
"""

OVERVIEW = CameraPose(position=(3.0, -6.5, 9.2), target=(-1.4, 1.1, 0.0), fovy_deg=52.0)
"""Fixed to the world, from the same side but wider: machine, dig area and target box. For people, not policies."""

CAB = CameraPose(position=(0.98, 0.75, 2.0), target=(4.8, -0.05, -0.7), fovy_deg=62.0)
"""Fixed to the house (swing frame, origin on the slewing ring), on a bracket above the cab's windscreen: along the boom
down to the dig area, and over the wall of the target box to the soil in it."""

SIDE = CameraPose(position=(4.0, -4.6, 3.2), target=(4.4, 0.0, 0.0), fovy_deg=44.0)
"""Fixed to the house (swing frame): the bucket from the right, wherever it digs or dumps. For people, not policies."""
