"""Let the scripted operator play scenes without pictures, and write a metrics file like that of lerobot-eval.

`lerobot-excav report --operator=FILE` relates policies to it. After an interruption the same command with
--resume=true goes on.

Examples:
  lerobot-excav operator --env.type=excavator --scenes=100 --metrics=outputs/operator.jsonl
      100 test scenes with 4 targets each
  lerobot-excav operator --env.type=excavator --first_scene=1000 --scenes=40 --targets=1 --metrics=outputs/o.jsonl
      what lerobot-eval --env.scene_set=test --eval.n_episodes=40 shows with its default seed of 1000
  lerobot-excav operator --env.type=fr5_grasp --env.retarget_frame=100 --scenes=100 --metrics=outputs/fr5_operator.jsonl
      the arm's operator, whose command changes after 2 s
"""

from dataclasses import dataclass, field
from pathlib import Path

from lerobot_excav.datasets.record.demonstration_settings import PlayedScenes
from lerobot_excav.errors import require
from lerobot_excav.scripts.arguments import EvaluationChoice
from lerobot_excav.scripts.demos import ResumableArguments, played
from lerobot_excav.setting import setting

PICTURE_SETTINGS = (
    *("mask_source", "mask_condition", "mask_noise", "mask_dropout", "mask_snap", "target_overlay"),
    *("observation_height", "observation_width"),
)


@dataclass(kw_only=True)
class OperatorArguments(ResumableArguments, PlayedScenes):
    """Arguments of `lerobot-excav operator`."""

    env: EvaluationChoice = field(default_factory=EvaluationChoice.default)
    """Environment, with its settings; the excavator by default, and test scenes unless others are asked for."""

    metrics: Path | None = setting("Metrics file to write; must not exist", default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        default = type(self.env)()
        for name in PICTURE_SETTINGS:
            value = getattr(self.env, name)
            require(
                value == getattr(default, name),
                f"--env.{name}={value!r} has no effect: the scripted operator sees the scene itself; leave it out",
            )


def run(arguments: OperatorArguments) -> int:
    """Play, and print a report."""
    path = arguments.given("metrics", "the file to write, such as --metrics=outputs/operator.jsonl")
    from lerobot_excav.evaluation.metrics import read_evaluation
    from lerobot_excav.evaluation.operator_run import evaluate_operator
    from lerobot_excav.evaluation.report import make_report
    from lerobot_excav.evaluation.report_text import report_text
    from lerobot_excav.evaluation.run import Run

    evaluate_operator(played(PlayedScenes, arguments), path, workers=arguments.workers, resume=arguments.resume)
    operator = Run(label="operator", evaluations=(read_evaluation(path),))
    print(report_text(make_report([operator])))
    print(f"written: {path}")
    return 0


ARGUMENTS = OperatorArguments
