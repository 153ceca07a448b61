import argparse

import pytest

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.scripts import bench, demos
from lerobot_excav.scripts.demonstration_arguments import settings_from


def parse(command, *arguments):
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return parser.parse_args(arguments)


def test_the_defaults_are_those_of_the_settings():
    assert settings_from(parse(demos, "--out=x")) == DemonstrationSettings()


def test_the_operator_digs_in_test_scenes_by_default():
    settings = settings_from(parse(bench, "operator", "--metrics=x"))
    assert settings == DemonstrationSettings(scene_set="test", scenes=100)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("task", "Scoop-v0"),
        ("scene_set", "val"),
        ("first_scene", 7),
        ("scenes", 3),
        ("targets", 2),
        ("seed", 5),
        ("fps", 5),
        ("height", 64),
        ("width", 64),
        ("soil", "gravel"),
        ("fidelity", "fine"),
        ("episode_length", 50),
        ("storage", "video"),
    ],
)
def test_every_option_reaches_the_settings(field, value):
    settings = settings_from(parse(demos, "--out=x", f"--{field.replace('_', '-')}={value}"))
    assert getattr(settings, field) == value


def test_the_defaults_of_the_arm_are_its_own():
    assert settings_from(parse(demos, "--out=x", "--env=fr5_grasp")) == DemonstrationSettings.of("fr5_grasp")


def test_the_rule_for_targets_reaches_the_settings():
    settings = settings_from(parse(demos, "--out=x", "--targets=1", "--target-rule=uniform"))
    assert settings.target_rule == "uniform"


def test_a_setting_of_another_environment_is_refused():
    with pytest.raises(ConfigurationError, match="--soil='sand' has no meaning for --env=fr5_grasp"):
        settings_from(parse(demos, "--out=x", "--env=fr5_grasp", "--soil=sand"))


def test_help_tells_the_defaults_of_every_environment(capsys):
    with pytest.raises(SystemExit):
        parse(demos, "--help")
    assert "default: 10 for excavator, 50 for fr5_grasp" in " ".join(capsys.readouterr().out.split())


def test_keeping_failures_is_a_switch():
    assert settings_from(parse(demos, "--out=x", "--keep-failures")).keep_failures


def test_the_shared_workers_option_is_there():
    assert parse(demos, "--out=x", "--workers=5").workers == 5
