"""Running the stages of an experiment that are not finished, one or several at a time."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from lerobot_excav.errors import ConfigurationError, require
from lerobot_excav.evaluation.experiment.experiment import Experiment
from lerobot_excav.evaluation.experiment.stage import Stage
from lerobot_excav.evaluation.experiment.stage_record import log_path, read_record
from lerobot_excav.evaluation.experiment.stage_run import StageRun, lock_log
from lerobot_excav.evaluation.experiment.stage_state import REASONS, made_from, state

POLL_S = 0.2

Say = Callable[[str], None]


def run_experiment(experiment: Experiment, stages: Sequence[Stage], *, jobs: int, say: Say) -> bool:
    """Run the unfinished ones of some stages, each after those it needs.

    After a failure no further stage is started. An interruption (Ctrl-C) or an error here ends what is running.

    Args:
        experiment: The experiment.
        stages: Stages of it.
        jobs: How many may run at a time.
        say: Takes lines for the user.

    Returns:
        Whether all succeeded.

    Raises:
        ConfigurationError: `jobs` is not positive, or a needed stage is neither finished nor chosen.
    """
    require(jobs >= 1, f"--jobs={jobs} must be at least 1")
    waiting = [stage for stage in stages if not stage.is_finished]
    _require_needs(experiment, waiting)
    _tell_finished(experiment, stages, say)
    running: list[StageRun] = []
    failed: list[str] = []
    try:
        while running or (waiting and not failed):
            if not failed:
                failed += _start_ready(experiment, waiting, running, jobs, say)
            for ended in [run for run in running if run.exit_code is not None]:
                running.remove(ended)
                if not _end(ended, say):
                    failed.append(ended.stage.name)
            time.sleep(POLL_S)
    except BaseException:
        for run in running:
            run.stop()
        for run in running:
            run.finish()
        raise
    return not failed


def _require_needs(experiment: Experiment, waiting: Sequence[Stage]) -> None:
    chosen = {stage.name for stage in waiting}
    for stage in waiting:
        for need in stage.needs:
            require(
                need in chosen or experiment.stage(need).is_finished,
                f"stage {stage.name} needs {need}, which is not finished; add it: --only {need} {stage.name}",
            )


def _tell_finished(experiment: Experiment, stages: Sequence[Stage], say: Say) -> None:
    for stage in stages:
        if stage.is_finished:
            reason = REASONS.get(state(experiment, stage))
            hint = f", but {reason}; remove it to run the stage again" if reason else ""
            say(f"= {stage.name}: {stage.makes} is finished{hint}")


def _start_ready(
    experiment: Experiment, waiting: list[Stage], running: list[StageRun], jobs: int, say: Say
) -> list[str]:
    """Start the stages whose turn it is; return those that could not be started."""
    pending = {stage.name for stage in waiting} | {run.stage.name for run in running}
    ready = [stage for stage in waiting if not pending.intersection(stage.needs)]
    refused = []
    for stage in ready[: max(0, jobs - len(running))]:
        waiting.remove(stage)
        log = experiment_log(experiment, stage)
        try:
            output = lock_log(log, stage.name)
        except ConfigurationError as error:
            say(f"! {stage.name}: {error}")
            refused.append(stage.name)
            continue
        if stage.is_finished:
            output.close()
            say(f"= {stage.name}: another process has finished {stage.makes}")
            continue
        _announce(experiment, stage, log, say)
        needs = made_from(experiment, stage)
        running.append(StageRun(stage, experiment.environment, output, needs=needs))
    return refused


def _announce(experiment: Experiment, stage: Stage, log: Path, say: Say) -> None:
    for need in map(experiment.stage, stage.needs):
        if reason := REASONS.get(state(experiment, need)):
            say(f"! {stage.name}: works on {need.makes}, which {reason}; remove that to make it again")
    say(f"> {stage.name}{' (continued)' if stage.resumes else ''}; its output: {log}")
    say("    " + " && \\\n    ".join(stage.shell_lines()))
    if _goes_on_differently(stage):
        say(
            f"    begun by another command than the file has now, and goes on as that; or remove {stage.workspace}"
        )


def _goes_on_differently(stage: Stage) -> bool:
    record = read_record(stage.makes) if stage.makes is not None and stage.resumes else None
    return record is not None and record.command != stage.command


def experiment_log(experiment: Experiment, stage: Stage) -> Path:
    """Return the file that takes a stage's output."""
    if stage.makes is not None:
        return log_path(stage.makes)
    return Path("outputs") / f"{experiment.path.absolute().parent.name}-{stage.name}.log"


def _end(run: StageRun, say: Say) -> bool:
    succeeded = run.finish()
    verdict = "finished" if succeeded else f"FAILED {_reason(run)}, see {run.log},"
    say(f"{'=' if succeeded else '!'} {run.stage.name}: {verdict} after {run.wall_s / 60:.1f} min")
    if succeeded and run.stage.makes is None:
        say(run.output())
    return succeeded


def _reason(run: StageRun) -> str:
    if run.exit_code:
        return f"with exit code {run.exit_code}"
    return f"without making {run.stage.workspace}, though its command succeeded"
