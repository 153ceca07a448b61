"""Numbers of the Fairino FR5 V6 and of its two-finger gripper, each with unit, source and kind."""

from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2 as GRAVITY_M_S2
from lerobot_excav.envs.constants import TICK_S as TICK_S

SUBSTEP_S = 0.002
"""MuJoCo's time step [s]; the contacts of a gripped block need it (kind: tuned)."""

JOINT_NAMES = ("j1", "j2", "j3", "j4", "j5", "j6")
FINGER_NAMES = ("finger_wide", "finger_narrow")


class Placement(NamedTuple):
    """Pose of a frame in its parent: position [m] and roll [rad]; every joint turns about its own z."""

    xyz: tuple[float, float, float]
    roll: float


class Inertia(NamedTuple):
    """Mass [kg], centre of mass [m] and principal moments about it [kg m2], in the link's frame."""

    mass_kg: float
    com: tuple[float, float, float]
    moments: tuple[float, float, float]


# Frames of the joints in their parents. Source: manufacturer's URDF fairino5_v6 (frcobot_ros2); kind: datasheet.
# They agree with the published Denavit-Hartenberg parameters to 0.1 mm.
JOINT_PLACEMENTS = (
    Placement((0.0, 0.0, 0.0), 0.0),
    Placement((0.0, 0.0, 0.152), np.pi / 2),
    Placement((-0.425, 0.0, 0.0), 0.0),
    Placement((-0.39501, 0.0, 0.0), 0.0),
    Placement((0.0, 0.0, 0.1021), np.pi / 2),
    Placement((0.0, 0.0, 0.102), -np.pi / 2),
)
FLANGE_OFFSET_M = 0.100
"""Flange along the z axis of the last joint [m] (DH d6; kind: datasheet)."""

JOINT_LIMITS_RAD = np.radians([[-175, 175], [-265, 85], [-160, 160], [-265, 85], [-175, 175], [-175, 175]])
"""Lower and upper limit per joint [rad], (6, 2) (kind: datasheet; of 160 and 162 deg for joint 3 the smaller)."""
JOINT_SPEED_RAD_S = np.array([3.15, 3.15, 3.15, 3.2, 3.2, 3.2])
"""Speed limit per joint [rad/s] (kind: datasheet)."""
JOINT_TORQUE_N_M = np.array([150.0, 150.0, 150.0, 28.0, 28.0, 28.0])
"""Torque limit per joint [N m] (kind: datasheet)."""

# The URDF's solid bodies sum to 31.9 kg, with which the arm could not hold its payload; the arm weighs about 22 kg.
MASS_SCALE = 0.69
"""Factor on the masses and moments of the URDF (kind: derived)."""
LINK_INERTIAS = (
    Inertia(4.3771, (0.0, -0.0041, 0.1463), (0.01073, 0.01041, 0.00818)),
    Inertia(14.458, (-0.2125, 0.0, 0.1346), (0.02839, 0.4559, 0.44974)),
    Inertia(7.6737, (-0.18793, 0.0, 0.00664), (0.00851, 0.16971, 0.16854)),
    Inertia(1.6266, (0.0, -0.00375, 0.09716), (0.00216, 0.00155, 0.00199)),
    Inertia(1.5812, (0.0, 0.00386, 0.09826), (0.00206, 0.00145, 0.00196)),
    Inertia(0.5254, (0.0, 0.0, 0.07612), (0.00028, 0.00028, 0.00042)),
)
"""Of the links behind each joint, before `MASS_SCALE` (URDF, products of inertia left out; kind: datasheet)."""

# Position servos: stiffness [N m/rad], damping [N m s/rad], reflected rotor inertia [kg m2] (kind: derived, so that
# damping is near critical at the arm's inertia) and dry friction [N m] (kind: guess).
JOINT_STIFFNESS = (2000.0, 2000.0, 2000.0, 500.0, 500.0, 500.0)
JOINT_DAMPING = (120.0, 120.0, 120.0, 20.0, 20.0, 20.0)
JOINT_ARMATURE = (0.1, 0.1, 0.1, 0.02, 0.02, 0.02)
JOINT_FRICTION_N_M = (1.0, 1.0, 1.0, 0.2, 0.2, 0.2)

HOME_JOINT_POS = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
"""Tool straight down, its flange 0.48 m above the table [rad] (published demonstrations of this task; kind: paper)."""

# Gripper: a stand-in for the AgiBot OmniPicker, whose adaptive linkage moves the fingertips almost in parallel.
HAND_RADIUS_M, HAND_LENGTH_M = 0.032, 0.090  # kind: derived from the drawing
HAND_MASS_KG = 0.36  # kind: derived, so that hand and fingers weigh the 0.43 kg of the manual
FINGER_MASS_KG = (0.040, 0.030)  # wide, narrow; kind: derived
FINGER_STROKE_M = 0.060
"""Travel of each finger from closed to open [m]: 120 mm between the pads (remembered from the manual; kind: guess)."""
PAD_CENTRE_M = 0.143
"""Centre of the pads in front of the flange [m] (tool centre point of the manufacturer's model; kind: datasheet)."""
PAD_WIDTH_M = (0.018, 0.010)  # wide, narrow; kind: derived
PAD_THICKNESS_M, PAD_LENGTH_M = 0.012, 0.045  # kind: derived
FINGER_FORCE_N = 30.0
"""Largest force of each finger [N] (manual, from memory; kind: guess)."""
FINGER_STIFFNESS_N_M = 3000.0  # kind: tuned: full force from 10 mm of error on
FINGER_DAMPING_N_S_M = 30.0  # kind: derived, near critical with the motor's inertia
FINGER_SPEED_M_S = 0.15  # stroke in 0.4 s (drive settings in public use: 0.35 to 0.45 s; kind: derived)
PAD_FRICTION = (1.5, 0.05, 0.0001)
"""Sliding [1], torsional [m] and rolling [m] friction of rubber pads (kind: guess, from the range 1.2 to 2)."""
