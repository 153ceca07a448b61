"""What an audit plays."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import require
from lerobot_excav.evaluation.audit.actor import policy_digest

POLICY, AGAINST, OPERATOR = "policy", "against", "operator"
"""Labels of who acts; a variant of the policy is called by what differs, such as `policy, n_action_steps=5`."""

MOMENTS = ("start", "before acting", "while acting")
"""When a mask is given: at the first frame, shortly before the tool acts, and shortly after it has begun to."""

LEAD_S = 1.0
"""How long before acting begins, and after it, the mask changes at the later moments [s] (kind: guess)."""

FOLLOWED_S = 3.0
"""How long the course of events is followed from the later moments [s] (kind: guess; a cut takes about 3 s)."""


@dataclass(frozen=True, kw_only=True)
class Variant:
    """Who acts, and how.

    Attributes:
        label: Its name in the results.
        checkpoint: Policy; None for the scripted operator.
        overrides: Settings of the policy that differ from the checkpoint's.
        moments: At which of `MOMENTS` masks are given.
    """

    label: str
    checkpoint: Path | None
    overrides: tuple[str, ...] = ()
    moments: tuple[str, ...] = MOMENTS[:1]


@dataclass(frozen=True, kw_only=True)
class AuditSettings:
    """Everything that the branches of an audit depend on.

    Attributes:
        env: Settings of the environment.
        first_scene: Number of the first scene.
        scenes: How many.
        stage: Stage of all of them.
        variants: Who acts; the first is the policy that is audited.
        seed: Seed of the operator.

    Raises:
        ConfigurationError: The task cannot be audited.
    """

    env: TaskSettings
    first_scene: int
    scenes: int
    stage: int
    variants: tuple[Variant, ...]
    seed: int

    def __post_init__(self) -> None:
        spec = self.task_spec
        require(
            spec.place_probe_entry is not None,
            f"{spec.id} cannot be audited: it does not tell where the machine acts; audit another task of this machine",
        )
        require(
            0 <= self.stage <= spec.last_stage,
            f"--stage={self.stage} is not possible; allowed for {spec.id}: 0 to {spec.last_stage}",
        )
        retarget_frame = getattr(self.env, "retarget_frame", None)
        require(
            retarget_frame is None,
            f"--env.retarget_frame={retarget_frame} has no place in an audit, which changes the command itself; leave "
            "it out",
        )
        labels = [variant.label for variant in self.variants]
        require(len(set(labels)) == len(labels), f"--n_action_steps names a number twice: {', '.join(labels)}")

    @property
    def task_spec(self) -> TaskSpec:
        """The task."""
        return task_of_settings(self.env)

    @property
    def scene_ids(self) -> range:
        """The scenes."""
        return range(self.first_scene, self.first_scene + self.scenes)

    @property
    def played_words(self) -> str:
        """How the scenes are played, in words: from which stage, and with what but the defaults of the environment."""
        defaults, given = type(self.env)(), self.env.as_dict()
        told = {name for name, value in given.items() if value != getattr(defaults, name)} - {"scene_set"}
        options = [f"--env.{name}={given[name]}" for name in given if name in told]
        other = f"with {' '.join(options)}" if options else "with the defaults of the environment"
        return f"{other}, from stage {self.stage}" if self.stage else other

    def as_record(self) -> dict[str, Any]:
        """Return the settings as plain data, but for how many scenes: an audit may be made longer."""
        return {
            "simulation_version": self.task_spec.simulation_version,
            "env.type": self.env.ENV_TYPE,
            **{f"env.{name}": value for name, value in self.env.as_dict().items()},
            "stage": self.stage,
            "seed": self.seed,
            "variants": [
                [v.label, None if v.checkpoint is None else policy_digest(v.checkpoint), [*v.overrides], [*v.moments]]
                for v in self.variants
            ],
        }


def policy_variants(
    checkpoint: Path, *, against: Path | None, plans: tuple[int, ...], ensemble: float | None
) -> tuple[Variant, ...]:
    """Return the variants of an audit: the policy at all moments, the others from the start.

    Args:
        checkpoint: The policy.
        against: Policy that is to be compared with, such as one without masks.
        plans: Numbers of executed actions per plan that are tried besides the checkpoint's.
        ensemble: Coefficient of temporal ensembling that is tried.
    """
    variants = [Variant(label=POLICY, checkpoint=checkpoint, moments=MOMENTS)]
    for number in plans:
        options = ("--temporal_ensemble_coeff=null", f"--n_action_steps={number}")
        variants.append(Variant(label=f"{POLICY}, n_action_steps={number}", checkpoint=checkpoint, overrides=options))
    if ensemble is not None:
        options = ("--n_action_steps=1", f"--temporal_ensemble_coeff={ensemble}")
        variants.append(Variant(label=f"{POLICY}, temporal ensemble", checkpoint=checkpoint, overrides=options))
    if against is not None:
        variants.append(Variant(label=AGAINST, checkpoint=against))
    return (*variants, Variant(label=OPERATOR, checkpoint=None))
