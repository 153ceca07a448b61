"""Physical constants of the excavator, each with its unit, its source and its kind.

The machine is a generic 8-t excavator: published figures of the Doosan DX80R (the sister of the Bobcat E80) where they
exist, neighbours of its class elsewhere, and our own estimates where neither says. Frames: `_S` swing, origin on the
slewing ring; `_T` tool; `_W` world. All pins lie in the plane of the swing axis.
"""

from math import pi

from lerobot_excav.envs.constants import GRAVITY_M_S2 as GRAVITY_M_S2
from lerobot_excav.envs.constants import TICK_S as TICK_S

SUBSTEP_S = 0.002  # servos are stable from 2 to 5 ms; 2 ms for contacts (kind: tuned)

JOINT_NAMES = ("swing", "boom", "arm", "bucket")
"""Order of joints, commands and actuators everywhere."""

# --- kinematics -------------------------------------------------------------------------------------

MACHINE_POS_W = (-4.6, 0.0, 0.0)  # puts the 6 m dig area inside the digging envelope (kind: tuned)
DIG_AREA_EXTENT_M = (6.0, 6.0)  # size of the soil grid along x and y, centred on the world origin (kind: tuned)
SWING_HEIGHT_M = 0.77  # top of the slewing ring of an 8-t undercarriage (kind: guess)
BOOM_PIN_S = (0.75, 0.0, 0.38)  # fitted to the DX80R working ranges (kind: derived)
BOOM_LENGTH_M = 3.60  # pin to pin; fitted to the DX80R ranges (kind: derived)
ARM_LENGTH_M = 1.70  # DX80R arm, 5 ft 7 in (kind: datasheet)
BUCKET_LENGTH_M = 1.15  # pin to tooth; fitted to the ranges (kind: derived)
JOINT_RANGE_RAD = ((-pi, pi), (-0.768, 1.222), (-2.653, -0.524), (-2.496, 0.576))
"""Hitachi ZX120 joint limits (44/70, 30/152, 143/33 deg), which are free of scale; swing is ours (kind: datasheet)."""
REACH_AT_GROUND_M = 6.91  # DX80R, maximum at ground level (kind: datasheet)
DIG_DEPTH_M = 4.19  # DX80R, maximum (kind: datasheet)
DUMP_HEIGHT_M = 4.48  # edge of the hanging bucket; the DX80R brochure says 4.65 (kind: derived)

# --- masses, centres of mass, and moments about them [kg m2] ----------------------------------------

UNDERCARRIAGE_MASS_KG = 2600.0  # share of the 8-t class (kind: guess)
HOUSE_MASS_KG = 4300.0  # share of the 8-t class (kind: guess)
HOUSE_COM_S = (-0.55, 0.0, 0.55)  # counterweight behind (kind: guess)
HOUSE_INERTIA_KGM2 = (2600.0, 4300.0, 4600.0)  # box of that mass (kind: derived)
BOOM_MASS_KG = 520.0  # between 1.9-t and 20-t models (kind: derived)
BOOM_COM_M = (1.66, 0.0, 0.0)  # along the chord from its pin (kind: derived)
BOOM_INERTIA_KGM2 = (40.0, 700.0, 690.0)  # rod of that mass (kind: derived)
ARM_MASS_KG = 270.0  # between 1.9-t and 20-t models (kind: derived)
ARM_COM_M = (0.60, 0.0, 0.0)  # along the arm from its pin (kind: derived)
ARM_INERTIA_KGM2 = (12.0, 95.0, 90.0)  # rod of that mass (kind: derived)
BUCKET_MASS_KG = 210.0  # Komatsu PC78US-8 brochure (kind: datasheet)
BUCKET_COM_T = (0.55, 0.0, 0.25)  # centroid of shell and ears (kind: derived)
BUCKET_INERTIA_KGM2 = (22.0, 30.0, 32.0)  # hollow box of that mass (kind: derived)

MACHINE_WEIGHT_N = GRAVITY_M_S2 * (
    UNDERCARRIAGE_MASS_KG + HOUSE_MASS_KG + BOOM_MASS_KG + ARM_MASS_KG + BUCKET_MASS_KG
)  # plates that the ground pushes harder would lift the machine, which stands fixed here (kind: derived)

# --- bucket -----------------------------------------------------------------------------------------

BUCKET_INNER_WIDTH_M = 0.72  # 750 mm outside (PC78US-8), less the side plates (kind: derived)
BUCKET_PROFILE_T = (
    *((1.15, 0.0), (0.76, 0.39), (0.60, 0.51), (0.43, 0.57)),
    *((0.27, 0.50), (0.17, 0.35), (0.167, 0.17), (0.28, 0.0)),
)
"""Inner cross-section (x, z) [m] from edge to back lip; convex, sized for the heaped volume (kind: derived)."""
BUCKET_HEAPED_VOLUME_M3 = 0.34  # SAE J296, 1:1 heap; PC78US-8 755 mm bucket (kind: datasheet)
PAYLOAD_GYRATION_M = (0.25, 0.22, 0.29)  # box of 0.72 m x 0.70 m x 0.45 m about its com (kind: derived)

# --- actuation, one value per joint -----------------------------------------------------------------

JOINT_TORQUE_NM = (28e3, 150e3, 105e3, 63e3)
"""Bucket, arm: DX80R breakout (54.6, 40.9 kN) by lever; boom: twice its holding torque; swing: ramp (kind: derived)."""
JOINT_SPEED_RAD_S = (1.0, 0.55, 0.80, 1.30)
"""Full stick; swing: DX80R 9.6 rpm; others from full-range times of 3.6, 2.7 and 2.4 s (kind: derived)."""
JOINT_ACCEL_RAD_S2 = (0.65, 0.8, 1.2, 2.5)  # swing as published; others by feel (kind: derived)
SERVO_STIFFNESS_NM_RAD = (2.8e6, 1.5e7, 1.05e7, 6.3e6)  # torque limit / deflection (kind: derived)
SERVO_DAMPING_NMS_RAD = (5e5, 9e5, 3e5, 6e4)  # near critical at full reach (kind: tuned)
SERVO_DEFLECTION_RAD = 0.01  # reference lead at which the relief valve opens (kind: tuned)

# --- coupling to soil and box -----------------------------------------------------------------------

PAYLOAD_RATE_KG_S = 20e3  # 20 kg per ms: the payload grows without a kick (kind: tuned)
CONTACT_FRICTION = 0.5  # steel on steel or hard ground (kind: guess)
BOX_WALL_THICKNESS_M = 0.10  # sheet-steel wall with its ribs (kind: guess)
