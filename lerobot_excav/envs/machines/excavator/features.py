"""Names of what an excavator reports and obeys, in LeRobot's flat dictionaries and datasets.

Each scalar ends in `.pos` or `.vel`: `lerobot-rollout` drops every other name without a word.
"""

from lerobot_excav.envs.machines.excavator.constants import JOINT_NAMES

ACTION_NAMES = tuple(f"{joint}.vel" for joint in JOINT_NAMES)
"""Joystick commands in [-1, 1], in the order of the environment's action."""

STATE_NAMES = (*(f"{joint}.pos" for joint in JOINT_NAMES), *ACTION_NAMES)
"""Joint positions [rad] and velocities [rad/s], in the order of `agent_pos`."""

CAMERAS = ("main", "cab", "target_mask")

VIEW_CAMERAS = ("overview", "side", "main", "cab")
OVERVIEW_WITH_SIDE = "overview_with_side"
VIEWS = (*VIEW_CAMERAS, OVERVIEW_WITH_SIDE)
"""What people may look at: through a camera, or the overview with the bucket from the side in its corner."""
