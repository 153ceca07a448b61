import json

import pytest

from lerobot_excav.scripts.main import main

SHORT = ("--scenes=1", "--targets=1", "--env.episode_length=4", "--workers=0")


@pytest.mark.parametrize(
    ("options", "expected", "column"),
    [
        (
            ["--env.type=fr5_grasp", "--env.retarget_frame=2"],
            {"task": "FR5Grasp-v0", "scene_set": "test", "commands": [[0, 0], [2, 3]]},
            "target selection [%]",
        ),
        (
            ["--env.type=toy_reach", "--env.scene_set=val"],
            {"task": "Reach-v0", "scene_set": "val", "commands": [[0, 0]]},
            "distance [m]",
        ),
    ],
)
def test_the_operator_plays_test_scenes_unless_told_otherwise(tmp_path, capsys, options, expected, column):
    metrics = tmp_path / "operator.jsonl"
    assert main(["operator", *SHORT, *options, f"--metrics={metrics}"]) == 0
    (line,) = map(json.loads, metrics.read_text().splitlines())
    expected |= {"operator": "scripted", "frames": 4}
    assert {name: line[name] for name in expected} == expected
    assert column in capsys.readouterr().out


@pytest.mark.parametrize("option", ["mask_condition=zero", "mask_snap=true", "target_overlay=true"])
def test_options_of_the_mask_are_refused_as_they_have_no_effect(option, tmp_path, capsys):
    assert main(["operator", "--env.type=toy_reach", f"--env.{option}", f"--metrics={tmp_path / 'm'}"]) == 2
    assert f"--env.{option.partition('=')[0]}=" in capsys.readouterr().err
    assert not (tmp_path / "m").exists()
