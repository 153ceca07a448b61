import os
import signal
import threading
import time

import pytest

from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.evaluation.experiment.runner import run_experiment
from lerobot_excav.evaluation.experiment.stage_record import log_path, read_record
from lerobot_excav.evaluation.experiment.stage_run import StageRun, lock_log
from lerobot_excav.evaluation.experiment.stage_state import state

# A command that leaves a trace of every run, then makes its folder.
COUNTED = """
[[stage]]
name = "{name}"
makes = "{{tmp}}/{name}"
command = "echo run >> {{tmp}}/{name}.runs && {command}"
"""


def counted(name="data", command="mkdir {makes}"):
    return COUNTED.format(name=name, command=command)


def runs(tmp_path, name="data"):
    path = tmp_path / f"{name}.runs"
    return len(path.read_text().split()) if path.exists() else 0


def wait_for(started):
    while started.exit_code is None:
        time.sleep(0.05)


def run(experiment, *only, jobs=1):
    said = []
    succeeded = run_experiment(experiment, experiment.select(only), jobs=jobs, say=said.append)
    return succeeded, "\n".join(said)


def test_a_finished_stage_is_not_run_again(experiment, tmp_path):
    for _ in range(2):
        assert run(experiment(counted()))[0]
    assert runs(tmp_path) == 1
    assert (tmp_path / "data").is_dir()


def test_what_was_made_by_hand_is_finished(experiment, tmp_path):
    (tmp_path / "data").mkdir()
    succeeded, said = run(experiment(counted()))
    assert succeeded
    assert runs(tmp_path) == 0
    assert "data is finished" in said


def test_a_failed_stage_leaves_no_result_and_is_run_again_from_nothing(experiment, tmp_path):
    command = "mkdir {makes} && touch {makes}/half && test -e {tmp}/repaired"
    broken = experiment(counted(command=command))
    succeeded, said = run(broken)
    assert not succeeded
    assert "data: FAILED with exit code 1" in said
    assert not (tmp_path / "data").exists()
    assert state(broken, broken.stages[0]) == "interrupted"
    (tmp_path / "repaired").touch()
    assert run(broken)[0]  # mkdir would fail, were the half result still there
    assert runs(tmp_path) == 2
    assert [attempt["exit_code"] for attempt in read_record(tmp_path / "data").attempts] == [0]


def test_a_command_that_makes_nothing_has_failed(experiment, tmp_path):
    succeeded, said = run(experiment(counted(command="true")))
    assert not succeeded
    assert f"FAILED without making {tmp_path}/data.partial, though its command succeeded" in said


def test_a_fresh_start_begins_a_new_log(experiment, tmp_path):
    assert not run(experiment(counted(command="echo before && false")))[0]
    assert run(experiment(counted(command="echo after && mkdir {makes}")))[0]
    log = log_path(tmp_path / "data").read_text()
    assert "after" in log
    assert "before" not in log


def test_after_a_failure_nothing_further_is_started(experiment, tmp_path):
    assert not run(experiment(counted("bad", "false") + counted("next")))[0]
    assert runs(tmp_path, "next") == 0


RESUMED = """
[[stage]]
name = "train"
makes = "{tmp}/train"
command = "mkdir {makes} && touch {makes}/checkpoint && false"
resume_from = "{makes}/checkpoint"
resume = "test -f {resume_from} && touch {makes}/resumed"
"""


def test_an_interrupted_training_goes_on_from_its_checkpoint(experiment, tmp_path):
    training = experiment(RESUMED)
    assert not run(training)[0]
    assert training.stages[0].resumes
    succeeded, said = run(training)
    assert succeeded
    assert "train (continued)" in said
    assert sorted(path.name for path in (tmp_path / "train").iterdir()) == ["checkpoint", "resumed"]
    record = read_record(tmp_path / "train")
    assert record.command == training.stages[0].command
    assert [attempt["exit_code"] for attempt in record.attempts] == [1, 0]
    assert training.stages[0].command in log_path(tmp_path / "train").read_text()
    assert record.wall_s == pytest.approx(sum(attempt["wall_s"] for attempt in record.attempts))


def test_a_training_goes_on_under_its_own_command_when_its_runner_was_killed(experiment, tmp_path):
    training = experiment(RESUMED)
    (stage,) = training.stages
    log = lock_log(log_path(stage.makes), stage.name)
    wait_for(StageRun(stage, {}, log, needs={}))
    log.close()  # without `finish`: its end is never seen
    (tmp_path / "train.partial").mkdir(exist_ok=True)
    (tmp_path / "train.partial" / "checkpoint").touch()
    assert run(training)[0]
    assert read_record(stage.makes).command == stage.command
    assert state(training, stage) == "finished"


def test_a_training_that_goes_on_with_other_settings_than_the_file_has_says_so(experiment):
    assert not run(experiment(RESUMED))[0]
    said = run(experiment(RESUMED.replace("touch {makes}/checkpoint", "echo > {makes}/checkpoint")))[1]
    assert "begun by another command than the file has now" in said
    assert "remove" in said


def test_a_stage_waits_for_those_it_needs(experiment, tmp_path):
    text = counted("slow", "sleep 0.5 && mkdir {makes}")
    text += counted("after", "test -d {tmp}/slow && mkdir {makes}") + 'needs = ["slow"]\n'
    assert run(experiment(text), jobs=2)[0]


def test_a_needed_stage_must_be_finished_or_chosen(experiment):
    chain = experiment(counted("a") + counted("b") + 'needs = ["a"]\n')
    with pytest.raises(
        ConfigurationError, match="stage b needs a, which is not finished; add it: --only a b"
    ):
        run(chain, "b")
    assert run(chain, "a")[0]
    assert run(chain, "b")[0]


def test_jobs_run_side_by_side(experiment):
    # Each waits for the other's trace, so alone neither would end.
    def meet(other):
        return f"until test -e {{tmp}}/{other}.runs; do sleep 0.05; done; mkdir {{makes}}"

    assert run(experiment(counted("a", meet("b")) + counted("b", meet("a"))), jobs=2)[0]


def test_the_record_tells_command_environment_code_and_time(experiment, tmp_path):
    text = '[environment]\nCOLOUR = "red"\n' + counted(command="mkdir {makes} && echo $COLOUR")
    assert run(experiment(text))[0]
    record = read_record(tmp_path / "data")
    assert record.command == experiment(text).stages[0].command
    assert record.environment == {"COLOUR": "red"}
    assert record.commit is None or len(record.commit) == 40
    assert {"lerobot", "lerobot_env_excav", "torch", "mujoco"} <= set(record.packages)
    assert record.wall_s >= 0.0
    assert log_path(tmp_path / "data").read_text().endswith("red\n")


def test_a_result_of_another_command_is_kept_and_said(experiment, tmp_path):
    run(experiment(counted()))
    changed = experiment(counted(command="mkdir -p {makes}"))
    assert state(changed, changed.stages[0]) == "changed"
    assert "by another command, or in another environment, than the file has now" in run(changed)[1]
    assert runs(tmp_path) == 1


def test_a_stage_without_result_runs_every_time_and_shows_its_output(experiment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = experiment('[[stage]]\nname = "report"\ncommand = "echo a table"')
    for _ in range(2):
        succeeded, said = run(table)
        assert succeeded
        assert said.count("a table") == 2  # the command and what it printed
    assert state(table, table.stages[0]) == "always"


@pytest.fixture
def heeding_interruptions():
    """Heed Ctrl-C, which a test run in the background ignores."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heeding_interruptions")
def test_an_interruption_ends_the_command_and_leaves_no_result(experiment, tmp_path):
    running = experiment(counted(command="mkdir {makes} && echo $$ > {tmp}/pid && sleep 60"))

    def interrupt():
        while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        run(running)
    assert state(running, running.stages[0]) == "interrupted"
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_two_runners_do_not_work_on_one_stage(experiment, tmp_path):
    busy = experiment(counted(command="touch {tmp}/started && sleep 1 && mkdir {makes}"))
    other = threading.Thread(target=run, args=(busy,))
    other.start()
    while not (tmp_path / "started").exists():
        time.sleep(0.05)
    succeeded, said = run(busy)
    assert not succeeded
    assert "another process is at stage data" in said
    other.join()
    assert runs(tmp_path) == 1
    assert (tmp_path / "data").exists()


def test_what_another_process_finishes_meanwhile_is_not_run_again(experiment, tmp_path):
    both = experiment(
        counted("slow", "until test -e {tmp}/b; do sleep 0.05; done; mkdir {makes}") + counted("b")
    )
    said = []
    other = threading.Thread(target=lambda: said.extend(run(both)))
    other.start()
    while not (tmp_path / "slow.runs").exists():
        time.sleep(0.05)
    assert run(both, "b")[0]
    other.join()
    assert said[0]
    assert f"b: another process has finished {tmp_path}/b" in said[1]
    assert runs(tmp_path, "b") == 1


def test_a_stage_is_held_until_its_result_is_in_place(experiment, tmp_path):
    (stage,) = experiment(counted()).stages
    log = log_path(stage.makes)
    running = StageRun(stage, {}, lock_log(log, stage.name), needs={})
    wait_for(running)
    with pytest.raises(ConfigurationError, match="another process is at stage data"):
        lock_log(log, stage.name)
    assert running.finish()
    lock_log(log, stage.name).close()


def test_an_error_of_the_runner_ends_what_is_running(experiment, tmp_path):
    damaged = counted(
        "damaged", "until test -s {tmp}/pid; do sleep 0.05; done; echo damaged > {tmp}/damaged.json"
    )
    long = counted("long", "echo $$ > {tmp}/pid && sleep 60")
    with pytest.raises(DatasetError, match=r"damaged\.json is damaged"):
        run(experiment(damaged + long), jobs=2)
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)
    assert [attempt["exit_code"] for attempt in read_record(tmp_path / "long").attempts] == [-signal.SIGTERM]


IN_PLACE = """
[[stage]]
name = "data"
makes = "{tmp}/data"
appears_whole = true
command = "test -e {tmp}/data.partial || { touch {tmp}/data.partial; WORD; }; mv {tmp}/data.partial {makes}"
"""


def test_a_removed_result_that_appears_whole_gets_a_new_record(experiment, tmp_path):
    for word in ("true", "echo"):
        made = experiment(IN_PLACE.replace("WORD", word))
        assert run(made)[0]
        assert state(made, made.stages[0]) == "finished"
        assert len(read_record(tmp_path / "data").attempts) == 1
        (tmp_path / "data").unlink()


def test_an_interrupted_result_that_appears_whole_keeps_the_record_it_was_begun_with(experiment, tmp_path):
    made = experiment(IN_PLACE.replace("WORD", "false"))
    assert not run(made)[0]
    assert run(made)[0]
    assert [attempt["exit_code"] for attempt in read_record(tmp_path / "data").attempts] == [1, 0]
