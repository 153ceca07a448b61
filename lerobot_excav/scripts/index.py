r"""Rebuild the paired-scene index of a dataset and use it.

The index (meta/excav_pairs.parquet, one row per episode) is derived from the dataset's own columns; rebuild it after
every edit. With --select and --split it prints the flags that make stock lerobot-train use exactly those episodes.

Examples:
  lerobot-excav index outputs/paired
      rebuild; list scenes with missing or duplicate targets
  lerobot-excav index outputs/recorded --session=outputs/excavator_sessions/2026-01-31_10-00-00.jsonl
      complete what lerobot-record recorded: replay it, verify it, add scene, target, task state and outcome
  lerobot-excav index outputs/paired --split=scene --eval-fraction=0.2
      hold out a fifth of the scenes, with all their episodes
  lerobot-train ... --eval_steps=500 \
      $(lerobot-excav index outputs/paired --select=non-paired --scenes=40 --split=episode --flags)
      train on one episode of each of 40 scenes
"""

import argparse
from pathlib import Path

import pandas as pd

from lerobot_excav.datasets.check.version_check import episodes_by_version, require_one_version, versions_of
from lerobot_excav.datasets.pairs.pair_coverage import START_SETTINGS, PairCoverage, pair_coverage
from lerobot_excav.datasets.pairs.selection import COMPOSITIONS, select, usable
from lerobot_excav.datasets.pairs.split import SPLIT_UNITS, Split, split
from lerobot_excav.datasets.record.environments import ENVIRONMENTS
from lerobot_excav.errors import require

DEFAULT_EVAL_FRACTION = 0.2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("dataset", type=Path, help="folder of the dataset")
    parser.add_argument(
        "--session", type=Path, help="session log of the simulated robot: add the excav.* columns first"
    )
    parser.add_argument(
        "--out", type=Path, help="with --session: put the completed dataset here, keep the recording"
    )
    parser.add_argument(
        "--skip-restarted",
        action="store_true",
        help="with --session: leave out episodes in which the scene was restarted",
    )
    group = parser.add_argument_group("choosing episodes for lerobot-train")
    group.add_argument("--select", choices=COMPOSITIONS, default="all", help="composition (default: all)")
    group.add_argument("--episodes", type=int, help="how many episodes (default: as many as there are)")
    group.add_argument("--scenes", type=int, help="how many scenes, for paired and non-paired")
    group.add_argument("--include-failures", action="store_true", help="also choose episodes without success")
    group.add_argument("--split", choices=SPLIT_UNITS, help="hold out whole scenes, or single episodes")
    group.add_argument(
        "--eval-fraction", type=float, help=f"part to hold out (default: {DEFAULT_EVAL_FRACTION})"
    )
    group.add_argument("--seed", type=int, help="seed of choice and split (default: 0)")
    group.add_argument("--flags", action="store_true", help="print nothing but the flags, for $(...)")


def run(arguments: argparse.Namespace) -> int:
    """Complete, rebuild, choose, and say what came of it."""
    from lerobot_excav.datasets.pairs.paired_index import INDEX_PATH, write_index

    _require_options_with_effect(arguments)
    root = arguments.dataset
    if arguments.session is not None:
        from lerobot_excav.datasets.complete.resimulation import complete_recording

        root = complete_recording(
            root, arguments.session, out=arguments.out, skip_restarted=arguments.skip_restarted
        )
    index = write_index(root)
    if not arguments.flags:
        print(f"{root / INDEX_PATH}: {len(index)} episodes")
        print("\n".join(describe(index, pair_coverage(index))))
    if _asks_for_episodes(arguments):
        _print_flags(arguments, root, index)
    return 0


def _require_options_with_effect(arguments: argparse.Namespace) -> None:
    for option, given in (
        ("--out", arguments.out is not None),
        ("--skip-restarted", arguments.skip_restarted),
    ):
        require(not given or arguments.session is not None, f"{option} is of use with --session only")
    require(
        arguments.eval_fraction is None or arguments.split is not None,
        f"--eval-fraction={arguments.eval_fraction} has no effect without --split; add --split=scene",
    )
    chooses = arguments.select != "all" or arguments.episodes is not None or arguments.split is not None
    require(
        arguments.seed is None or chooses,
        f"--seed={arguments.seed} has no effect without a choice; add --select, --episodes or --split",
    )


def _asks_for_episodes(arguments: argparse.Namespace) -> bool:
    counts = arguments.episodes is not None or arguments.scenes is not None
    asked = arguments.flags or arguments.split or arguments.include_failures
    return bool(counts or asked or arguments.select != "all")


def describe(index: pd.DataFrame, coverage: PairCoverage) -> list[str]:
    """Describe an index in a few lines."""
    versions = episodes_by_version(versions_of(index))
    verdicts = ", ".join(f"{count} {verdict}" for verdict, count in index["qc"].value_counts().items())
    lines = [
        "simulation: " + "; ".join(f"version {v}, {len(e)} episodes" for v, e in sorted(versions.items())),
        *(_counts(name, index[name]) for name in START_SETTINGS if name in index),
        f"scenes: {coverage.scenes}, of which {coverage.complete_scenes} with all {coverage.targets} targets",
        f"successes: {int(index['success'].sum())} of {len(index)}; quality check: {verdicts}",
        ENVIRONMENTS[index["env"].iloc[0]].summary(index),
    ]
    if len(versions) > 1:
        lines.append("mixed: a scene's number means another scene in each version, so pairs cannot be told")
        return lines
    lines += [f"missing: {scene} lacks target {targets}" for scene, targets in coverage.missing.items()]
    lines += [f"duplicate: {uid} in episodes {episodes}" for uid, episodes in coverage.duplicates.items()]
    return lines


def _counts(name: str, column: pd.Series) -> str:
    parts = [f"{value}, {count} episodes" for value, count in column.value_counts().items()]
    return f"{name}: {'; '.join(parts)}"


def _print_flags(arguments: argparse.Namespace, root: Path, index: pd.DataFrame) -> None:
    require_one_version(versions_of(index), source=root)
    seed = arguments.seed or 0
    rows = usable(index, include_failures=arguments.include_failures)
    rows = select(rows, arguments.select, episodes=arguments.episodes, scenes=arguments.scenes, seed=seed)
    if arguments.split is None:
        parts = Split(train=rows["episode_index"].tolist(), evaluation=[])
    else:
        fraction = DEFAULT_EVAL_FRACTION if arguments.eval_fraction is None else arguments.eval_fraction
        parts = split(rows, arguments.split, eval_fraction=fraction, seed=seed)
    if parts.evaluation:
        from lerobot_excav.datasets.format.episode_table import require_single_task

        require_single_task(root, [*parts.train, *parts.evaluation])
    if arguments.flags:
        print(" ".join(parts.flags()))
        return
    print(f"\nchosen: {len(parts.train)} episodes to train on, {len(parts.evaluation)} held out")
    print(
        " \\\n  ".join(
            ["lerobot-train ...", f"--dataset.root={root}", *(f"'{flag}'" for flag in parts.flags())]
        )
    )
