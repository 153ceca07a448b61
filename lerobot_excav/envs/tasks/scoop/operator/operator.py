"""The scripted operator: digs any target of any scene through the four joysticks."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import JOINT_SPEED_RAD_S
from lerobot_excav.envs.tasks.scoop.cycle import LOADING_ONSET_KG
from lerobot_excav.envs.tasks.scoop.operator.dig import plan_dig
from lerobot_excav.envs.tasks.scoop.operator.motion import CarefulMotion, JointMotion
from lerobot_excav.envs.tasks.scoop.operator.moving_start import MovingStart
from lerobot_excav.envs.tasks.scoop.operator.plan import plan_carry, plan_curl, plan_dump, plan_lift
from lerobot_excav.envs.tasks.scoop.operator.reach import bucket_pose, joint_pos_near
from lerobot_excav.envs.tasks.scoop.operator.sight import Sight
from lerobot_excav.envs.tasks.scoop.operator.variation import Tremor, Variation, draw_variation

PHASES = ("reach", "cut", "curl", "lift", "carry", "dump", "rest")

# How the hand follows the plan (kind: tuned).
TRACKING_TIME_S = 0.3
"""Time in which a deviation from the plan is made up [s]."""
ARRIVAL_TOLERANCE_RAD = 0.04
OVERTIME_S = 0.8
"""How long to wait for the machine after a motion should have ended [s], for instance when the bucket stalls."""
AT_REST_RAD_S = 0.01
"""Speed of a joint below which it stands [rad/s]; after a pause it has less than 1e-5 (kind: derived)."""
FULL_KG = 470.0
"""Payload at which the cut is broken off [kg]."""


class DigOperator:
    """Digs the commanded target, issuing only joystick commands.

    It sees the true state of the worksite, plans the path of the bucket in cylinder coordinates around the swing axis
    and follows it with rate commands. Style and tremor, drawn from `rng`, differ from cycle to cycle. A new cycle makes
    it plan again at once, and so does another target within a cycle as long as it has not loaded; else it first dumps
    what it carries.
    """

    def __init__(self, *, rng: np.random.Generator) -> None:
        self._rng = rng
        self._phase = len(PHASES) - 1

    def reset(self, env: Sight) -> None:
        """Begin the running cycle of an environment with a newly drawn style."""
        self._variation: Variation = draw_variation(self._rng, phase_count=len(PHASES))
        self._tremor = Tremor(self._rng, size=self._variation.tremor)
        self._cycle = env.cycle
        self._plan(env)

    @property
    def approach_s(self) -> float:
        """How long after the newest command the cutting edge is to be where the cut begins [s]."""
        return self._approach_s

    @property
    def phase(self) -> str:
        """What the operator is doing, one of `PHASES`."""
        return PHASES[self._phase]

    @property
    def done(self) -> bool:
        """Whether the cycle is over and the operator rests."""
        return self.phase == "rest"

    def act(self, env: Sight) -> NDArray[np.float32]:
        """Return the joystick command for the next frame: swing, boom, arm, bucket in [-1, 1], (4,) float32."""
        is_other_target = env.cycle.target_id != self._target_id
        if env.cycle is not self._cycle or (is_other_target and self.done):
            self.reset(env)
        elif is_other_target and self.phase in ("reach", "cut"):
            self._plan(env)
        joint_pos = env.worksite.machine.joint_pos
        if self._phase_is_over(joint_pos, env):
            self._begin(self._phase + 1, env)
        tremor = self._tremor.step(1.0 / env.fps)
        if self.done or self._time_s < 0.0:
            self._time_s += 1.0 / env.fps
            return np.zeros(4, dtype=np.float32)
        # Aim at the middle of the frame: the command holds until its end.
        wanted_pos, _ = self._motion.at(self._time_s)
        _, wanted_vel = self._motion.at(self._time_s + 0.5 / env.fps)
        self._time_s += 1.0 / env.fps
        rate = wanted_vel + (wanted_pos - joint_pos) / TRACKING_TIME_S
        command = np.clip(rate / np.asarray(JOINT_SPEED_RAD_S) + tremor, -1.0, 1.0)
        return np.asarray(command, dtype=np.float32)

    def _plan(self, env: Sight) -> None:
        """Plan how to dig the commanded target in the present style, from where the machine is."""
        self._target_id = env.cycle.target_id
        self._dig = plan_dig(env.worksite.soil, env.cycle.target, self._variation)
        self._begin(0, env)
        self._approach_s = self._motion.duration_s - self._time_s  # the pause before it counts

    def _begin(self, phase: int, env: Sight) -> None:
        """Start a phase from where the machine is, after the style's pause; a way that begins in motion has none."""
        self._phase = phase
        self._time_s = -self._variation.pauses_s[phase]
        if self.done:
            return
        machine = env.worksite.machine
        self._motion: JointMotion | CarefulMotion | MovingStart
        if self.phase == "cut" and self._dig.is_scrape:
            self._motion = CarefulMotion(self._joint_path(machine.joint_pos), speed=self._variation.speed)
        elif self.phase == "reach" and np.abs(machine.joint_vel).max() > AT_REST_RAD_S:
            self._time_s = 0.0
            self._motion = MovingStart(machine.joint_pos, machine.joint_vel, self._brisk_motion_from)
        else:
            self._motion = self._brisk_motion_from(machine.joint_pos)

    def _brisk_motion_from(self, joint_pos: NDArray[np.float64]) -> JointMotion:
        """Plan the motion of the present phase from a joint position at which the machine rests."""
        return JointMotion(self._joint_path(joint_pos), speed=self._variation.speed)

    def _joint_path(self, joint_pos: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Plan the present phase's path from a joint position."""
        present = bucket_pose(joint_pos)
        if self.phase == "reach":
            return list(np.linspace(joint_pos, joint_pos_near(self._dig.poses[0]), 24))
        if self.phase == "cut":
            return [joint_pos, *(joint_pos_near(pose) for pose in self._dig.poses[1:])]
        plans = {
            "curl": lambda: plan_curl(present),
            "lift": lambda: plan_lift(present),
            "carry": lambda: plan_carry(present, self._variation),
            "dump": lambda: plan_dump(present, self._variation),
        }
        return [joint_pos, *(joint_pos_near(pose, keep="pin") for pose in plans[self.phase]()[1:])]

    def _phase_is_over(self, joint_pos: NDArray[np.float64], env: Sight) -> bool:
        if self.done:
            return False
        payload_kg = env.worksite.soil.payload_mass_kg
        if self.phase == "cut" and payload_kg >= FULL_KG:
            return True
        if self._time_s < self._motion.duration_s:
            return False
        if self.phase == "dump" and payload_kg >= LOADING_ONSET_KG:
            return self._time_s > self._motion.duration_s + 3.0
        if self.phase == "cut":
            # The edge is in the soil and may never arrive. To wait there, with hardly a command, is a state in which a
            # policy that learns from pictures of single moments stays for ever: seen in its rollouts.
            return True
        arrived = bool(np.max(np.abs(self._motion.end - joint_pos)) < ARRIVAL_TOLERANCE_RAD)
        return arrived or self._time_s > self._motion.duration_s + OVERTIME_S
