r"""Rebuild the paired-scene index of a dataset and use it.

The index (meta/excav_pairs.parquet, one row per episode) is derived from the dataset's own columns; rebuild it after
every edit. With --select and --split it prints the flags that make stock lerobot-train use exactly those episodes.

Examples:
  lerobot-excav index outputs/paired
      rebuild; list starts with missing or duplicate targets
  lerobot-excav index outputs/recorded --session=outputs/excavator_sim_sessions/2026-01-31_10-00-00.jsonl
      complete what lerobot-record recorded: replay it, verify it, add scene, target, task state and outcome
  lerobot-excav index outputs/rolled_out --session=outputs/session.jsonl --operator=policy
      the same where the log does not say that a policy commanded, as a program of one's own may
  lerobot-excav index outputs/recorded --session=outputs/session.jsonl --recover
      after a crash of lerobot-record: play every finished episode again, and write a dataset that can be read
  lerobot-excav index outputs/paired --split=scene --eval_fraction=0.2
      hold out a fifth of the scenes, with all their episodes
  lerobot-train ... --eval_steps=500 \
      $(lerobot-excav index outputs/paired --select=non-paired --starts=40 --split=episode --flags=true)
      train on one episode of each of 40 scenes
"""

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from lerobot_excav.datasets.format.schema import OPERATORS
from lerobot_excav.datasets.format.version_check import episodes_by_version, require_one_version, versions_of
from lerobot_excav.datasets.pairs.pair_coverage import PairCoverage, pair_coverage, start_settings
from lerobot_excav.datasets.pairs.selection import COMPOSITIONS, select, usable
from lerobot_excav.datasets.pairs.split import SPLIT_UNITS, Split, split
from lerobot_excav.envs.tasks.registry import task_spec
from lerobot_excav.errors import require
from lerobot_excav.scripts.qc import DatasetArguments
from lerobot_excav.setting import setting

DEFAULT_EVAL_FRACTION = 0.2


@dataclass(kw_only=True)
class IndexArguments(DatasetArguments):
    """Arguments of `lerobot-excav index`."""

    session: Path | None = setting("Session log of the simulated robot: add the excav.* columns first", default=None)
    out: Path | None = setting("With a session: put the completed dataset here, and keep the recording", default=None)
    skip_restarted: bool = setting("With a session: leave out episodes in which the scene was restarted", default=False)
    operator: str | None = setting(
        "With a session: who commanded the episodes of which the log does not say it; left out: a person",
        default=None,
        choices=OPERATORS,
    )
    recover: bool = setting(
        "With a session: write the dataset again after a crash, pictures included, instead of completing it; the "
        "damaged files are kept beside it",
        default=False,
    )
    task: str | None = setting(
        "With --recover: task text where none can be read; left out: that of the session log", default=None
    )
    select: str = setting("Composition of the episodes to train on", default="all", choices=COMPOSITIONS)
    episodes: int | None = setting("How many episodes; left out: as many as there are", default=None, low=1)
    starts: int | None = setting("How many starts, scenes at a stage, for paired and non-paired", default=None, low=1)
    include_failures: bool = setting("Whether to choose episodes without success as well", default=False)
    split: str | None = setting("Hold out whole scenes, or single episodes", default=None, choices=SPLIT_UNITS)
    eval_fraction: float | None = setting(
        f"Part to hold out; left out: {DEFAULT_EVAL_FRACTION}", default=None, low=0.0, below=1.0
    )
    seed: int | None = setting("Seed of choice and split; left out: 0", default=None, low=0)
    flags: bool = setting("Whether to print nothing but the flags, for $(...)", default=False)


def run(arguments: IndexArguments) -> int:
    """Complete, rebuild, choose, and say what came of it."""
    from lerobot_excav.datasets.pairs.paired_index import INDEX_PATH, write_index

    _require_options_with_effect(arguments)
    root = arguments.root
    if arguments.recover:
        return _recover(arguments)
    if arguments.session is not None:
        from lerobot_excav.datasets.complete.resimulation import complete_recording

        root = complete_recording(
            root,
            arguments.session,
            out=arguments.out,
            skip_restarted=arguments.skip_restarted,
            operator=arguments.operator,
        )
    index = write_index(root)
    if not arguments.flags:
        print(f"{root / INDEX_PATH}: {len(index)} episodes")
        print("\n".join(describe(index, pair_coverage(index))))
    if _asks_for_episodes(arguments):
        _print_flags(arguments, root, index)
    return 0


def _require_options_with_effect(arguments: IndexArguments) -> None:
    with_session = {
        "--out": arguments.out is not None,
        "--skip_restarted": arguments.skip_restarted,
        "--operator": arguments.operator is not None,
        "--recover": arguments.recover,
    }
    for option, given in with_session.items():
        require(not given or arguments.session is not None, f"{option} is of use with --session only")
    require(arguments.task is None or arguments.recover, "--task is of use with --recover only")
    completes = arguments.skip_restarted or arguments.operator is not None
    others = completes or arguments.seed is not None or arguments.eval_fraction is not None
    require(
        not arguments.recover or not (others or _asks_for_episodes(arguments)),
        "--recover only writes the dataset again; complete it afterwards, with --session and without --recover",
    )
    require(
        arguments.eval_fraction is None or arguments.split is not None,
        f"--eval_fraction={arguments.eval_fraction} has no effect without --split; add --split=scene",
    )
    chooses = arguments.select != "all" or arguments.episodes is not None or arguments.split is not None
    require(
        arguments.seed is None or chooses,
        f"--seed={arguments.seed} has no effect without a choice; add --select, --episodes or --split",
    )


def _recover(arguments: IndexArguments) -> int:
    from lerobot_excav.datasets.complete.recovery import recover_recording

    assert arguments.session is not None  # checked before
    recovery = recover_recording(arguments.root, arguments.session, out=arguments.out, task=arguments.task)
    print(f"{recovery.root}: {recovery.episodes} episodes recovered; task: {', '.join(map(repr, recovery.texts))}")
    if recovery.lost is not None:
        print(f"episode {recovery.lost} was not finished, and is left out")
    if recovery.aside is not None:
        print(f"the damaged files are in {recovery.aside}; remove that folder when you do not need it any more")
    print(
        f"go on recording with lerobot-record --resume=true and --robot.session_log={arguments.session}, or complete "
        f"the dataset:\n  lerobot-excav index {arguments.root if arguments.out is None else arguments.out} "
        f"--session={arguments.session}"
    )
    return 0


def _asks_for_episodes(arguments: IndexArguments) -> bool:
    counts = arguments.episodes is not None or arguments.starts is not None
    asked = arguments.flags or arguments.split or arguments.include_failures
    return bool(counts or asked or arguments.select != "all")


def describe(index: pd.DataFrame, coverage: PairCoverage) -> list[str]:
    """Describe an index in a few lines."""
    versions = episodes_by_version(versions_of(index))
    verdicts = ", ".join(f"{count} {verdict}" for verdict, count in index["qc"].value_counts().items())
    lines = [
        "simulation: " + "; ".join(f"version {v}, {len(e)} episodes" for v, e in versions.items()),
        *(_counts(name, index[name]) for name in start_settings(index)),
        f"{_starts(index, coverage)}, of which {coverage.complete_starts} with all {_all_targets(index, coverage)}",
        f"successes: {int(index['success'].sum())} of {len(index)}; quality check: {verdicts}",
        *(task_spec("excav.task", str(task)).measures.summary(rows) for task, rows in index.groupby("task")),
    ]
    if len(versions) > 1:
        lines.append("mixed: a scene's number means another scene in each version, so pairs cannot be told")
        return lines
    lines += [f"missing: {start} lacks target {targets}" for start, targets in coverage.missing.items()]
    lines += [f"duplicate: {uid} in episodes {episodes}" for uid, episodes in coverage.duplicates.items()]
    return lines


def _all_targets(index: pd.DataFrame, coverage: PairCoverage) -> str:
    """Say what a complete start has: how many regions a later stage offers is known by those shown only."""
    return f"{coverage.targets} targets" if set(index["stage"]) == {0} else "targets that are known of them"


def _starts(index: pd.DataFrame, coverage: PairCoverage) -> str:
    """Say how many starts there are, and that they are scenes where every scene is shown at one stage."""
    stages = sorted(set(index["stage"]))
    if stages == [0]:
        return f"scenes: {coverage.starts}"
    return f"starts: {coverage.starts} of {coverage.scenes} scenes at stages {', '.join(map(str, stages))}"


def _counts(name: str, column: pd.Series) -> str:
    parts = [f"{value}, {count} episodes" for value, count in column.value_counts().items()]
    return f"{name}: {'; '.join(parts)}"


def _print_flags(arguments: IndexArguments, root: Path, index: pd.DataFrame) -> None:
    require_one_version(versions_of(index), source=root)
    seed = arguments.seed or 0
    rows = usable(index, include_failures=arguments.include_failures)
    rows = select(rows, arguments.select, episodes=arguments.episodes, starts=arguments.starts, seed=seed)
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
    print(" \\\n  ".join(["lerobot-train ...", f"--dataset.root={root}", *(f"'{flag}'" for flag in parts.flags())]))


ARGUMENTS = IndexArguments
