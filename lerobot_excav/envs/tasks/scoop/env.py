"""The excavator as a gymnasium environment."""

from dataclasses import astuple, replace
from typing import Any, cast, override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.control import checked_action
from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.machines.excavator.rehearsal import rehearse
from lerobot_excav.envs.machines.excavator.rendering import WorksiteRenderer
from lerobot_excav.envs.machines.excavator.viewing import WorksiteView
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.shot import Shot
from lerobot_excav.envs.masks.source import Pixels
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.planner.candidates import Candidates, rate
from lerobot_excav.envs.tasks.planner.plan import Plan, plan_targets
from lerobot_excav.envs.tasks.planner.surface import SeenSurface
from lerobot_excav.envs.tasks.relief import Relief
from lerobot_excav.envs.tasks.scoop.cycle import DigCycle
from lerobot_excav.envs.tasks.scoop.environment_state import environment_state
from lerobot_excav.envs.tasks.scoop.plan_view import draw_plan, height_colours
from lerobot_excav.envs.tasks.scoop.region_pixels import region_pixels, require_pointable
from lerobot_excav.envs.tasks.scoop.scene import Scene
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.envs.tasks.scoop.stage import start_of
from lerobot_excav.envs.tasks.scoop.targets import Target
from lerobot_excav.envs.tasks.selection import Selection, TargetAbsentError
from lerobot_excav.errors import require

# Reward scale: a full bucket of sand [kg] (reference figure of the paper's operator; kind: paper).
FULL_BUCKET_KG = 485.0


class ExcavatorEnv(MaskedTaskEnv[Worksite, WorksiteRenderer]):
    """An 8-t excavator in front of a pile, with a box to its left.

    Task (`Scoop-v0`): one dig-load-dump cycle on the region that the target mask shows.

    Scene and randomisation: pile shape and mass, colours, light, initial joint angles and the four targets come from
    `scene_set` and the scene's number. At a later `stage` (an option of `reset`) a seeded operator has dug that many
    cycles before: the pile is what it left, the box holds what it brought, the machine stands where it dumped.

    Observation:

    | key | shape, type | meaning |
    |---|---|---|
    | `pixels/main` | (H, W, 3) uint8 | fixed, raised view of the dig area |
    | `pixels/cab` | (H, W, 3) uint8 | view along the boom, turns with the house |
    | `pixels/target_mask` | (H, W, 3) uint8, {0, 255} | commanded dig region in `main` when it was commanded |
    | `agent_pos[0:4]` | float32 | joint positions swing, boom, arm, bucket [rad] |
    | `agent_pos[4:8]` | float32 | joint velocities in the same order [rad/s] |
    | `environment_state` | (151,) float32 | with `obs_type="state"`, in place of pictures: region, loads, heights |

    Action: float32 (4,) in [-1, 1], rate commands for swing, boom, arm, bucket; values beyond are clipped.

    Reward: gain of soil in the box divided by 485 kg, plus 1 on success.

    Success: at loading onset the cutting edge was inside the patch, at least 100 kg lie in the box, the bucket has been
    empty for 0.5 s and nothing of the machine hit the box hard. `info["is_success"]` is true only then.

    Termination: the cycle is complete (bucket emptied into the box). Truncation: the time limit `episode_length`.

    Arguments: those of `MaskedTaskEnv` and, as settings, the fields of `ExcavatorSettings`. `soil` takes the name of a
    preset or `SoilParameters` of one's own.
    """

    TASK = "Scoop-v0"

    _cycle: DigCycle

    @property
    def worksite(self) -> Worksite:
        """Machine, soil and box."""
        return self.world

    @property
    def cycle(self) -> DigCycle:
        """The running cycle.

        Raises:
            ConfigurationError: The environment has not been reset.
        """
        self._require_episode()
        return self._cycle

    @property
    def scene(self) -> Scene:
        """The scene of the running episode."""
        return self.cycle.scene

    @property
    def target(self) -> Target:
        """The commanded dig region."""
        return self.cycle.target

    @property
    def _excavator_settings(self) -> ExcavatorSettings:
        return cast(ExcavatorSettings, self.settings)

    def _make_world(self) -> Worksite:
        rehearse()
        settings = self._excavator_settings
        return Worksite(soil=settings.dug_soil, fidelity=settings.fidelity)

    def _make_renderer(self, world: Worksite, height: int, width: int) -> WorksiteRenderer:
        return WorksiteRenderer(world, height=height, width=width)

    def _make_view(self, height: int, width: int) -> WorksiteView:
        return WorksiteView(self.worksite, height=height, width=width)

    def _visible_target(self, target_id: int) -> NDArray[np.float64]:
        return self.scene.targets[target_id].corners_w

    def _measured(self) -> tuple[str, ...]:
        state, above_m = self.cycle.state, self.worksite.bucket_height_m
        height = f"edge {above_m:.1f} m up" if above_m > 0.0 else "edge in the soil"
        return f"load {state.bucket_mass_kg:.0f} kg", f"in the box {state.deposited_mass_kg:.0f} kg", height

    def _failure(self) -> str | None:
        return self.cycle.failure or ("not emptied in time" if self.is_over and not self.is_success else None)

    def _start(self, selection: Selection) -> None:
        scene = self._draw_start(selection)
        if selection.target_id >= (count := len(scene.targets)):
            raise TargetAbsentError(
                f"target_id={selection.target_id} is not possible: scene {selection.scene_id} has {count} regions at "
                f"stage {selection.stage}; give a lower number, or an earlier stage"
            )
        self.worksite.reset(scene)
        self._cycle = DigCycle(self.worksite, scene, selection.target_id)

    def _draw_start(self, selection: Selection) -> Scene:
        """Return the scene as it is at the chosen stage."""
        return start_of(self._excavator_settings, selection.scene_id, selection.stage)

    def _advance(self, action: NDArray[Any]) -> tuple[float, bool]:
        command, cycle = checked_action(action), self.cycle
        deposited_before_kg = cycle.state.deposited_mass_kg
        for _ in range(self._ticks_per_frame):
            self.worksite.tick(command)
            cycle.update()
        gain = (cycle.state.deposited_mass_kg - deposited_before_kg) / FULL_BUCKET_KG
        return gain + float(cycle.is_success), cycle.is_complete

    def holding_action(self) -> NDArray[np.float32]:
        """Return the action that holds the machine still."""
        return np.zeros(4, np.float32)

    def _region(self, target_id: int) -> Target:
        return self.scene.targets[target_id]

    def _begin_command(self, target_id: int) -> None:
        require(target_id < self._target_count, f"commands: this stage of the scene offers no target {target_id}")
        self.cycle.retarget(target_id)

    @property
    def _target_count(self) -> int:
        return len(self.scene.targets)

    @override
    def plan_view(self) -> NDArray[np.uint8]:
        """Return the dig area from above, the machine below it; see `plan_view.draw_plan`."""
        shown = dict(enumerate(self.scene.targets[: self.task_spec.target_count])) | {self.target_id: self.target}
        return draw_plan(self.worksite, shown, self.target_id)

    @override
    def relief(self) -> Relief:
        """Return the soil of the dig area."""
        soil = self.worksite.soil
        heights_m = soil.heights_m.copy()
        return Relief(x_w=soil.x_w, y_w=soil.y_w, height_m=heights_m, rgb=height_colours(heights_m))

    @override
    def place_w(self, command: Command) -> NDArray[np.float64]:
        """Return the middle of the commanded region, (3,) [m]."""
        region: Target = command.region
        return region.center_w

    @override
    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> Pixels:
        """Return the pixels of a shot that show the soil of the region around a place; the machine is no soil."""
        return region_pixels(place_w, shot)

    @override
    def words(self, command: Command) -> str:
        """Return what people call what is dug in."""
        return "the pile of sand"

    @override
    def places_w(self) -> NDArray[np.float64]:
        """Return the points (H, W, 3) [m] of the soil behind the pixels of `main`, machine or not; NaN beside it."""
        return self.renderer.terrain_points_w()

    @override
    def _target_at(self, place_w: NDArray[np.float64]) -> int:
        """Make a region around a place of the ground a further target of the scene."""
        require_pointable(place_w)
        region = Target(center_w=place_w.copy(), yaw_rad=cylinder_from_world(place_w)[1])
        self.cycle.scene = replace(self.scene, targets=(*self.scene.targets, region))
        return len(self.scene.targets) - 1

    @override
    def _move_target(self, target_id: int, place_w: NDArray[np.float64]) -> None:
        """Make a region around a place the target of this number."""
        region = Target(center_w=place_w.copy(), yaw_rad=cylinder_from_world(place_w)[1])
        targets = [region if number == target_id else old for number, old in enumerate(self.scene.targets)]
        self.cycle.scene = replace(self.scene, targets=tuple(targets))
        self.cycle.retarget(target_id)

    def planned(self, surface: SeenSurface) -> Plan:
        """Return what the planner of pile clearing proposes for a surface."""
        return plan_targets(surface, self._excavator_settings.zones)

    def rated(self, places_w: NDArray[np.float64], surface: SeenSurface) -> Candidates:
        """Return how that planner rates places (n, 3) [m]."""
        return rate(places_w, surface, self._excavator_settings.zones)

    def true_mask(self, command: Command) -> Pixels:
        """Return the pixels whose soil surface point lies in the patch, (H, W) bool."""
        target: Target = command.region
        return target.contains(self.renderer.terrain_points_w())

    @property
    def agent_pos(self) -> NDArray[np.float32]:
        """Joint positions [rad], then velocities [rad/s], (8,) float32."""
        machine = self.worksite.machine
        return np.concatenate([machine.joint_pos, machine.joint_vel]).astype(np.float32)

    @property
    def task_state(self) -> NDArray[np.float32]:
        """Measurements of the cycle, (8,) float32; see `spec.TaskState`."""
        return np.array(astuple(self.cycle.state), np.float32)

    @property
    def environment_state(self) -> NDArray[np.float32]:
        """Region, loads and a coarse map of heights, (151,) float32; see `spec.ENVIRONMENT_STATE_NAMES`."""
        return environment_state(self.worksite, self.target)

    @property
    def is_success(self) -> bool:
        """Whether the cycle is complete and did what was asked."""
        return self.cycle.is_success

    def _measures(self) -> dict[str, Any]:
        return {"soil": self._excavator_settings.soil_name, **self.cycle.metrics()}
