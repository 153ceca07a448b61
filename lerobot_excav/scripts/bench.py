"""Measure how fast this machine simulates, writes and records a task.

The repository has more: `python -m bench.operator_cycle` times the parts of a cycle, `python -m bench.soil` the soil
alone, and `python -m bench.policy` policies.

Examples:
  lerobot-excav bench
      the excavator, three scenes
  lerobot-excav bench --env.type=fr5_grasp --scenes=1 --targets=1 --json=outputs/machine.json
      the arm, quickly; the numbers also go to a file
  lerobot-excav bench --only=cycle
      the operator's cycles at every fidelity, in processor time
  lerobot-excav bench --only=environment --env.soil=gravel --env.fidelity=fine
      other soil, finer
"""

import json
import os
import platform
from dataclasses import dataclass, field
from pathlib import Path

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings, PlayedScenes
from lerobot_excav.errors import require
from lerobot_excav.scripts.arguments import EnvironmentChoice
from lerobot_excav.scripts.demos import WorkArguments, played
from lerobot_excav.setting import setting, with_default
from lerobot_excav.whole_file import write_whole

MEASURES = ("environment", "cycle", "writing", "demos")


@dataclass(kw_only=True)
class BenchArguments(WorkArguments, PlayedScenes):
    """Arguments of `lerobot-excav bench`."""

    env: EnvironmentChoice = field(default_factory=EnvironmentChoice.default)
    """Environment, with its settings; the excavator by default."""

    scenes: int = with_default(PlayedScenes, "scenes", 3)

    only: str | None = setting("What to measure; left out: everything", default=None, choices=MEASURES)
    json: Path | None = setting("File to which the numbers go as well; must not exist", default=None)


def run(arguments: BenchArguments) -> int:
    """Measure, and print what was measured."""
    from lerobot_excav.evaluation.speed import measures

    if arguments.json is not None:
        require(not arguments.json.exists(), f"--json={arguments.json} exists; choose another file, or remove it first")
    settings = DemonstrationSettings(keep_failures=True, **vars(played(PlayedScenes, arguments)))
    tasks = measures(settings, workers=arguments.workers)
    machine = {"machine": platform.machine(), "cores": os.cpu_count(), "load": os.getloadavg()[0]}
    print(f"{machine['machine']}, {machine['cores']} cores, load {machine['load']:.1f}")
    results = []
    for name in MEASURES if arguments.only is None else (arguments.only,):
        for result in tasks[name]():
            print(f"{result.name:42} {result.value:10.2f} {result.unit}", flush=True)
            results.append(result._asdict())
    if arguments.json is not None:
        arguments.json.parent.mkdir(parents=True, exist_ok=True)
        write_whole(arguments.json, json.dumps({**machine, "measurements": results}, indent=1) + "\n")
    return 0


ARGUMENTS = BenchArguments
