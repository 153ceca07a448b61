"""`lerobot-excav`: what LeRobot's own commands cannot express, on the same files."""

import argparse
import importlib
import io
import sys
from collections.abc import Sequence
from importlib.metadata import version
from types import ModuleType

from lerobot_excav.errors import ExcavError
from lerobot_excav.scripts.file_trouble import in_words

COMMANDS = {
    "demos": "record demonstrations with the scripted operator, faster than real time",
    "index": "rebuild the paired-scene index, complete a recording, print lerobot-train's episode flags",
    "qc": "check a dataset and replay a sample of its episodes",
    "card": "write what is in a dataset into its README, with a picture, and upload it if asked to",
    "masks": "give a dataset masks of another source, or its first ones",
    "alignment": "write into a recording of the test bed how old what was seen was, and count late frames",
    "segmenter": "train or measure the small network that turns a click into a mask",
    "operator": "let the scripted operator play scenes, for the efficiency in reports",
    "report": "make the table of one or more evaluations, with intervals and comparisons",
    "audit": "ask whether a policy acts where its mask says because of the mask",
    "console": "open a page to see, point, drive, let a policy work, and record",
    "testbed-emulator": "stand in for a real excavator: a simulated machine behind the test bed's wire",
    "testbed-stop": "stop the machine behind that wire at once, whoever drives it",
    "export": "write a small copy of a trained policy, with a model card",
    "bench": "measure how fast this machine simulates and records",
    "warmup": "compile the simulation ahead of the first episode",
}

EPILOG = """\
a first round:
  lerobot-excav demos --env.type=excavator --scenes=30 --stages=0,1-13 --targets=4 --keep_failures=true \\
      --storage=video --out=outputs/paired
  lerobot-excav qc outputs/paired
  lerobot-train --policy.type=mask_act --policy.preset=fast --policy.n_encoder_layers=1 --policy.target_token=true \\
      --policy.chunk_size=10 --policy.n_action_steps=5 --policy.actions_per_token=1 --policy.device=cpu \\
      --policy.push_to_hub=false --dataset.repo_id=local/paired --dataset.root=outputs/paired --batch_size=16 \\
      --steps=7500 --num_workers=1 --save_freq=1500 --output_dir=outputs/train
  lerobot-eval --policy.path=outputs/train/checkpoints/last/pretrained_model --policy.device=cpu \\
      --env.type=excavator --env.scene_set=test --env.metrics_path=outputs/metrics.jsonl \\
      --eval.n_episodes=20 --eval.batch_size=1
  lerobot-excav report outputs/metrics.jsonl --out=outputs/report

`lerobot-excav COMMAND --help` explains a command.
"""


def module_of(command: str) -> ModuleType:
    """Return the module of a command."""
    return importlib.import_module(f"lerobot_excav.scripts.{command.replace('-', '_')}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand.

    Args:
        argv: Arguments; those of the process by default.

    Returns:
        Exit code: 0, 1 if a check failed, 2 after an error of usage or data, 130 after Ctrl-C.
    """
    _print_anything()
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] == ["--version"]:
        print(f"lerobot-excav {version('lerobot_env_excav')}")
        return 0
    if not arguments or arguments[0] not in COMMANDS:
        _overview().parse_args(arguments or ["--help"])
        return 0
    name, *rest = arguments
    # Loaded only now, so that help is instant whatever the other commands need.
    from lerobot_excav.envs.plugins import load_plugins
    from lerobot_excav.scripts.arguments import parse_arguments

    command = module_of(name)
    try:
        if getattr(command, "NEEDS_PLUGINS", True):
            load_plugins()
        parsed = parse_arguments(command.ARGUMENTS, rest, command=name, description=command.__doc__ or "")
        return int(command.run(parsed))
    except ExcavError as error:
        print(f"lerobot-excav {name}: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        # A folder in place of a file, no permission, a full disk: nothing a traceback would explain.
        print(f"lerobot-excav {name}: {in_words(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"\nlerobot-excav {name}: interrupted", file=sys.stderr)
        return 130


def _print_anything() -> None:
    """Let a terminal that lacks a character show a question mark in its place, rather than end the program."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _overview() -> argparse.ArgumentParser:
    commands = "\n".join(f"  {name:10} {summary}" for name, summary in COMMANDS.items())
    parser = argparse.ArgumentParser(
        prog="lerobot-excav",
        usage="lerobot-excav COMMAND [options]",
        description=f"{__doc__}\n\ncommands:\n{commands}",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", metavar="COMMAND", choices=list(COMMANDS), help=argparse.SUPPRESS)
    return parser


if __name__ == "__main__":
    sys.exit(main())
