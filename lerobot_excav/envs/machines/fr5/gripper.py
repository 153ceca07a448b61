"""The two-finger gripper: mirrored slides in place of the adaptive linkage, driven by one motor."""

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5.geoms import ARM, HARD_SOLREF
from lerobot_excav.envs.machines.simulator import mujoco

_HAND_RGBA = (0.16, 0.17, 0.19, 1.0)
_PAD_RGBA = (0.05, 0.05, 0.06, 1.0)
_ROD_LENGTH_M = const.PAD_CENTRE_M - 0.5 * const.PAD_LENGTH_M - const.HAND_LENGTH_M


def add_gripper(spec: mujoco.MjSpec, wrist: mujoco.MjsBody) -> None:
    """Add hand, fingers, the actuator `gripper` and the site `grasp` between the pads to the last link of an arm."""
    hand = wrist.add_body(name="hand", pos=[0.0, 0.0, const.FLANGE_OFFSET_M], gravcomp=1.0)
    shape = {"fromto": [0, 0, 0, 0, 0, const.HAND_LENGTH_M], "size": [const.HAND_RADIUS_M, 0, 0]}
    cylinder = mujoco.mjtGeom.mjGEOM_CYLINDER
    hand.add_geom(type=cylinder, mass=const.HAND_MASS_KG, rgba=_HAND_RGBA, **shape, **ARM.arguments)
    hand.add_site(name="grasp", pos=[0.0, 0.0, const.PAD_CENTRE_M], group=5)
    for finger, side in enumerate((1.0, -1.0)):
        _add_finger(hand, finger, side)
    _couple_fingers(spec)
    _add_motor(spec)


def _add_finger(hand: mujoco.MjsBody, finger: int, side: float) -> None:
    """Add a finger that slides along +x or -x of the hand; at zero its pad's face lies in the middle."""
    name = const.FINGER_NAMES[finger]
    body = hand.add_body(name=name, gravcomp=1.0)
    joint = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[side, 0, 0])
    joint.range = [0.0, const.FINGER_STROKE_M]
    joint.armature = 0.05  # [kg], the motor seen through its gear (kind: guess)
    x, box = side * 0.5 * const.PAD_THICKNESS_M, mujoco.mjtGeom.mjGEOM_BOX
    half_x, half_y = 0.5 * const.PAD_THICKNESS_M, 0.5 * const.PAD_WIDTH_M[finger]
    pad = body.add_geom(
        name=f"{name}_pad", type=box, mass=const.FINGER_MASS_KG[finger], rgba=_PAD_RGBA, **ARM.arguments
    )
    pad.pos, pad.size = [x, 0.0, const.PAD_CENTRE_M], [half_x, half_y, 0.5 * const.PAD_LENGTH_M]
    pad.friction, pad.condim, pad.solref = const.PAD_FRICTION, 4, HARD_SOLREF
    pad.priority = 1  # rubber decides the friction of what it touches
    rod = body.add_geom(type=box, size=[half_x, half_y, 0.5 * _ROD_LENGTH_M], mass=0, rgba=_HAND_RGBA, **ARM.arguments)
    rod.pos = [x, 0.0, const.HAND_LENGTH_M + 0.5 * _ROD_LENGTH_M]


def _couple_fingers(spec: mujoco.MjSpec) -> None:
    wide, narrow = const.FINGER_NAMES
    tie = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=narrow, name2=wide, solref=HARD_SOLREF)
    tie.objtype = mujoco.mjtObj.mjOBJ_JOINT
    tie.data[:] = 0.0  # in place: how many numbers an equality has depends on MuJoCo's version
    tie.data[1] = 1.0


def _add_motor(spec: mujoco.MjSpec) -> None:
    """Add one motor whose force the two fingers share."""
    tendon = spec.add_tendon(name="fingers")
    for name in const.FINGER_NAMES:
        tendon.wrap_joint(name, 0.5)
    motor = spec.add_actuator(name="gripper", target="fingers", trntype=mujoco.mjtTrn.mjTRN_TENDON)
    motor.set_to_position(kp=2 * const.FINGER_STIFFNESS_N_M, kv=2 * const.FINGER_DAMPING_N_S_M)
    motor.ctrllimited, motor.ctrlrange = True, [0.0, const.FINGER_STROKE_M]
    force = 2 * const.FINGER_FORCE_N
    motor.forcelimited, motor.forcerange = True, [-force, force]
