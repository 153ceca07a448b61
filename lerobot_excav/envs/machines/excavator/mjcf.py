"""The MuJoCo model of machine, ground and target box, assembled from primitive geoms."""

import numpy as np

from lerobot_excav.envs.machines.camera_pictures import add_camera
from lerobot_excav.envs.machines.excavator import bodywork, cameras, surfaces
from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.bodywork import COLLISION_GROUP, STANDING, SURROUNDINGS_GROUP, UNTOUCHED
from lerobot_excav.envs.machines.excavator.grains import add_grains
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.load_picture import add_load
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.container import Container

_GROUND_DROP_M = 0.02
"""The drawn ground lies this far below the real one, so that soil of zero height is not hidden by it."""

_AXIS_UP = (0.0, 0.0, 1.0)
_AXIS_RIGHT = (0.0, -1.0, 0.0)  # turns x towards z: positive angles lift


def build_spec(
    container: Container = TARGET_BOX, *, terrain_spacing_m: float = surfaces.POLICY_SPACING_M
) -> mujoco.MjSpec:
    """Assemble the model, with a target box; the world frame is that of the soil.

    Args:
        container: The box.
        terrain_spacing_m: Between the vertices of the skin `terrain` [m].

    Returns:
        A spec with the joints and actuators of `constants.JOINT_NAMES`, in that order, the bodies
        `house`, `boom`, `arm`, `bucket` and `payload`, the site `cutting_edge`, the cameras `main`, `cab`,
        `overview` and `side`, and the skins `terrain`, `box_soil`, `load` and `grains_…` that draw the soil.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "excavator"
    _set_options(spec)
    bodywork.add_materials(spec)
    _add_ground(spec)
    _add_box(spec, container)
    _add_machine(spec)
    surfaces.add_soil(spec, container, spacing_m=terrain_spacing_m)
    add_load(spec)
    add_grains(spec)
    return spec


def _set_options(spec: mujoco.MjSpec) -> None:
    spec.compiler.degree = False
    spec.option.timestep = const.SUBSTEP_S
    spec.option.gravity = [0.0, 0.0, -const.GRAVITY_M_S2]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # A diverged state must be seen, not silently replaced by the initial one.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    spec.visual.quality.offsamples = 0
    spec.visual.quality.shadowsize = 0
    spec.visual.quality.numslices = 14
    spec.visual.quality.numstacks = 6
    spec.visual.map.znear = 0.05
    spec.visual.map.zfar = 12.0
    spec.stat.extent = 5.0
    spec.stat.center = [-1.0, 1.0, 0.5]
    spec.visual.headlight.ambient = [0.34, 0.35, 0.37]
    spec.visual.headlight.diffuse = [0.10, 0.10, 0.10]
    spec.visual.headlight.specular = [0.0, 0.0, 0.0]


def _add_ground(spec: mujoco.MjSpec) -> None:
    world = spec.worldbody
    sky = spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    sky.builtin = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    sky.rgb1, sky.rgb2 = [0.45, 0.62, 0.82], [0.80, 0.84, 0.86]
    sky.width, sky.height = 32, 192
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    world.add_geom(name="ground", type=plane, size=[0.0, 0.0, 1.0], group=COLLISION_GROUP, **STANDING)
    picture = world.add_geom(name="ground_picture", type=plane, size=[40.0] * 3, group=SURROUNDINGS_GROUP, **UNTOUCHED)
    picture.pos, picture.material = [0.0, 0.0, -_GROUND_DROP_M], "ground"
    world.add_light(name="sun", type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, castshadow=False)
    add_camera(world, "main", cameras.MAIN)
    add_camera(world, "overview", cameras.OVERVIEW)


def _add_box(spec: mujoco.MjSpec, container: Container) -> None:
    """Add the target box: a floor and four walls that stand outside the container's half extent."""
    half_x, half_y = container.half_extent_m
    thickness, height = const.BOX_WALL_THICKNESS_M, container.wall_height_m
    yaw = container.yaw_rad
    quat = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
    body = spec.worldbody.add_body(name="box", pos=list(container.center_w), quat=quat)
    side, up = thickness / 2, height / 2
    outer_x = half_x + thickness
    panels = {
        "box_floor": ((0.0, 0.0, -0.005), (half_x, half_y, 0.005)),
        "box_wall_front": ((half_x + side, 0.0, up), (side, half_y, up)),
        "box_wall_back": ((-half_x - side, 0.0, up), (side, half_y, up)),
        "box_wall_left": ((0.0, half_y + side, up), (outer_x, side, up)),
        "box_wall_right": ((0.0, -half_y - side, up), (outer_x, side, up)),
    }
    for name, (pos, size) in panels.items():
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=list(pos),
            size=list(size),
            mass=0.0,  # it stands still
            group=SURROUNDINGS_GROUP,
            material="box_floor" if name == "box_floor" else "box",
            **STANDING,
        )


def _add_machine(spec: mujoco.MjSpec) -> None:
    carrier = spec.worldbody.add_body(name="undercarriage", pos=const.MACHINE_POS_W)
    carrier.mass, carrier.inertia = const.UNDERCARRIAGE_MASS_KG, [1.0, 1.0, 1.0]
    carrier.explicitinertial = True
    house = _add_link(spec, carrier, 0)
    boom = _add_link(spec, house, 1)
    arm = _add_link(spec, boom, 2)
    bucket = _add_link(spec, arm, 3)
    bucket.add_site(name="cutting_edge", pos=[const.BUCKET_LENGTH_M, 0.0, 0.0], group=5)
    _add_payload(bucket)
    add_camera(house, "cab", cameras.CAB)
    add_camera(house, "side", cameras.SIDE)
    bodywork.dress_undercarriage(carrier)
    bodywork.dress_house(house)
    bodywork.dress_boom(boom)
    bodywork.dress_arm(arm)
    bodywork.dress_bucket(spec, bucket)
    bodywork.add_cylinders(spec)


_LINKS = (
    ("house", (0.0, 0.0, const.SWING_HEIGHT_M), const.HOUSE_MASS_KG, const.HOUSE_COM_S, const.HOUSE_INERTIA_KGM2),
    ("boom", const.BOOM_PIN_S, const.BOOM_MASS_KG, const.BOOM_COM_M, const.BOOM_INERTIA_KGM2),
    ("arm", (const.BOOM_LENGTH_M, 0.0, 0.0), const.ARM_MASS_KG, const.ARM_COM_M, const.ARM_INERTIA_KGM2),
    ("bucket", (const.ARM_LENGTH_M, 0.0, 0.0), const.BUCKET_MASS_KG, const.BUCKET_COM_T, const.BUCKET_INERTIA_KGM2),
)


def _add_link(spec: mujoco.MjSpec, parent: mujoco.MjsBody, joint: int) -> mujoco.MjsBody:
    """Add a body with its joint and its position servo."""
    body_name, pos, mass_kg, com, inertia_kgm2 = _LINKS[joint]
    body = parent.add_body(name=body_name, pos=pos)
    body.mass, body.ipos, body.inertia = mass_kg, com, inertia_kgm2
    body.explicitinertial = True
    # The hydraulics carry the links' own weight. The share of each joint counts as actuator torque (actgravcomp)
    # and stays inside its torque limit, so the machine is not stronger for it; payload and soil are not carried.
    body.gravcomp = 1.0
    name, torque = const.JOINT_NAMES[joint], const.JOINT_TORQUE_NM[joint]
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=list(_AXIS_UP if joint == 0 else _AXIS_RIGHT),
        range=list(const.JOINT_RANGE_RAD[joint]),
        limited=True,
        actgravcomp=True,
        actfrclimited=True,
        actfrcrange=[-torque, torque],
    )
    stiffness, damping = const.SERVO_STIFFNESS_NM_RAD[joint], const.SERVO_DAMPING_NMS_RAD[joint]
    actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=stiffness, kv=damping)
    actuator.forcelimited, actuator.forcerange = True, [-torque, torque]
    return body


def _add_payload(bucket: mujoco.MjsBody) -> None:
    """Add the body that stands for the soil in the bucket; its inertial values are written at run time."""
    payload = bucket.add_body(name="payload")
    # The com must differ from the origin here, or the compiler marks the frames as coinciding and later
    # changes of `body_ipos` are ignored.
    payload.mass, payload.ipos, payload.inertia = 1.0, list(const.BUCKET_COM_T), [1.0, 1.0, 1.0]
    payload.explicitinertial = True
