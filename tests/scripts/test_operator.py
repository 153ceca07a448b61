import json

import pytest

from lerobot_excav.scripts.main import main

SHORT = ("--scenes=1", "--targets=1", "--env.episode_length=4", "--workers=0")


@pytest.mark.parametrize(
    ("env_type", "options", "expected", "column"),
    [
        (
            "fr5_grasp",
            ["--env.retarget_frame=2"],
            {"task": "FR5Grasp-v0", "scene_set": "train"},
            "target selection [%]",
        ),
        ("toy_reach", ["--env.scene_set=val"], {"task": "Reach-v0", "scene_set": "val"}, "distance [m]"),
    ],
)
def test_the_operator_plays_scenes_and_a_report_is_printed(tmp_path, capsys, env_type, options, expected, column):
    metrics = tmp_path / "operator.jsonl"
    assert main(["operator", f"--env.type={env_type}", *SHORT, *options, f"--metrics={metrics}"]) == 0
    (line,) = map(json.loads, metrics.read_text().splitlines())
    assert line.items() >= {**expected, "operator": "scripted", "frames": 4}.items()
    assert [frame for frame, _ in line["commands"]] == ([0, 2] if "retarget" in options[0] else [0])
    assert column in capsys.readouterr().out


@pytest.mark.parametrize("option", ["mask_condition=zero", "target_overlay=true"])
def test_options_of_the_mask_are_refused_where_they_have_no_effect(option, tmp_path, capsys):
    assert main(["operator", "--env.type=toy_reach", f"--env.{option}", f"--metrics={tmp_path / 'm'}"]) == 2
    assert f"--env.{option.partition('=')[0]}=" in capsys.readouterr().err
    assert not (tmp_path / "m").exists()
