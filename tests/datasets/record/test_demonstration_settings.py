import re
from collections import Counter
from pathlib import Path

import pytest
import toy_reach  # noqa: F401 - registers the example task
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.envs.soil import PRESETS
from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.errors import ConfigurationError

SOURCE = Path("s.json")
make = DemonstrationSettings.of


def targets_of(env_type, env=None, **settings):
    return [pair.target_id for pair in make(env_type, env, targets=1, **settings).pairs()]


@given(first=st.integers(0, 50), scenes=st.integers(1, 40), targets=st.integers(1, 4))
def test_every_scene_is_shown_with_as_many_different_targets_as_asked_for(first, scenes, targets):
    pairs = make("excavator", first_scene=first, scenes=scenes, targets=targets).pairs()
    assert len(set(pairs)) == len(pairs) == scenes * targets
    assert set(Counter(pair.scene_id for pair in pairs).values()) == {targets}
    frequency = Counter(pair.target_id for pair in pairs)
    assert max(frequency.values()) - min(frequency[t] for t in range(4)) <= targets
    assert pairs == sorted(pairs)


def test_one_target_per_scene_goes_round_the_targets():
    assert targets_of("excavator", scenes=8) == [0, 1, 2, 3, 0, 1, 2, 3]


def test_every_scene_is_shown_at_every_stage_with_all_its_targets():
    pairs = make("excavator", scenes=3, targets=2, stages="8, 0,4").pairs()
    assert len(set(pairs)) == len(pairs) == 3 * 3 * 2
    assert [(pair.scene_id, pair.stage) for pair in pairs[::2]] == [(s, k) for s in range(3) for k in (0, 4, 8)]
    assert [pair for pair in pairs if pair.stage == 0] == make("excavator", scenes=3, targets=2).pairs()
    assert make("excavator", stages="8, 0,4").as_record()["stages"] == "0,4,8"


def test_with_one_target_the_stages_of_a_scene_go_round_the_targets_too():
    targets = targets_of("excavator", scenes=4, stages="0,4,8,12")
    assert targets == [0, 1, 2, 3, 1, 2, 3, 0, 2, 3, 0, 1, 3, 0, 1, 2]
    drawn = targets_of("excavator", scenes=200, stages="0,4", target_rule="uniform")
    assert drawn[::2] == targets_of("excavator", scenes=200, target_rule="uniform")
    assert 20 < sum(early == late for early, late in zip(drawn[::2], drawn[1::2], strict=True)) < 80


def test_the_operator_has_a_seed_of_its_own_at_every_stage():
    settings = make("excavator", scenes=2, stages="0,1,2", seed=7)
    seeds = [settings.episode_seed(pair) for pair in settings.pairs()]
    assert len(set(seeds)) == len(seeds)
    assert seeds[0] == (7, 0, 0)  # as without stages


def test_drawn_targets_are_equally_likely_and_belong_to_their_scene():
    targets = targets_of("excavator", scenes=400, target_rule="uniform")
    assert min(Counter(targets).values()) > 70  # 100 each, 3.5 standard deviations below
    assert targets_of("excavator", first_scene=7, scenes=3, target_rule="uniform") == targets[7:10]
    assert targets_of("excavator", scenes=400, target_rule="uniform", seed=1) != targets
    assert targets_of("excavator", {"scene_set": "val"}, scenes=400, target_rule="uniform") != targets


@pytest.mark.parametrize("env_type", ["excavator", "fr5_grasp", "toy_reach"])
def test_the_nearest_target_is_that_of_the_scene(env_type):
    spec = env_types()[env_type]
    nearest = [spec.nearest_target(spec.make_settings(), scene_id) for scene_id in range(5)]
    assert targets_of(env_type, scenes=5, target_rule="nearest") == nearest
    assert nearest != targets_of(env_type, scenes=5)


@pytest.mark.parametrize(
    ("env_type", "env", "settings", "message"),
    [
        (
            "excavator",
            {"task": "Clear-v0"},
            {"target_rule": "nearest"},
            "--target_rule=nearest has no meaning for --env.type=excavator with Clear-v0",
        ),
        ("excavator", {}, {"stages": "0,20"}, "--stages='0,20' is not possible; the last stage of Scoop-v0 is 19"),
        ("excavator", {}, {"stages": "1-20"}, "--stages='1-20' is not possible; the last stage of Scoop-v0 is 19"),
        ("excavator", {}, {"stages": "5-3"}, "--stages='5-3' is not possible; give whole numbers with commas"),
        ("excavator", {}, {"stages": "0-4,4"}, "--stages='0-4,4' names a stage twice"),
        ("excavator", {}, {"stages": "4,0,4"}, "--stages='4,0,4' names a stage twice"),
        ("excavator", {}, {"stages": "0,-1"}, "--stages='0,-1' is not possible; give whole numbers with commas"),
        ("excavator", {}, {"stages": ""}, "--stages='' is not possible"),
        ("toy_reach", {}, {"stages": "0,1"}, "scenes of Reach-v0 have no stages; leave --stages out"),
        ("excavator", {}, {"targets": 2, "target_rule": "uniform"}, "--target_rule=uniform chooses a single"),
        ("excavator", {"soil": PRESETS["sand"]}, {}, "cannot be kept in a dataset; give it by name"),
        ("fr5_grasp", {"soil": "sand"}, {}, "--env.soil is not a setting of fr5_grasp"),
        ("fr5_grasp", {"task": "Scoop-v0"}, {}, "task='Scoop-v0' is not known; allowed: 'FR5Grasp-v0'"),
        ("lathe", {}, {}, "--env.type='lathe' is not known; allowed: 'excavator', 'fr5_grasp'"),
        ("fr5_grasp", {}, {"colour": 3}, "option='--colour' is not known; allowed: '--first_scene'"),
        ("fr5_grasp", {}, {"first_scene": 2**31 - 3, "scenes": 5}, "--scenes=5 from --first_scene=2147483645"),
        ("toy_reach", {"episode_length": 2**31 - 1}, {}, "--env.episode_length=2147483647 is too long"),
    ],
)
def test_what_makes_no_sense_in_an_environment_is_refused(env_type, env, settings, message):
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        make(env_type, env, **settings)


@pytest.mark.parametrize(
    ("env_type", "fps", "frames", "storage"),
    [("fr5_grasp", 50, 400, "video"), ("fr5_grasp", 25, 200, "video"), ("excavator", 5, 100, "image")],
)
def test_length_and_storage_suit_the_environment_and_its_frame_rate(env_type, fps, frames, storage):
    settings = make(env_type, {"fps": fps})
    assert (settings.episode_length, settings.storage) == (frames, storage)
    assert make(env_type, {"fps": fps, "episode_length": 7}).episode_length == 7


@pytest.mark.parametrize("env_type", ["excavator", "fr5_grasp", "toy_reach"])
def test_settings_read_back(env_type):
    settings = make(env_type, {"mask_condition": "random", "fps": 5}, seed=3, scenes=7)
    assert DemonstrationSettings.from_record(settings.as_record(), source=SOURCE) == settings


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"colour": 1}, r"s\.json has other settings \(colour\)"),
        ({"seed": ...}, r"s\.json has other settings \(seed\)"),
        ({"env.colour": 1}, r"--env\.colour is not a setting of excavator"),
        ({"env.type": "lathe"}, r"env\.type in s\.json='lathe' is not known"),
        ({"simulation_version": 99}, r"s\.json is of version 99 of the simulation, and this is version"),
        ({"simulation_version": ...}, r"s\.json is of version None of the simulation"),
    ],
)
def test_stored_settings_that_do_not_fit_are_refused(changes, message):
    record = {**make("excavator").as_record(), **changes}
    record = {name: value for name, value in record.items() if value is not ...}
    with pytest.raises(ConfigurationError, match=message):
        DemonstrationSettings.from_record(record, source=SOURCE)


def test_a_stage_is_drawn_for_every_scene_from_the_range_that_is_listed():
    settings = make("excavator", scenes=400, stages="1-8, 0")
    assert settings.stages == "0,1-8"
    later = [settings.stages_of(scene_id)[1] for scene_id in range(400)]
    assert {settings.stages_of(scene_id)[0] for scene_id in range(400)} == {0}
    assert set(later) == set(range(1, 9))
    assert min(Counter(later).values()) > 25  # 50 each, 3.8 standard deviations below
    assert [pair.stage for pair in settings.pairs()[4:8]] == [later[0]] * 4
    assert settings.episode_count == len(settings.pairs()) == 3200


def test_drawn_stages_depend_on_scene_set_and_seed_and_not_on_the_other_scenes():
    def later(first_scene=0, **settings):
        made = make("excavator", settings.pop("env", {}), scenes=50, stages="1-19", **settings)
        return [made.stages_of(scene_id) for scene_id in range(first_scene, 50)]

    assert later(first_scene=7) == later()[7:]
    assert later(seed=1) != later()
    assert later(env={"scene_set": "val"}) != later()
