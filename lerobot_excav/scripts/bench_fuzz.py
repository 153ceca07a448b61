"""Let the machine do random things to the soil, and check after every step that nothing impossible has happened.

Checked are the mass ledger (1e-6 kg), that every number is finite, that no height is negative, that parcels stay on the
worksite and below their bound, and that a reset is exact. Soils, fidelities and styles of actions take turns. The exit
code is 1 if a case fails; its actions are written to a file.

Examples:
  lerobot-excav bench fuzz --steps=200000
      what `make fuzz` runs
  lerobot-excav bench fuzz --seed=1 --first-case=120 --steps=4000
      ten cases of another seed, from the 120th on
  lerobot-excav bench fuzz --replay=outputs/fuzz/seed0_case17.json
      repeat a failure
"""

import argparse
from pathlib import Path

from lerobot_excav.errors import require

DEFAULT_STEPS = 10_000
DEFAULT_WORKERS = 2
DEFAULT_OUT = Path("outputs/fuzz")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--steps", type=int, help=f"environment steps in total (default: {DEFAULT_STEPS})")
    parser.add_argument("--seed", type=int, help="seed of everything random (default: 0)")
    parser.add_argument("--first-case", type=int, help="case to begin with; one is 400 steps (default: 0)")
    parser.add_argument("--workers", type=int, help=f"processes (default: {DEFAULT_WORKERS})")
    parser.add_argument("--out", type=Path, help=f"folder for failures (default: {DEFAULT_OUT})")
    parser.add_argument("--replay", type=Path, help="file of a failure to repeat, and nothing else")


def run(arguments: argparse.Namespace) -> int:
    """Fuzz, or repeat a failure."""
    names = ("steps", "seed", "first_case", "workers", "out")
    given = {name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None}
    if arguments.replay is not None:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in given)
        require(not given, f"{options} has no effect on --replay; leave it out")
        return _replay(arguments.replay)
    from lerobot_excav.evaluation.fuzz.run import fuzz

    settings = {"steps": DEFAULT_STEPS, "workers": DEFAULT_WORKERS, "out": DEFAULT_OUT, **given}
    failures = fuzz(**settings)
    print(f"{settings['steps']} steps, {len(failures)} failures")
    for path, _ in failures:
        print(f"repeat: lerobot-excav bench fuzz --replay={path}")
    return int(bool(failures))


def _replay(path: Path) -> int:
    from lerobot_excav.evaluation.fuzz.case import Failure, replay

    failure = Failure.read(path)
    print(f"{failure.case}, step {failure.step}: {failure.problem}")
    problem = replay(failure)
    print(f"now: {problem or 'nothing is wrong'}")
    return int(bool(problem))
