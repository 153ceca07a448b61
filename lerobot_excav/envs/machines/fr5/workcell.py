"""The work cell in motion: arm, gripper and blocks under joint position targets."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.features import ACTION_HIGH, ACTION_LOW
from lerobot_excav.envs.machines.fr5.geoms import ARM
from lerobot_excav.envs.machines.fr5.mjcf import build_model
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.errors import ConfigurationError, ExcavError

ACTION_SIZE = len(ACTION_LOW)  # six joint position targets [rad], gripper target [0..1]
_SUBSTEPS = round(const.TICK_S / const.SUBSTEP_S)
_SETTLE_TICKS = 10  # 0.2 s, for blocks to find their contact with the table

_CTRL_SCALE = np.append(np.ones(6), const.FINGER_STROKE_M)  # from an action to what the servos are given [rad, m]
_REFERENCE_STEP = const.SUBSTEP_S * np.append(const.JOINT_SPEED_RAD_S, const.FINGER_SPEED_M_S / const.FINGER_STROKE_M)
"""How far the servos' reference may move in a substep: the speed limits [rad, 1]."""
_REFERENCE_LEAD_RAD = np.array(const.JOINT_DAMPING) / const.JOINT_STIFFNESS * const.JOINT_SPEED_RAD_S
"""How far it may be ahead of a joint: there the servo's stiffness and damping balance at the speed limit [rad]. Without
this a joint that could not follow would catch up at several times that speed."""


@dataclass(frozen=True, kw_only=True)
class WorkcellStart:
    """Places, colours and light of the work cell. Its arrays are read-only.

    Attributes:
        joint_pos: Joint positions of the arm [rad], (6,).
        block_pos_w: Centres of the blocks [m], (4, 3), world frame.
        block_yaw: Turn of the blocks about z [rad], (4,).
        block_rgb: Colours of the blocks, (4, 3), each channel in [0, 1].
        table_rgb: Colour of the table, (3,).
        light_dir_w: Direction of the light, (3,).
        light: Brightness of the light, 0 to 1.
    """

    joint_pos: NDArray[np.float64]
    block_pos_w: NDArray[np.float64]
    block_yaw: NDArray[np.float64]
    block_rgb: NDArray[np.float64]
    table_rgb: NDArray[np.float64]
    light_dir_w: NDArray[np.float64]
    light: float


class Workcell:
    """Arm, gripper, four blocks and a tray.

    Attributes:
        model: MuJoCo model.
        data: Its state.
    """

    def __init__(self) -> None:
        self.model = build_model()
        self.data = mujoco.MjData(self.model)
        names = (*const.JOINT_NAMES, *const.FINGER_NAMES)
        self._qpos = np.array([self.model.joint(name).qposadr[0] for name in names])
        self._qvel = np.array([self.model.joint(name).dofadr[0] for name in names])
        blocks = [f"block{i}" for i in range(layout.BLOCK_COUNT)]
        self._block_bodies = np.array([self.model.body(name).id for name in blocks])
        self._block_qpos = np.array([self.model.joint(name).qposadr[0] for name in blocks])
        self._block_qvel = np.array([self.model.joint(name).dofadr[0] for name in blocks])
        self._block_geoms = {self.model.geom(name).id: i for i, name in enumerate(blocks)}
        self._pads = {self.model.geom(f"{name}_pad").id: i for i, name in enumerate(const.FINGER_NAMES)}
        self._reference: NDArray[np.float64] = np.zeros(ACTION_SIZE)

    def reset(self, start: WorkcellStart) -> None:
        """Put the cell into a starting state, at rest."""
        mujoco.mj_resetData(self.model, self.data)
        self._paint(start)
        for i, (position_w, yaw) in enumerate(zip(start.block_pos_w, start.block_yaw, strict=True)):
            first = self._block_qpos[i]
            self.data.qpos[first : first + 7] = [*position_w, np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)]
        self.data.qpos[self._qpos[:6]] = start.joint_pos
        self.data.qpos[self._qpos[6:]] = const.FINGER_STROKE_M
        self._reference = np.append(start.joint_pos, 1.0)
        mujoco.mj_forward(self.model, self.data)
        for _ in range(_SETTLE_TICKS):
            self.tick(np.append(start.joint_pos, 1.0))
        self.data.time = 0.0

    def tick(self, action: NDArray[np.float64]) -> None:
        """Advance by one control tick of 0.02 s.

        What the servos follow moves towards the targets at no more than the speed limits of joints and fingers, and
        leads a drive that falls behind by a bounded distance only. Speeds stay within about 1.2 times the limits where
        the arm moves freely; an impact on table or blocks exceeds them for a moment.

        Args:
            action: Joint position targets [rad] and gripper target [0..1], (7,); clipped to what the arm can do.

        Raises:
            ConfigurationError: The action has another shape or is not finite.
            ExcavError: The simulation has diverged.
        """
        action = np.asarray(action, dtype=np.float64)
        # Not by `require`: to word the message takes a fifth of a tick, and it is hardly ever needed.
        if action.shape != (ACTION_SIZE,) or not np.isfinite(action).all():
            raise ConfigurationError(
                f"action={action!r} is not possible; give {ACTION_SIZE} finite numbers: six joint positions [rad] "
                "and the gripper's opening [0..1]"
            )
        target = np.clip(action, ACTION_LOW, ACTION_HIGH)
        for _ in range(_SUBSTEPS):
            self._lead_to(target)
            mujoco.mj_step(self.model, self.data)
        if self.data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise ExcavError(f"the simulation diverged at {self.data.time:.3f} s; report this scene and action")

    @property
    def reference(self) -> NDArray[np.float64]:
        """What the servos follow now, in the form of an action (7,); as a target it keeps arm and grip as they are."""
        return self._reference.copy()

    @property
    def joint_pos(self) -> NDArray[np.float64]:
        """Joint positions [rad], (6,)."""
        return np.array(self.data.qpos[self._qpos[:6]])

    @property
    def joint_vel(self) -> NDArray[np.float64]:
        """Joint velocities [rad/s], (6,)."""
        return np.array(self.data.qvel[self._qvel[:6]])

    @property
    def joint_torque(self) -> NDArray[np.float64]:
        """Torque of each joint's drive, weight included [N m], (6,)."""
        return np.array(self.data.qfrc_actuator[self._qvel[:6]])

    @property
    def opening(self) -> float:
        """Opening of the gripper: 0 closed, 1 open (120 mm)."""
        return float(np.mean(self.data.qpos[self._qpos[6:]]) / const.FINGER_STROKE_M)

    @property
    def agent_pos(self) -> NDArray[np.float32]:
        """What the policy feels: joint positions [rad] and opening, (7,) float32."""
        return np.append(self.joint_pos, self.opening).astype(np.float32)

    @property
    def grasp_pos_w(self) -> NDArray[np.float64]:
        """Point between the pads [m], (3,), world frame."""
        return np.array(self.data.site("grasp").xpos)

    @property
    def block_pos_w(self) -> NDArray[np.float64]:
        """Centres of the blocks [m], (4, 3), world frame."""
        return np.array(self.data.xpos[self._block_bodies])

    @property
    def block_speed(self) -> NDArray[np.float64]:
        """Speed of each block's centre [m/s], (4,)."""
        return np.array([np.linalg.norm(self.data.qvel[start : start + 3]) for start in self._block_qvel])

    def fingers_touching(self) -> NDArray[np.bool_]:
        """Return which finger's pad touches which block, (2, 4): wide and narrow finger, blocks."""
        touching = np.zeros((len(self._pads), layout.BLOCK_COUNT), dtype=bool)
        for part, block in self._block_contacts():
            if part in self._pads:
                touching[self._pads[part], block] = True
        return touching

    def arm_touching(self) -> NDArray[np.bool_]:
        """Return which blocks any part of arm or gripper touches, (4,)."""
        touched = [block for part, block in self._block_contacts() if self.model.geom_group[part] == ARM.group]
        return np.isin(range(layout.BLOCK_COUNT), touched)

    def _block_contacts(self) -> Iterator[tuple[int, int]]:
        """Yield every contact of a block: the geom that touches it, and the block's index."""
        for pair in self.data.contact.geom[: self.data.ncon]:
            for part, block in (pair, pair[::-1]):
                if block in self._block_geoms:
                    yield part, self._block_geoms[block]

    def _lead_to(self, target: NDArray[np.float64]) -> None:
        """Move the servos' reference towards a target, within what the speed limits allow."""
        step = np.clip(target - self._reference, -_REFERENCE_STEP, _REFERENCE_STEP)
        self._reference = self._reference + step
        joint_pos = self.data.qpos[self._qpos[:6]]
        low, high = joint_pos - _REFERENCE_LEAD_RAD, joint_pos + _REFERENCE_LEAD_RAD
        self._reference[:6] = np.clip(self._reference[:6], low, high)
        self.data.ctrl[:] = self._reference * _CTRL_SCALE

    def _paint(self, start: WorkcellStart) -> None:
        for i, rgb in enumerate(start.block_rgb):
            self.model.geom(f"block{i}").rgba = [*rgb, 1.0]
        self.model.geom("table").rgba = [*start.table_rgb, 1.0]
        lamp = self.model.light("lamp")
        lamp.dir, lamp.diffuse = start.light_dir_w, [start.light] * 3
