"""Physical constants of the excavator, each with its unit, its kind and its source.

The machine is a generic 8-t excavator: published figures of the Doosan DX80R (the sister of the Bobcat
E80) where they exist, neighbours of its class elsewhere, and our own estimates where neither says. A value
is used by its plain name; `CATALOGUE` holds the same values with their origin, for tests and reports.
"""

from dataclasses import dataclass
from math import pi
from typing import Literal

from lerobot_excav.envs import constants as shared

Kind = Literal["datasheet", "paper", "derived", "tuned", "guess"]


@dataclass(frozen=True, kw_only=True)
class Constant:
    """One physical constant and where it comes from.

    Attributes:
        value: A number, or nested tuples of numbers.
        unit: SI unit; "1" for a pure number.
        kind: How the value was obtained.
        source: Document, reasoning or purpose behind the value.
    """

    value: object
    unit: str
    kind: Kind
    source: str


CATALOGUE: dict[str, Constant] = {}


def _constant[T](name: str, value: T, unit: str, kind: Kind, source: str) -> T:
    CATALOGUE[name] = Constant(value=value, unit=unit, kind=kind, source=source)
    return value


JOINT_NAMES = ("swing", "boom", "arm", "bucket")
"""Order of joints, commands and actuators everywhere."""

# --- time and place ---------------------------------------------------------------------------------

TICK_S = _constant("TICK_S", shared.TICK_S, "s", "paper", "control and soil step of the published 50 Hz set-up")
SUBSTEP_S = _constant("SUBSTEP_S", 0.002, "s", "tuned", "servos are stable from 2 to 5 ms; 2 ms for contacts")
GRAVITY_M_S2 = _constant(
    "GRAVITY_M_S2", shared.GRAVITY_M_S2, "m/s2", "paper", "standard gravity, rounded as MuJoCo does"
)
MACHINE_POS_W = _constant(
    "MACHINE_POS_W", (-4.6, 0.0, 0.0), "m", "tuned", "puts the 6 m dig area inside the digging envelope"
)

# --- kinematics: all pins lie in the plane of the swing axis ----------------------------------------

SWING_HEIGHT_M = _constant("SWING_HEIGHT_M", 0.77, "m", "guess", "top of the slewing ring of an 8-t undercarriage")
BOOM_PIN_S = _constant(
    "BOOM_PIN_S", (0.75, 0.0, 0.38), "m", "derived", "swing frame; fitted to the DX80R working ranges"
)
BOOM_LENGTH_M = _constant("BOOM_LENGTH_M", 3.60, "m", "derived", "pin to pin; fitted to the DX80R ranges")
ARM_LENGTH_M = _constant("ARM_LENGTH_M", 1.70, "m", "datasheet", "DX80R arm, 5 ft 7 in")
BUCKET_LENGTH_M = _constant("BUCKET_LENGTH_M", 1.15, "m", "derived", "pin to tooth; fitted to the ranges")
JOINT_RANGE_RAD = _constant(
    "JOINT_RANGE_RAD",
    ((-pi, pi), (-0.768, 1.222), (-2.653, -0.524), (-2.496, 0.576)),
    "rad",
    "datasheet",
    "Hitachi ZX120 joint limits (44/70, 30/152, 143/33 deg), which are free of scale; swing is ours",
)
REACH_AT_GROUND_M = _constant("REACH_AT_GROUND_M", 6.91, "m", "datasheet", "DX80R, maximum at ground level")
DIG_DEPTH_M = _constant("DIG_DEPTH_M", 4.19, "m", "datasheet", "DX80R, maximum")
DUMP_HEIGHT_M = _constant(
    "DUMP_HEIGHT_M", 4.48, "m", "derived", "edge of the hanging bucket; the DX80R brochure says 4.65"
)

# --- masses and inertias ----------------------------------------------------------------------------

UNDERCARRIAGE_MASS_KG = _constant("UNDERCARRIAGE_MASS_KG", 2600.0, "kg", "guess", "share of the 8-t class")
HOUSE_MASS_KG = _constant("HOUSE_MASS_KG", 4300.0, "kg", "guess", "share of the 8-t class")
HOUSE_COM_S = _constant("HOUSE_COM_S", (-0.55, 0.0, 0.55), "m", "guess", "swing frame; counterweight behind")
HOUSE_INERTIA_KGM2 = _constant(
    "HOUSE_INERTIA_KGM2", (2600.0, 4300.0, 4600.0), "kg m2", "derived", "box of that mass, about its com"
)
BOOM_MASS_KG = _constant("BOOM_MASS_KG", 520.0, "kg", "derived", "between 1.9-t and 20-t models")
BOOM_COM_M = _constant("BOOM_COM_M", (1.66, 0.0, 0.0), "m", "derived", "along the chord from its pin")
BOOM_INERTIA_KGM2 = _constant(
    "BOOM_INERTIA_KGM2", (40.0, 700.0, 690.0), "kg m2", "derived", "rod of that mass, about its com"
)
ARM_MASS_KG = _constant("ARM_MASS_KG", 270.0, "kg", "derived", "between 1.9-t and 20-t models")
ARM_COM_M = _constant("ARM_COM_M", (0.60, 0.0, 0.0), "m", "derived", "along the arm from its pin")
ARM_INERTIA_KGM2 = _constant(
    "ARM_INERTIA_KGM2", (12.0, 95.0, 90.0), "kg m2", "derived", "rod of that mass, about its com"
)
BUCKET_MASS_KG = _constant("BUCKET_MASS_KG", 210.0, "kg", "datasheet", "Komatsu PC78US-8 brochure")
BUCKET_COM_T = _constant("BUCKET_COM_T", (0.55, 0.0, 0.25), "m", "derived", "centroid of shell and ears")
BUCKET_INERTIA_KGM2 = _constant(
    "BUCKET_INERTIA_KGM2", (22.0, 30.0, 32.0), "kg m2", "derived", "hollow box of that mass, about its com"
)

# --- bucket -----------------------------------------------------------------------------------------

BUCKET_INNER_WIDTH_M = _constant(
    "BUCKET_INNER_WIDTH_M", 0.72, "m", "derived", "750 mm outside (PC78US-8), less the side plates"
)
BUCKET_PROFILE_T = _constant(
    "BUCKET_PROFILE_T",
    (
        (1.15, 0.0),
        (0.76, 0.39),
        (0.60, 0.51),
        (0.43, 0.57),
        (0.27, 0.50),
        (0.17, 0.35),
        (0.167, 0.17),
        (0.28, 0.0),
    ),
    "m",
    "derived",
    "inner cross-section (x, z) from edge to back lip; convex, sized for the heaped volume",
)
BUCKET_HEAPED_VOLUME_M3 = _constant(
    "BUCKET_HEAPED_VOLUME_M3", 0.34, "m3", "datasheet", "SAE J296, 1:1 heap; PC78US-8 755 mm bucket"
)
PLATE_THICKNESS_M = _constant("PLATE_THICKNESS_M", 0.02, "m", "guess", "wear plate with its strips")
PAYLOAD_GYRATION_M = _constant(
    "PAYLOAD_GYRATION_M", (0.25, 0.22, 0.29), "m", "derived", "box of 0.72 m x 0.70 m x 0.45 m about its com"
)

# --- actuation --------------------------------------------------------------------------------------

JOINT_TORQUE_NM = _constant(
    "JOINT_TORQUE_NM",
    (28e3, 150e3, 105e3, 63e3),
    "N m",
    "derived",
    "bucket, arm: DX80R breakout 54.6 and 40.9 kN times lever; boom: twice its holding torque; swing: ramp",
)
JOINT_SPEED_RAD_S = _constant(
    "JOINT_SPEED_RAD_S",
    (1.0, 0.55, 0.80, 1.30),
    "rad/s",
    "derived",
    "full stick; swing: DX80R 9.6 rpm; others from full-range times of 3.6, 2.7 and 2.4 s",
)
JOINT_ACCEL_RAD_S2 = _constant(
    "JOINT_ACCEL_RAD_S2", (0.65, 0.8, 1.2, 2.5), "rad/s2", "derived", "swing as published; others by feel"
)
SERVO_STIFFNESS_NM_RAD = _constant(
    "SERVO_STIFFNESS_NM_RAD", (2.8e6, 1.5e7, 1.05e7, 6.3e6), "N m/rad", "derived", "torque limit / deflection"
)
SERVO_DAMPING_NMS_RAD = _constant(
    "SERVO_DAMPING_NMS_RAD", (5e5, 9e5, 3e5, 6e4), "N m s/rad", "tuned", "near critical at full reach"
)
SERVO_DEFLECTION_RAD = _constant(
    "SERVO_DEFLECTION_RAD", 0.01, "rad", "tuned", "reference lead at which the relief valve opens"
)

# --- coupling to soil and box -----------------------------------------------------------------------

PAYLOAD_RATE_KG_S = _constant(
    "PAYLOAD_RATE_KG_S", 20e3, "kg/s", "tuned", "20 kg per ms: the payload grows without a kick"
)
CONTACT_FRICTION = _constant("CONTACT_FRICTION", 0.5, "1", "guess", "steel on steel or hard ground")
BOX_WALL_THICKNESS_M = _constant("BOX_WALL_THICKNESS_M", 0.10, "m", "guess", "sheet-steel wall with its ribs")
