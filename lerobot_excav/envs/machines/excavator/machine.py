"""The excavator as a physical machine: commands and soil reactions in, joint motion out."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry
from lerobot_excav.envs.machines.excavator.control import RateControl, checked_action
from lerobot_excav.envs.machines.excavator.digging import JointResistance
from lerobot_excav.envs.machines.excavator.impact import SoilImpact
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.mjcf import build_spec
from lerobot_excav.envs.machines.excavator.payload import Payload
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.container import Container
from lerobot_excav.envs.soil.tool import Reaction, Tool
from lerobot_excav.errors import ConfigurationError, ExcavError

SUBSTEPS = round(const.TICK_S / const.SUBSTEP_S)
if abs(SUBSTEPS * const.SUBSTEP_S - const.TICK_S) > 1e-6:
    raise ConfigurationError(f"SUBSTEP_S={const.SUBSTEP_S} does not divide TICK_S={const.TICK_S}")

_DIVERGENCE = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)


class ExcavatorMachine:
    """An excavator on a fixed base, with rate-controlled swing, boom, arm and bucket.

    Attributes:
        model: The compiled MuJoCo model.
        data: Its state.
        container: The target box beside it.
        box_contact_force_n: Greatest normal force between machine and target box during the last tick, summed over
            contacts.
    """

    def __init__(self, *, container: Container = TARGET_BOX) -> None:
        self.container = container
        self.model = build_spec(container).compile()
        self.data = mujoco.MjData(self.model)
        # What the skins of the model show of the soil, part by part; all pictures of it share them.
        self.soil_shown: dict[str, NDArray[np.float64]] = {}
        self._troubles = [self.data.warning[kind] for kind in _DIVERGENCE]
        self._control = RateControl()
        self._resistance = JointResistance(self.model)
        self._payload = Payload(self.model)
        self._impact = SoilImpact(self.model)
        self._geometry = bucket_geometry()
        self._bucket = self.model.body("bucket").id
        self._edge_site = self.model.site("cutting_edge").id
        self._is_box_geom = self.model.geom_bodyid == self.model.body("box").id
        self.box_contact_force_n = 0.0
        self.set_appearance(Appearance())
        self.reset(np.array([0.0, 0.5, -1.8, -0.6]))

    def reset(self, joint_pos: NDArray[np.float64]) -> None:
        """Restart at rest in a pose (4,) [rad] with an empty bucket, independent of everything that happened before.

        Raises:
            ConfigurationError: Wrong shape, or an angle that is not finite or outside its joint's range.
        """
        joint_pos = _checked_joint_pos(joint_pos)
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = joint_pos
        self.data.ctrl[:] = joint_pos
        self._payload.reset()
        self._resistance.reset()
        self._control.reset(joint_pos)
        self.box_contact_force_n = 0.0
        mujoco.mj_forward(self.model, self.data)

    def tick(self, action: NDArray[np.float64], reaction: Reaction) -> None:
        """Advance by exactly `constants.TICK_S` in substeps of `constants.SUBSTEP_S`.

        Args:
            action: Rate commands for swing, boom, arm, bucket as fractions of full speed, shape (4,); values
                outside [-1, 1] are clipped.
            reaction: What the soil does to the bucket, from its pose and velocity at the start of the tick.

        Raises:
            ConfigurationError: The action has the wrong shape or a value that is not finite.
            ExcavError: The simulation diverged.
        """
        command, model, data = checked_action(action), self.model, self.data
        joint_pos, set_points, applied = data.qpos, data.ctrl, data.qfrc_applied
        self._resistance.set_reaction(reaction, data)
        self._impact.set_reaction(reaction)
        self.box_contact_force_n = 0.0
        for remaining in range(SUBSTEPS, 0, -1):
            self._payload.approach(reaction.payload_mass_kg, reaction.payload_com_t, remaining)
            self._control.step(command, joint_pos, const.SUBSTEP_S, set_points)
            mujoco.mj_step1(model, data)
            applied[:] = 0.0
            self._payload.apply_momentum(data)
            self._impact.apply(data)
            self._resistance.apply(data)
            mujoco.mj_step2(model, data)
            if data.ncon:
                self.box_contact_force_n = max(self.box_contact_force_n, self._box_force_now_n())
        # Step 2 leaves poses and velocities of bodies at the start of the substep: bring them up to date.
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        self._check_finite()

    def set_appearance(self, appearance: Appearance) -> None:
        """Apply the colours and the light of a scene; physics is not touched."""
        model = self.model
        box = np.array(appearance.box_rgb)
        colours = {
            "soil": appearance.soil_rgb,
            "grains": appearance.soil_rgb,
            "machine": appearance.machine_rgb,
            "ground": appearance.ground_rgb,
            "box": box,
            "box_floor": 0.6 * box,
        }
        for name, rgb in colours.items():
            model.mat_rgba[model.material(name).id, :3] = rgb
        sun = model.light("sun").id
        direction = np.array(appearance.light_dir_w)
        model.light_dir[sun] = direction / np.linalg.norm(direction)
        model.light_diffuse[sun] = appearance.light_intensity
        model.light_specular[sun] = 0.2 * appearance.light_intensity
        mujoco.mj_camlight(model, self.data)

    @property
    def joint_pos(self) -> NDArray[np.float64]:
        """Swing, boom, arm, bucket [rad], shape (4,)."""
        return np.array(self.data.qpos)

    @property
    def joint_vel(self) -> NDArray[np.float64]:
        """Rates of swing, boom, arm, bucket [rad/s], shape (4,)."""
        return np.array(self.data.qvel)

    @property
    def cutting_edge_pos_w(self) -> NDArray[np.float64]:
        """Middle of the cutting edge in the world [m], shape (3,)."""
        return np.array(self.data.site_xpos[self._edge_site])

    @property
    def payload_mass_kg(self) -> float:
        """Mass that the bucket carries in the dynamics, which follows the soil's with a ramp [kg]."""
        return self._payload.mass_kg

    def tool(self) -> Tool:
        """Return the bucket as the soil sees it: geometry, pose and velocity now."""
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_XBODY, self._bucket, velocity, 0)
        return Tool.of_machine(
            self._geometry,
            np.array(self.data.xmat[self._bucket]).reshape(3, 3),
            position_w=np.array(self.data.xpos[self._bucket]),
            linear_velocity_w=velocity[3:],
            angular_velocity_w=velocity[:3],
        )

    def _box_force_now_n(self) -> float:
        """Sum of the normal forces of all contacts with the target box [N]."""
        force, total = np.zeros(6), 0.0
        for i in np.flatnonzero(self._is_box_geom[self.data.contact.geom].any(axis=1)):
            mujoco.mj_contactForce(self.model, self.data, i, force)
            total += force[0]
        return total

    def _check_finite(self) -> None:
        if any(trouble.number for trouble in self._troubles):
            raise ExcavError(
                f"the machine diverged at t={self.data.time:.3f} s with qpos={self.data.qpos.tolist()}; "
                "please report the actions that led there"
            )


def _checked_joint_pos(joint_pos: object) -> NDArray[np.float64]:
    array = np.asarray(joint_pos, dtype=np.float64)
    if array.shape != (4,):
        raise ConfigurationError(f"joint_pos has shape {array.shape}; allowed: (4,) for {', '.join(const.JOINT_NAMES)}")
    for name, value, (lower, upper) in zip(const.JOINT_NAMES, array, const.JOINT_RANGE_RAD, strict=True):
        if not lower - 1e-9 <= value <= upper + 1e-9:
            raise ConfigurationError(
                f"joint_pos of {name}={value} rad is outside {lower:.3f} ... {upper:.3f} rad; "
                "choose angles with kinematics.inverse, which returns None where the machine cannot go"
            )
    return array
