"""Clear-v0 as a gymnasium environment."""

from dataclasses import asdict, replace
from typing import Any, override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.control import checked_action
from lerobot_excav.envs.machines.excavator.rendering import WorksiteRenderer
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.tasks.clear.clearing import Clearing
from lerobot_excav.envs.tasks.clear.spec import CYCLES, LEAST_REMOVED
from lerobot_excav.envs.tasks.commanded import Seen
from lerobot_excav.envs.tasks.planner.candidates import Candidates, rate
from lerobot_excav.envs.tasks.planner.plan import Plan, plan_targets, proposal_of
from lerobot_excav.envs.tasks.planner.score_overlay import with_scores
from lerobot_excav.envs.tasks.planner.surface import SeenSurface, see_surface
from lerobot_excav.envs.tasks.scoop.cycle import DigCycle
from lerobot_excav.envs.tasks.scoop.env import FULL_BUCKET_KG, ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.scene import Scene
from lerobot_excav.envs.tasks.selection import Selection, TargetAbsentError
from lerobot_excav.envs.tasks.shown_source import ShownSource
from lerobot_excav.errors import ConfigurationError, require

PLANNER_PICTURE_PX = (192, 256)
"""Height and width of the planner's depth picture [px], whatever policies see: 96 % of the cells with soil are seen,
with 96 x 128 it is 78 % (kind: tuned)."""


class ClearEnv(ExcavatorEnv):
    """An 8-t excavator that digs a whole pile away, cycle by cycle.

    Task (`Clear-v0`): cycles as of `Scoop-v0` on one pile. When a cycle is over, the target planner looks at the depth
    picture of `main`, commands the region with the most soil, and the mask changes. A region on which a cycle brought
    nothing is commanded again only after all others. `target_id` is the rank of the region among the planner's
    proposals: 0 unless options of `reset` say otherwise.

    A cycle is over when the bucket has been emptied into the box, when all of a lifted load was lost before the box, or
    after 25 s. With `between_cycles="stand"` the machine stands from when the bucket is empty until the next command,
    whatever the action says. The episode is over after 20 cycles, when nothing is left that is worth a cycle, or at the
    time limit.

    Scene, observation and action are those of `Scoop-v0`.

    Reward: gain of soil in the box divided by 485 kg, plus 1 when it ends by itself with success: not at the time
    limit, which truncates it.

    Success: at least 75 % of the pile is removed and nothing of the machine hit the box hard. `info["is_success"]` is
    true at the end of the episode only.

    Termination: the last cycle is over, or no region is proposed. Truncation: the time limit `episode_length`.

    The planner needs a graphics context also where the observation holds no pictures. Arguments: see `ExcavatorEnv`;
    `keep_out` bars zones of the ground.

    Attributes:
        plan: What the planner proposed last.
        surface: What it saw.
    """

    TASK = "Clear-v0"

    plan: Plan
    surface: SeenSurface
    _clearing: Clearing
    _scene: Scene
    _is_due = False  # whether the next cycle is to be commanded
    _planner_renderer: WorksiteRenderer | None = None

    @property
    def clearing(self) -> Clearing:
        """The course of the episode."""
        self._require_episode()
        return self._clearing

    @override
    def _start(self, selection: Selection) -> None:
        self._scene = self._draw_start(selection)
        self.worksite.reset(self._scene)
        self._clearing = Clearing(self.worksite)
        self._look()
        if self.plan.nothing_left is not None:
            settings = self._excavator_settings
            raise (TargetAbsentError if selection.stage and not settings.zones else ConfigurationError)(
                f"scene_id={selection.scene_id}: there is nothing to dig: {self.plan.nothing_left}; take another "
                f"scene, or other zones than keep_out={settings.keep_out!r}"
            )
        self._begin_cycle(selection.target_id)

    @override
    def _advance(self, action: NDArray[Any]) -> tuple[float, bool]:
        command, soil = checked_action(action), self.worksite.soil
        box_before_kg = soil.box_mass_kg
        for _ in range(self._ticks_per_frame):
            self.worksite.tick(np.zeros_like(command) if self._stands else command)
            self._clearing.update()
        if not self._is_due and self._clearing.end is not None:
            self._finish_cycle(self._clearing.end)
        gain = (soil.box_mass_kg - box_before_kg) / FULL_BUCKET_KG
        is_over = self._is_due and (len(self._clearing.records) >= CYCLES or self.plan.nothing_left is not None)
        return gain + float(is_over and self.is_success), is_over

    @property
    def _stands(self) -> bool:
        """Whether the machine stands, whatever it is told: its bucket is empty and the next command has not come."""
        may_stand = self._excavator_settings.between_cycles == "stand"
        return may_stand and (self._is_due or self._clearing.is_dumped)

    def _finish_cycle(self, end: str) -> None:
        self._clearing.finish(end)
        self._look()
        self._is_due = True

    def _look(self) -> None:
        """Let the planner look at what is left."""
        if self._planner_renderer is None:
            self._planner_renderer = WorksiteRenderer(
                self.worksite, height=PLANNER_PICTURE_PX[0], width=PLANNER_PICTURE_PX[1]
            )
        eye = self._planner_renderer
        self.surface = see_surface(eye.depth_m("main"), eye.camera("main"))
        self.plan = self.planned(self.surface)

    def _begin_cycle(self, target_id: int) -> None:
        count = len(self.plan.proposals)
        if target_id >= count:
            raise TargetAbsentError(
                f"target_id={target_id} is not possible: the planner proposes {count} regions here; give one from 0 to "
                f"{count - 1}, or leave it out"
            )
        scene = replace(self._scene, targets=self.plan.targets)
        self._cycle = DigCycle(self.worksite, scene, target_id)
        self._clearing.begin(self._cycle, self.plan.proposals[target_id])
        self._is_due = False

    # Commands.

    @override
    def _next_target(self) -> int | None:
        return 0 if self._is_due else None

    @override
    def _change_command(self) -> None:
        super()._change_command()
        if self._is_due:  # a schedule of one's own says nothing of this cycle
            self._begin_command(0)
            self._give_command(0)

    @override
    def _begin_command(self, target_id: int) -> None:
        if self._is_due:
            self._begin_cycle(target_id)
        else:
            require(target_id < self._target_count, f"commands: target {target_id} is not proposed at this time")
            self._clearing.recommand(target_id, self.plan.proposals[target_id])

    @override
    def _target_at(self, place_w: NDArray[np.float64]) -> int:
        """Let the planner rate a place that somebody else proposes, beside its own proposals."""
        rated = self.rated(place_w[None], self.surface)
        require(not rated.is_barred[0], f"keep_out={self._excavator_settings.keep_out!r} bars this place")
        target_id = super()._target_at(place_w)
        self.plan = replace(self.plan, proposals=(*self.plan.proposals, proposal_of(rated, 0)))
        return target_id

    @override
    def _move_target(self, target_id: int, place_w: NDArray[np.float64]) -> None:
        """Let the planner rate a place that a mask source has chosen, in the stead of one of its proposals."""
        chosen = proposal_of(self.rated(place_w[None], self.surface), 0)
        proposals = [chosen if number == target_id else old for number, old in enumerate(self.plan.proposals)]
        self.plan = replace(self.plan, proposals=tuple(proposals))
        super()._move_target(target_id, place_w)
        self._clearing.recommand(target_id, chosen)

    @override
    def planned(self, surface: SeenSurface) -> Plan:
        """Return what the planner proposes for a surface; it knows where cycles brought nothing."""
        return plan_targets(surface, self._excavator_settings.zones, self._clearing.vain_w)

    @override
    def rated(self, places_w: NDArray[np.float64], surface: SeenSurface) -> Candidates:
        """Return how the planner rates places (n, 3) [m]."""
        return rate(places_w, surface, self._excavator_settings.zones, self._clearing.vain_w)

    @override
    def _point(self, target_id: int, source: ShownSource) -> Seen:
        """Command a target, whose cycle has its whole time from now on: a person may have thought for long."""
        seen = super()._point(target_id, source)
        self._clearing.begin_time_again()
        return seen

    @property
    @override
    def scene_key(self) -> tuple[int, ...]:
        """Numbers of the scene set, of the scene and of the cycle."""
        return (*super().scene_key, len(self._clearing.records))

    @override
    def command_key(self, command: Command) -> str:
        """Return `SCENE_SET/SCENE/STAGE/TARGET/CYCLE`, by which files of masks name a situation."""
        return f"{super().command_key(command)}/{len(self._clearing.records)}"

    # What is told.

    @property
    def pile_removed(self) -> float:
        """Part of the pile that is gone from the dig area."""
        return self.clearing.pile_removed

    @property
    @override
    def is_success(self) -> bool:
        """Whether enough of the pile is removed, and nothing was hit hard."""
        return self.pile_removed >= LEAST_REMOVED and self._clearing.hard_target_contacts == 0

    @override
    def _measures(self) -> dict[str, Any]:
        settings, clearing = self._excavator_settings, self._clearing
        records = clearing.all_records()
        return {
            "soil": settings.soil_name,
            "between_cycles": settings.between_cycles,
            "pile_removed": clearing.pile_removed,
            "retained_mass_kg": sum(record.retained_mass_kg for record in records),
            "hard_target_contacts": clearing.hard_target_contacts,
            "spill_before_target_events": sum(record.spill_before_target_events for record in records),
            "nothing_left": self.plan.nothing_left or "",
            "cycles": [asdict(record) for record in records],
            "events": clearing.events,
        }

    @override
    def _measured(self) -> tuple[str, ...]:
        number = min(len(self._clearing.records) + 1, CYCLES)
        return f"removed {100.0 * self.pile_removed:.0f} %", f"cycle {number}", *super()._measured()[:1]

    @override
    def _failure(self) -> str | None:
        if self.clearing.hard_target_contacts > 0:
            return "hit the box"
        return "pile not removed" if self.is_over and not self.is_success else None

    def score_picture(self) -> NDArray[np.uint8]:
        """Return the main picture, (H, W, 3) uint8, with the planner's last scores drawn into it."""
        self._require_episode()
        return with_scores(self.picture(), self.depth_m(), self.camera, surface=self.surface, plan=self.plan)

    @override
    def close(self) -> None:
        """Free the graphics contexts."""
        super().close()
        if self._planner_renderer is not None:
            self._planner_renderer.close()
            self._planner_renderer = None
