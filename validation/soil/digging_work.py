"""Which law of soil mechanics carries the operator's digging work."""

from collections import defaultdict
from typing import cast

import numpy as np

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode import demonstrate
from lerobot_excav.datasets.record.simulation import make_environment
from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.braking import braking_impulse, patch_rows, solved
from lerobot_excav.envs.machines.excavator.digging import JointResistance
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.patches import PatchKind
from lerobot_excav.envs.soil.tool import Reaction
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from validation import Array
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Result, Table

SCENES, QUICK_SCENES = 6, 2

MOST_FROM_EDGE = 0.1
"""Largest share of the work that may hang on the thickness of the edge, which is a guess."""

NAMES = {PatchKind.WEDGE: "wedge", PatchKind.PENETRATION: "blunt edge", PatchKind.PRESSURE: "plates"}


class MeteredResistance(JointResistance):
    """Resistance that adds up the work which it takes, by kind of patch.

    Attributes:
        works_j: Work taken from the bucket so far [J].
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        """Start with no work."""
        super().__init__(model)
        self.works_j: dict[PatchKind, float] = defaultdict(float)

    def set_reaction(self, reaction: Reaction, data: mujoco.MjData) -> None:
        """Take the patches of the coming tick, and note their kinds."""
        super().set_reaction(reaction, data)
        self._kinds = reaction.patches.kinds

    def apply(self, data: mujoco.MjData) -> None:
        """Resist, and solve once more for the impulse of each patch."""
        super().apply(data)
        if len(self._limits) == 0:
            return
        inertia, free_vel = self._seen
        rotation = data.xmat[self._bucket].reshape(3, 3)
        rows = patch_rows(self._jacobian, rotation, self._points_t, self._axes_t)
        total, impulses = braking_impulse(rows, self._limits, self._frictions, inertia, free_vel)
        joint_vel = free_vel + solved(inertia, total)
        works = -np.einsum("ka,kaj,j->k", impulses, rows, joint_vel)
        for kind in PatchKind:
            self.works_j[kind] += float(works[self._kinds == kind].sum())

    def _free_motion(self, data: mujoco.MjData) -> tuple[Array, Array]:
        inertia, free_vel = super()._free_motion(data)
        self._seen = inertia.copy(), free_vel.copy()
        return inertia, free_vel


def work_of_a_cycle_j(settings: DemonstrationSettings, pair: Pair) -> tuple[dict[PatchKind, float], bool]:
    """Let the operator play one cycle; return the work that each kind of patch took [J], and whether it succeeded."""
    env = make_environment(settings.env, with_images=False)
    try:
        machine = cast(ExcavatorEnv, env.unwrapped).worksite.machine
        metered = MeteredResistance(machine.model)
        machine._resistance = metered  # noqa: SLF001 - nothing else tells patches apart
        operator = settings.task_spec.make_operator(np.random.default_rng(settings.episode_seed(pair)))
        episode = demonstrate(env, operator, pair)
    finally:
        env.close()
    return metered.works_j, episode.success


@experiment(
    name="digging_work",
    title="What carries the digging work",
    source="Our own: no number that was guessed may carry more than a tenth of the work",
    measures=f"The scripted operator digs, lifts, swings and dumps; the work that wedge, blunt edge and plates take "
    f"from the bucket, in substeps of {1e3 * const.SUBSTEP_S:g} ms.",
    gate="the blunt edge, whose thickness is a guess, takes at most a tenth; every cycle succeeds",
)
def run(conditions: Conditions) -> Result:
    """Let the scripted operator play validation scenes and meter the soil."""
    env = {"scene_set": "val", "soil": conditions.preset, "fidelity": conditions.fidelity, "episode_length": 200}
    scenes = QUICK_SCENES if conditions.quick else SCENES
    settings = DemonstrationSettings.of("excavator", env, scenes=scenes, targets=1)
    rows: list[tuple[float | str, ...]] = []
    totals, successes = np.zeros(len(PatchKind)), 0
    for pair in track(settings.pairs(), "cycles"):
        works, success = work_of_a_cycle_j(settings, pair)
        mine = np.array([works[kind] for kind in PatchKind])
        totals, successes = totals + mine, successes + success
        shares = 100.0 * mine / mine.sum()
        rows.append(
            (str(pair.scene_id), str(pair.target_id), float(mine.sum() / 1e3), *shares, "yes" if success else "no")
        )
    edge = float(totals[PatchKind.PENETRATION] / totals.sum())
    header = ("scene", "target", "work [kJ]", *(f"{NAMES[kind]} [%]" for kind in PatchKind), "success")
    return Result(
        checks=(
            Check("share of the blunt edge", edge, high=MOST_FROM_EDGE),
            Check("cycles that succeed", float(successes), low=float(scenes), high=float(scenes)),
        ),
        tables=(Table(header, tuple(rows)),),
    )
