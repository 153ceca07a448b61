"""Record demonstrations with the scripted operator as a LeRobot dataset.

Episodes are simulated in parallel and assembled in order; OUT appears only when it is complete. After an interruption
the same command with --resume goes on; the dataset becomes the same as without it. Episodes without success are left
out and listed, unless --keep-failures.

Examples:
  lerobot-excav demos --env=excavator --scenes=50 --targets=4 --out=outputs/paired
      50 scenes, each with its 4 targets: 200 paired episodes
  lerobot-excav demos --scenes=200 --targets=1 --out=outputs/non_paired
      as many episodes, each of another scene
  lerobot-excav demos --env=fr5_grasp --scenes=200 --targets=1 --target-rule=nearest --out=outputs/nearest
      the arm, sent to the block nearest to it in each of 200 scenes
  lerobot-excav demos --scenes=50 --out=outputs/paired --resume
      go on after an interruption
"""

import argparse
from pathlib import Path

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.scripts.demonstration_arguments import add_settings, add_storage, settings_from


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    default = DemonstrationSettings()
    parser.add_argument("--out", type=Path, required=True, help="folder of the dataset; must not exist")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run, or start one")
    parser.add_argument(
        "--keep-failures", action="store_true", help="keep episodes without success, marked as such"
    )
    parser.add_argument(
        "--height", type=int, default=default.height, help=f"image height (default: {default.height})"
    )
    parser.add_argument(
        "--width", type=int, default=default.width, help=f"image width (default: {default.width})"
    )
    add_storage(parser)
    add_settings(parser)


def run(arguments: argparse.Namespace) -> int:
    """Record, and say what was recorded."""
    # Slow to import (LeRobot, PyTorch), so after the arguments are known to be right.
    from lerobot_excav.datasets.record.demonstrations import DemonstrationSummary, record_demonstrations

    settings = settings_from(arguments)
    summary: DemonstrationSummary = record_demonstrations(
        settings, arguments.out, workers=arguments.workers, resume=arguments.resume
    )
    print(f"{summary.out}: {summary.episodes} episodes of {settings.scenes} scenes")
    if summary.failures:
        kept = "kept" if settings.keep_failures else "left out"
        print(f"{len(summary.failures)} episodes without success ({kept}): {' '.join(summary.failures)}")
    print(
        f"{summary.simulated_s:.0f} s simulated in {summary.wall_s:.0f} s "
        f"({summary.simulated_s / max(summary.wall_s, 1e-9):.1f} x real time)"
    )
    print(f"next: lerobot-excav qc {summary.out}")
    return 0
