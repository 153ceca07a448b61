from pathlib import Path

import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.experiment.experiment import read_experiment


def test_words_stand_in_braces_and_may_hold_further_ones(experiment):
    text = """
    steps = 3
    training = "--steps={steps} --log_freq=1"
    [[stage]]
    name = "train"
    command = "lerobot-train {training} --policy.shape={2}"
    """
    with pytest.raises(ConfigurationError, match=r"train: \{2\} is not known; allowed: .*steps"):
        experiment(text)
    (stage,) = experiment(text.replace("{2}", "[2]")).stages
    assert stage.command == "lerobot-train --steps=3 --log_freq=1 --policy.shape=[2]"


def test_a_setting_given_by_the_user_wins(experiment):
    text = 'steps = 3\n[[stage]]\nname = "a"\ncommand = "echo {steps}"'
    assert experiment(text, steps="7").stages[0].command == "echo 7"
    with pytest.raises(ConfigurationError, match=r"--set='stepz' is not known; allowed: .*'steps'"):
        experiment(text, stepz="7")


def test_each_makes_a_stage_per_table(experiment):
    stages = experiment("""
    [[stage]]
    name = "data-{kind}"
    each = [{kind = "a", count = 1}, {kind = "b", count = 2}]
    makes = "{tmp}/{kind}"
    command = "make {count} > {makes}"
    [[stage]]
    name = "table"
    needs = ["data-*"]
    command = "cat"
    """).stages
    assert [stage.name for stage in stages] == ["data-a", "data-b", "table"]
    assert stages[1].command == f"make 2 > {stages[1].makes}.partial"
    assert stages[2].needs == ("data-a", "data-b")


def test_a_result_that_appears_whole_is_made_in_place(experiment):
    (stage,) = experiment("""
    [[stage]]
    name = "data"
    makes = "{tmp}/data"
    appears_whole = true
    command = "demos --out={makes}"
    """).stages
    assert stage.shell_lines() == [f"demos --out={stage.makes}"]


def test_the_shell_lines_make_the_result_beside_and_move_it(experiment):
    (stage,) = experiment("""
    [[stage]]
    name = "data"
    makes = "{tmp}/data"
    command = "mkdir {makes}"
    """).stages
    partial = f"{stage.makes}.partial"
    assert stage.shell_lines() == [f"rm -rf {partial}", f"mkdir {partial}", f"mv {partial} {stage.makes}"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[stage]]\nname = "a"', "lacks 'command'"),
        ('[[stage]]\nname = "a"\ncommand = "c"\nmake = "x"', "key of a stage='make' is not known"),
        ('[[stages]]\nname = "a"', "table='stages' is not known"),
        ('[[stage]]\nname = "a"\ncommand = "c"\nneeds = ["b"]', "a needs 'b', which is no earlier stage"),
        ('[[stage]]\nname = "a"\ncommand = "c"\nneeds = ["a"]', "a needs 'a', which is no earlier stage"),
        (
            '[[stage]]\nname = "a"\ncommand = "c"\n[[stage]]\nname = "a"\ncommand = "c"',
            "two stages are called 'a'",
        ),
        ('[[stage]]\nname = "a"\ncommand = "c"\nresume = "r"', "resume and resume_from go together"),
        ('a = "{b}"\nb = "{a}"\n[[stage]]\nname = "s"\ncommand = "{a}"', "name each other without end"),
        ("[[stage", "is no TOML"),
    ],
)
def test_a_file_that_cannot_be_used_says_why(experiment, text, message):
    with pytest.raises(ConfigurationError, match=message):
        experiment(text)


def test_a_missing_file_is_named():
    with pytest.raises(ConfigurationError, match=r"nowhere\.toml does not exist"):
        read_experiment(Path("nowhere.toml"))


def test_stages_are_chosen_by_pattern(experiment):
    chosen = experiment("""
    [[stage]]
    name = "test-{n}"
    each = [{n = 1}, {n = 2}]
    command = "c"
    [[stage]]
    name = "report"
    command = "c"
    """)
    assert [stage.name for stage in chosen.select(["test-*"])] == ["test-1", "test-2"]
    assert len(chosen.select([])) == 3
    with pytest.raises(ConfigurationError, match="--only='tset' matches no stage"):
        chosen.select(["tset"])


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("command = 3", "command=3 is no text"),
        ('command = "true"\neach = 4', "each=4 is no list"),
        ('command = "true"\neach = [1]', "entry of a stage's each=1 is no table"),
        ('command = "true"\neach = []', r"each=\[\] makes no stage 'a'"),
        ('command = "true"\nneeds = [1]', "entry of a stage's needs=1 is no text"),
        ('command = "true"\nmakes = ""', "the path '' is empty"),
        ('command = "true"\nappears_whole = "false"', "appears_whole='false' is no truth value"),
    ],
)
def test_entries_of_another_type_are_named(experiment, entry, message):
    with pytest.raises(ConfigurationError, match=message):
        experiment(f'[[stage]]\nname = "a"\n{entry}\n')


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("settings = 3", "settings=3 is no table"),
        ("environment = 3", "environment=3 is no table"),
        ("stage = 3", "stage=3 is no list"),
        ("stage = [3]", "stage=3 is no table"),
    ],
)
def test_tables_of_another_type_are_named(tmp_path, content, message):
    path = tmp_path / "stages.toml"
    path.write_text(content)
    with pytest.raises(ConfigurationError, match=message):
        read_experiment(path)


def test_variables_of_bash_are_left_to_it(experiment):
    text = '[[stage]]\nname = "a"\ncommand = "echo ${HOME} ${{tmp}}"'
    assert experiment(text, tmp="TMPDIR").stages[0].command == "echo ${HOME} ${TMPDIR}"


MADE = '[[stage]]\nname = "a"\nmakes = "{tmp}/a"\ncommand = "mkdir {makes}"'


def test_a_path_with_white_space_is_refused(experiment):
    with pytest.raises(ConfigurationError, match="a: the path 'my out/a' has white space"):
        experiment(MADE, tmp="my out")


def test_a_comment_within_a_command_is_refused(experiment):
    text = '[[stage]]\nname = "a"\ncommand = """\nmkdir x\n# make it\n&& false"""'
    with pytest.raises(ConfigurationError, match="a: bash would take what follows ' #' for a comment"):
        experiment(text)
    assert experiment(text.replace("# make it", "--name=a#1")).stages
