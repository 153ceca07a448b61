"""Ask whether a policy does what its mask says because of the mask: the same state, another mask, and what follows.

States repeat bit by bit here, so everything that differs between two plays is caused by the mask. Every scene is shown
with all of its masks, at the start, shortly before the tool acts and shortly after. The verdict is obeys, obeys in
part, insensitive, out of support or undecided, by thresholds that the page states. The scripted operator is measured
beside the policy. After an interruption the same command goes on; a higher --scenes makes an audit longer.

Examples:
  lerobot-excav audit checkpoints/excavator_mask_act --scenes=20 --out=outputs/audit
      20 test piles x 4 masks; writes audit.md, audit.json and pictures
  lerobot-excav audit outputs/paired/checkpoints/last/pretrained_model --against=outputs/no_mask/pretrained_model \
      --n_action_steps=[1,10] --ensemble=0.01 --scenes=30 --out=outputs/audit
      ... beside a policy without masks, with other numbers of executed actions, and with temporal ensembling
  lerobot-excav audit checkpoints/fr5_grasp_mask_act --env.type=fr5_grasp --scenes=20 --out=outputs/fr5_audit
      the arm
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from lerobot_excav.envs.tasks.registry import task_settings
from lerobot_excav.envs.tasks.settings import LAST_SCENE
from lerobot_excav.scripts.arguments import EvaluationChoice
from lerobot_excav.scripts.demos import WorkArguments
from lerobot_excav.setting import setting


@dataclass(kw_only=True)
class AuditArguments(WorkArguments):
    """Arguments of `lerobot-excav audit`."""

    POSITIONAL: ClassVar[str] = "checkpoint"

    checkpoint: Path | None = setting("pretrained_model folder of the policy", default=None)
    env: EvaluationChoice = field(default_factory=EvaluationChoice.default)
    """Environment, with its settings; the excavator by default, and test scenes unless others are asked for."""
    first_scene: int = setting("Number of the first scene", default=0, low=0, high=LAST_SCENE)
    scenes: int = setting("How many scenes", default=20, low=1, high=10_000)
    stage: int = setting("Cycles that a seeded operator has dug before", default=0, low=0, high=1000)
    against: Path | None = setting("pretrained_model folder of a policy to compare with", default=None)
    n_action_steps: list[int] = setting(
        "Numbers of executed actions per plan that are tried besides the checkpoint's, as [1,10]",
        default_factory=list,
        low=1,
    )
    ensemble: float | None = setting(
        "Coefficient of temporal ensembling that is tried, such as 0.01", default=None, low=-10.0, high=10.0
    )
    seed: int = setting("Seed of the operator and of the bootstrap", default=0, low=0, high=2**63 - 1)
    out: Path | None = setting("Folder for audit.md, audit.json and pictures; scenes are kept in it", default=None)


def run(arguments: AuditArguments) -> int:
    """Play, measure, judge, and write the page."""
    checkpoint = arguments.given("checkpoint", "the pretrained_model folder of the policy")
    out = arguments.given("out", "the folder to write, such as --out=outputs/audit")
    from lerobot_excav.evaluation.audit.audit import play_audit, read_audit
    from lerobot_excav.evaluation.audit.page import audit_text, write_audit
    from lerobot_excav.evaluation.audit.settings import AuditSettings, policy_variants

    settings = AuditSettings(
        env=task_settings(arguments.env),
        first_scene=arguments.first_scene,
        scenes=arguments.scenes,
        stage=arguments.stage,
        variants=policy_variants(
            checkpoint, against=arguments.against, plans=tuple(arguments.n_action_steps), ensemble=arguments.ensemble
        ),
        seed=arguments.seed,
    )
    play_audit(settings, out / "scenes", workers=arguments.workers)
    audit = read_audit(settings, out / "scenes", seed=arguments.seed)
    print(audit_text(audit))
    for path in write_audit(audit, out):
        print(f"written: {path}")
    return 0


ARGUMENTS = AuditArguments
