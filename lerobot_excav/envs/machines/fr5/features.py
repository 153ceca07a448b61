"""Names of what the arm reports and obeys, in LeRobot's flat dictionaries and datasets.

Each scalar ends in `.pos`: `lerobot-rollout` drops every other name without a word.
"""

from lerobot_excav.envs.machines.fr5.constants import JOINT_LIMITS_RAD, JOINT_NAMES

ACTION_NAMES = (*(f"{joint}.pos" for joint in JOINT_NAMES), "gripper.pos")
"""Joint position targets [rad] and gripper target [0..1], in the order of the environment's action."""

ACTION_LOW = (*JOINT_LIMITS_RAD[:, 0].tolist(), 0.0)
ACTION_HIGH = (*JOINT_LIMITS_RAD[:, 1].tolist(), 1.0)
"""Limits of an action, in its units."""

STATE_NAMES = ACTION_NAMES
"""Joint positions [rad] and opening of the gripper [0..1], in the order of `agent_pos`."""

CAMERAS = ("main", "top", "target_mask")

VIEWS = ("overview", "main", "top")
"""Cameras that people may look through."""
