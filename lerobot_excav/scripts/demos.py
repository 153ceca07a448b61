"""Record demonstrations with the scripted operator as a LeRobot dataset.

Episodes are simulated in parallel and assembled in order; OUT appears only when it is complete. After an interruption
the same command with --resume=true goes on; the dataset becomes the same as without it. Episodes without success are
left out and listed, unless --keep_failures=true.

Examples:
  lerobot-excav demos --env.type=excavator --scenes=50 --targets=4 --out=outputs/paired
      50 scenes, each with its 4 targets: 200 paired episodes
  lerobot-excav demos --env.type=excavator --env.soil=gravel --scenes=200 --targets=1 --out=outputs/non_paired
      as many episodes, each of another scene, on another soil
  lerobot-excav demos --env.type=excavator --scenes=50 --stages=0,4,8 --out=outputs/stages
      50 scenes, each as it is drawn and after 4 and 8 dug cycles, with 4 targets each: up to 600 episodes
  lerobot-excav demos --env.type=fr5_grasp --scenes=200 --targets=1 --target_rule=nearest --out=outputs/nearest
      the arm, sent to the block nearest to it in each of 200 scenes
  lerobot-excav demos --env.type=excavator --scenes=50 --out=outputs/paired --resume=true
      go on after an interruption
"""

from dataclasses import dataclass, field
from pathlib import Path

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings, PlayedScenes
from lerobot_excav.datasets.record.workers import MOST_WORKERS
from lerobot_excav.envs.tasks.registry import task_settings
from lerobot_excav.scripts.arguments import Arguments, EnvironmentChoice
from lerobot_excav.setting import declared_settings, setting


@dataclass(kw_only=True)
class WorkArguments(Arguments):
    """How work is spread."""

    workers: int = setting(
        "Processes that simulate; the result does not depend on it, and 0 works in this process",
        default=2,
        low=0,
        high=MOST_WORKERS,
    )


@dataclass(kw_only=True)
class ResumableArguments(WorkArguments):
    """Work that can be continued."""

    resume: bool = setting("Whether to continue an interrupted run, or start one", default=False)


@dataclass(kw_only=True)
class DemosArguments(ResumableArguments, DemonstrationSettings):
    """Arguments of `lerobot-excav demos`."""

    env: EnvironmentChoice = field(default_factory=EnvironmentChoice.default)
    """Environment, with its settings; the excavator by default."""
    out: Path | None = setting("Folder of the dataset; must not exist", default=None)


def played[Played: PlayedScenes](kind: type[Played], arguments: PlayedScenes) -> Played:
    """Return what is played, apart from the other arguments of a command."""
    values = {name: getattr(arguments, name) for name in declared_settings(kind)}
    return kind(env=task_settings(arguments.env), **values)


def run(arguments: DemosArguments) -> int:
    """Record, and say what was recorded."""
    out = arguments.given("out", "the folder of the dataset, such as --out=outputs/paired")
    # Slow to import (LeRobot, PyTorch), so after the arguments are known to be right.
    from lerobot_excav.datasets.record.demonstrations import record_demonstrations

    settings = played(DemonstrationSettings, arguments)
    summary = record_demonstrations(settings, out, workers=arguments.workers, resume=arguments.resume)
    stages = "" if settings.stages == "0" else f" at stages {settings.stages}"
    print(f"{summary.out}: {summary.episodes} episodes of {settings.scenes} scenes{stages}")
    if summary.failures:
        kept = "kept" if settings.keep_failures else "left out"
        print(f"{len(summary.failures)} episodes without success ({kept}): {' '.join(summary.failures)}")
    if summary.absent:
        print(f"{len(summary.absent)} targets skipped, which their starts do not offer: {' '.join(summary.absent)}")
    if summary.waited:
        print(f"{len(summary.waited)} episodes left out, whose machine waited for its mask: {' '.join(summary.waited)}")
    print(
        f"{summary.simulated_s:.0f} s simulated in {summary.wall_s:.0f} s "
        f"({summary.simulated_s / max(summary.wall_s, 1e-9):.1f} x real time)"
    )
    print(f"next: lerobot-excav qc {summary.out}")
    return 0


ARGUMENTS = DemosArguments
