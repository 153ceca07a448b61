import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lerobot_excav.datasets.record.environments import ENVIRONMENTS

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.envs.tasks.grasp.nearest_block import nearest_block
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.errors import ConfigurationError


@given(first=st.integers(0, 50), scenes=st.integers(1, 40), targets=st.integers(1, 4))
def test_every_scene_is_shown_with_as_many_different_targets_as_asked_for(first, scenes, targets):
    settings = DemonstrationSettings(first_scene=first, scenes=scenes, targets=targets)
    pairs = settings.pairs()
    assert len(set(pairs)) == len(pairs) == scenes * targets
    assert set(Counter(pair.scene_id for pair in pairs).values()) == {targets}
    frequency = Counter(pair.target_id for pair in pairs)
    assert max(frequency.values()) - min(frequency[t] for t in range(4)) <= targets
    assert pairs == sorted(pairs)


def test_one_target_per_scene_goes_round_the_targets():
    pairs = DemonstrationSettings(scenes=8, targets=1).pairs()
    assert [pair.target_id for pair in pairs] == [0, 1, 2, 3, 0, 1, 2, 3]


def test_drawn_targets_are_equally_likely_and_belong_to_their_scene():
    settings = DemonstrationSettings(scenes=400, targets=1, target_rule="uniform")
    targets = [pair.target_id for pair in settings.pairs()]
    assert min(Counter(targets).values()) > 70  # 100 each, 3.5 standard deviations below
    assert [pair.target_id for pair in replace(settings, first_scene=7, scenes=3).pairs()] == targets[7:10]
    assert [pair.target_id for pair in replace(settings, seed=1).pairs()] != targets
    assert [pair.target_id for pair in replace(settings, scene_set="val").pairs()] != targets


def test_the_nearest_target_is_that_of_the_scene():
    settings = DemonstrationSettings.of("fr5_grasp", scenes=5, targets=1, target_rule="nearest")
    nearest = [nearest_block(draw_scene("train", scene_id)) for scene_id in range(5)]
    assert [pair.target_id for pair in settings.pairs()] == nearest
    assert nearest != [pair.target_id for pair in replace(settings, target_rule="round").pairs()]


@pytest.mark.parametrize(
    ("env", "changes", "message"),
    [
        (
            "excavator",
            {"targets": 1, "target_rule": "nearest"},
            "--target-rule=nearest has no meaning for --env=excav",
        ),
        (
            "excavator",
            {"targets": 2, "target_rule": "uniform"},
            "--target-rule=uniform chooses a single target",
        ),
        ("fr5_grasp", {"soil": "sand"}, "--soil='sand' has no meaning for --env=fr5_grasp"),
        ("fr5_grasp", {"fidelity": "fast"}, "--fidelity='fast' has no meaning for --env=fr5_grasp"),
        ("fr5_grasp", {"task": "Scoop-v0"}, "--task='Scoop-v0' is not known; allowed: 'FR5Grasp-v0'"),
        ("fr5_grasp", {"first_scene": 2**63}, f"--first-scene={2**63} is not possible"),
        ("lathe", {}, "--env='lathe' is not known; allowed: 'excavator', 'fr5_grasp'"),
    ],
)
def test_what_makes_no_sense_in_an_environment_is_refused(env, changes, message):
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        DemonstrationSettings.of(env, **changes)


def test_defaults_are_those_of_the_environment():
    assert DemonstrationSettings.of("excavator") == DemonstrationSettings()
    arm = DemonstrationSettings.of("fr5_grasp")
    assert (arm.task, arm.fps, arm.episode_length, arm.storage) == ("FR5Grasp-v0", 50, 400, "video")
    assert (arm.soil, arm.fidelity) == (None, None)


@pytest.mark.parametrize(("env", "fps", "frames"), [("fr5_grasp", 25, 200), ("excavator", 5, 100)])
def test_an_episode_lasts_as_long_at_another_frame_rate(env, fps, frames):
    assert DemonstrationSettings.of(env, fps=fps).episode_length == frames
    assert DemonstrationSettings.of(env, fps=fps, episode_length=7).episode_length == 7


def test_stored_settings_without_later_choices_are_what_was_done_then():
    record = DemonstrationSettings(targets=1).as_record()
    del record["target_rule"], record["storage"]
    assert DemonstrationSettings.from_record(record, source=Path("s.json")) == DemonstrationSettings(
        targets=1
    )


@pytest.mark.parametrize("env", ENVIRONMENTS)
def test_settings_read_back(env):
    settings = DemonstrationSettings.of(env, seed=3, scenes=7)
    assert DemonstrationSettings.from_record(settings.as_record(), source=Path("s.json")) == settings


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"colour": 1}, r"s\.json has other settings \(colour\)"),
        ({"simulation_version": 99}, r"s\.json is of version 99 of the simulation"),
    ],
)
def test_stored_settings_of_another_version_are_refused(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        DemonstrationSettings.from_record(
            {**DemonstrationSettings().as_record(), **changes}, source=Path("s.json")
        )


def test_stored_settings_without_a_version_are_of_the_first():
    record = DemonstrationSettings().as_record()
    del record["simulation_version"]
    with pytest.raises(ConfigurationError, match="is of version 1 of the simulation, and this is version"):
        DemonstrationSettings.from_record(record, source=Path("s.json"))


@pytest.mark.parametrize(
    "changes",
    [
        {"env": "fr5"},
        {"task": "Dig-v9"},
        {"scene_set": "all"},
        {"soil": "mud"},
        {"fidelity": "exact"},
        {"fps": 12},
        {"height": 8},
        {"width": 5000},
        {"targets": 5},
        {"scenes": 0},
        {"first_scene": -1},
        {"seed": -1},
        {"episode_length": 0},
        {"storage": "gif"},
        {"target_rule": "best"},
    ],
)
def test_a_value_out_of_range_is_named(changes):
    (field,) = changes
    with pytest.raises(ConfigurationError, match=f"--{field.replace('_', '-')}="):
        DemonstrationSettings(**changes)
