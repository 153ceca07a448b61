"""Starts by stage: what a scene is like when a seeded operator has dug some cycles of it.

A start is (scene set, scene, stage), and a stage is one cycle more than the one before. Between two cycles all loose
soil is laid down, so that a start is nothing but heights and a pose: it can be kept, and begun from exactly.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICKS_PER_SECOND
from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.machines.excavator.control import checked_action
from lerobot_excav.envs.machines.excavator.rehearsal import rehearse
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.soil import Soil, SoilParameters
from lerobot_excav.envs.tasks.planner.full_view import propose_regions
from lerobot_excav.envs.tasks.scoop.cycle import DigCycle
from lerobot_excav.envs.tasks.scoop.operator import DigOperator
from lerobot_excav.envs.tasks.scoop.operator.sight import CycleSight
from lerobot_excav.envs.tasks.scoop.scene import Scene, draw_scene
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings, soil_at_density
from lerobot_excav.envs.tasks.scoop.spec import CYCLE_LIMIT_S
from lerobot_excav.envs.tasks.scoop.targets import Target
from lerobot_excav.envs.tasks.settings import SCENE_SETS

Propose = Callable[[Worksite], Sequence[Target]]
"""Says which regions of a worksite to dig next, the best first: as many as a scene has."""

_FPS = 10
_TICKS_PER_FRAME = TICKS_PER_SECOND // _FPS
# Names the family of the operators' random streams; changing it changes every start but those of stage 0.
_STREAM = 0x57A6E
_SETTLING_TICKS = round(10.0 / TICK_S)


def draw_start(
    scene_set: str,
    scene_id: int,
    stage: int,
    *,
    soil: str | SoilParameters = "sand",
    density: str = "usual",
    pile: str = "heaps",
    fidelity: str = "standard",
    propose: Propose = propose_regions,
) -> Scene:
    """Return the scene as it is after `stage` cycles, with the regions that are proposed then; memoised.

    Stage 0 is the scene as drawn, with its own targets, and the same pile whatever its soil's density is. The
    same arguments give the same start, byte for byte.

    Raises:
        ConfigurationError: An argument is not one of the allowed values.
    """
    if stage == 0:
        return draw_scene(scene_set, scene_id, soil=soil, pile=pile)
    return _later_start(scene_set, scene_id, stage, soil, density, pile, fidelity, propose)


def start_of(settings: ExcavatorSettings, scene_id: int, stage: int) -> Scene:
    """Return the start that settings, scene and stage determine; see `draw_start`."""
    return draw_start(
        *(settings.scene_set, scene_id, stage),
        soil=settings.soil,
        density=settings.density,
        pile=settings.pile,
        fidelity=settings.fidelity,
    )


@lru_cache(maxsize=64)
def _later_start(
    scene_set: str,
    scene_id: int,
    stage: int,
    soil: str | SoilParameters,
    density: str,
    pile: str,
    fidelity: str,
    propose: Propose,
) -> Scene:
    given: dict[str, Any] = {"soil": soil, "density": density, "pile": pile, "fidelity": fidelity}
    before = draw_start(scene_set, scene_id, stage - 1, **given, propose=propose)
    if not before.targets:  # nothing is left to be dug
        return before
    rehearse()
    worksite = Worksite(soil=soil_at_density(soil, density), fidelity=fidelity)
    worksite.reset(before)
    target = before.targets[0] if stage > 1 else propose(worksite)[0]
    operator = DigOperator(rng=operator_rng(scene_set, scene_id, stage))
    dig_cycle(worksite, replace(before, targets=(target,)), operator)
    settle(worksite)
    return replace(
        before,
        joint_pos=_kept(worksite.machine.joint_pos),
        heights_m=_kept(worksite.soil.heights_m),
        firm_heights_m=_kept(worksite.soil.firm_heights_m),
        box_heights_m=_kept(worksite.soil.container_heights_m),
        targets=tuple(propose(worksite)),
    )


def operator_rng(scene_set: str, scene_id: int, stage: int) -> np.random.Generator:
    """Return the generator of the operator whose cycle leads to a stage."""
    stream = np.random.SeedSequence(_STREAM, spawn_key=(SCENE_SETS.index(scene_set), scene_id, stage))
    return np.random.default_rng(stream)


def dig_cycle(worksite: Worksite, scene: Scene, operator: DigOperator) -> DigCycle:
    """Let the operator dig the first target of a scene, as it is now, until the cycle is complete or given up."""
    cycle = DigCycle(worksite, scene, 0)
    sight = CycleSight(worksite=worksite, cycle=cycle, fps=_FPS)
    operator.reset(sight)
    for _ in range(round(CYCLE_LIMIT_S * _FPS)):
        action = checked_action(operator.act(sight))
        for _ in range(_TICKS_PER_FRAME):
            worksite.tick(action)
            cycle.update()
        if cycle.is_complete:
            break
    return cycle


def settle(worksite: Worksite) -> None:
    """Hold the machine until it stands, lay down all loose soil, that in the bucket too, and wait until it lies still.

    A slope at its very limit may creep on by less than can be seen; it is waited for no longer than 10 s.
    """
    for _ in range(TICKS_PER_SECOND):
        worksite.tick(np.zeros(4, dtype=np.float64))
    soil = worksite.soil
    soil.lay_down()
    for _ in range(_SETTLING_TICKS):
        before_m = _lying_m(soil)
        soil.step(TICK_S, None)
        if np.array_equal(before_m, _lying_m(soil)):
            return


def _lying_m(soil: Soil) -> NDArray[np.float64]:
    """Return all heights, of the dig area and of the box."""
    assert soil.container_heights_m is not None  # a worksite has a box
    return np.concatenate([soil.heights_m.ravel(), soil.container_heights_m.ravel()])


def _kept(array: NDArray[np.float64] | None) -> NDArray[np.float64]:
    copy = np.array(array)
    copy.flags.writeable = False
    return copy
