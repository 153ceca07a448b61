"""Changes of mind in demonstrations: another target is commanded on the way to the first."""

from contextlib import closing
from itertools import pairwise

import numpy as np
import pytest
from toy_reach.operator import ReachOperator

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.datasets.record.change_odds import ChangeOdds
from lerobot_excav.datasets.record.changes_of_mind import ChangesOfMind
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.datasets.record.episode import demonstrate
from lerobot_excav.datasets.record.simulation import make_environment, play_demonstration
from lerobot_excav.envs.masks.source import MaskMissingError
from lerobot_excav.errors import ConfigurationError

SMALL = {"observation_height": 40, "observation_width": 56}  # of their own: workers keep the last environment open
TASKS = {"toy_reach": SMALL, "fr5_grasp": SMALL, "excavator": {"fidelity": "fast", **SMALL}}


def settings_of(env_type, env=None, **changes):
    return DemonstrationSettings.of(env_type, env or TASKS[env_type], **{"scenes": 2, "retarget": 1.0, **changes})


def commands(episode):
    return sorted({(int(f), int(t)) for f, t in zip(episode.command_frame, episode.target_id, strict=True)})


def frames_of_the_way(settings, pair):
    """How long the operator is on its way to the first target, as a number of frames with a fraction."""
    with closing(make_environment(settings.env, with_images=False)) as env:
        operator = settings.task_spec.make_operator(np.random.default_rng(settings.episode_seed(pair)))
        env.reset(options=dict(pair.reset_options))
        operator.reset(env)
        return operator.approach_s * env.fps


@pytest.mark.parametrize("env_type", [pytest.param(name, marks=pytest.mark.slow) for name in TASKS])
def test_the_operator_obeys_the_second_command_and_succeeds(env_type):
    settings = settings_of(env_type)
    first_frames = set()
    for pair in settings.pairs()[::3]:
        episode = play_demonstration(settings, pair, with_images=False)
        (start, first), (changed, second) = commands(episode)
        assert (start, first) == (0, pair.target_id)
        assert second != first
        assert episode.success, pair
        assert episode.metrics["commands"] == [[0, first], [changed, second]]
        first_frames.add(changed)
    assert len(first_frames) > 1  # drawn for every episode


@pytest.mark.slow
@pytest.mark.parametrize(
    ("env_type", "name", "below"), [("fr5_grasp", "fingers_on_target", 2.0), ("excavator", "excavated_mass_kg", 1.0)]
)
@pytest.mark.parametrize("times", [1, 3])
def test_nothing_is_held_or_dug_when_the_command_changes(env_type, name, below, times):
    settings = settings_of(env_type, retarget_times=times)
    column = settings.task_spec.task_state_names.index(name)
    for pair in settings.pairs()[1:4]:
        episode = play_demonstration(settings, pair, with_images=False)
        changed = int(episode.command_frame[-1])
        assert episode.task_state[: changed + 1, column].max() < below


def test_the_share_says_how_many_episodes_have_one_and_none_leaves_the_others_as_they_were():
    drawn = [ChangesOfMind.drawn(ChangeOdds(0.3), (7, scene, 0)) is not None for scene in range(1000)]
    assert 0.25 < np.mean(drawn) < 0.35
    assert ChangesOfMind.drawn(ChangeOdds(0.0), (7, 0, 0)) is None
    without, with_some = (settings_of("toy_reach", retarget=share) for share in (0.0, 0.5))
    same = [
        np.array_equal(*(play_demonstration(s, pair, with_images=False).action for s in (without, with_some)))
        for pair in without.pairs()
    ]
    assert 0 < sum(same) < len(same)


@pytest.mark.parametrize("env_type", [pytest.param(name, marks=pytest.mark.slow) for name in TASKS])
def test_several_changes_are_obeyed_each_from_the_way_to_the_target_before(env_type):
    in_time = {} if env_type == "toy_reach" else {"episode_length": 600}  # three ways take longer than one
    settings = settings_of(env_type, {**TASKS[env_type], **in_time}, retarget_times=3)
    counts = set()
    for pair in settings.pairs()[1::2]:
        episode = play_demonstration(settings, pair, with_images=False)
        given = commands(episode)
        frames, targets = zip(*given, strict=True)
        counts.add(len(given) - 1)
        assert all(one != other for one, other in pairwise(targets)), pair
        assert frames[-1] < episode.length - 1, pair
        assert episode.success, pair
    assert counts == {1, 2, 3}


def test_the_moment_of_a_single_change_is_drawn_as_before_there_could_be_several():
    """Demonstrations with a single change stay as they were: `times` draws only if it has a choice."""
    settings = settings_of("toy_reach")
    for pair in settings.pairs()[:3]:
        rng = np.random.default_rng(np.random.SeedSequence(settings.episode_seed(pair), spawn_key=(0x7E3B,)))
        rng.random()
        expected = int(rng.integers(1, max(2, round(frames_of_the_way(settings, pair)))))
        assert commands(play_demonstration(settings, pair, with_images=False))[1][0] == expected


def test_as_many_changes_as_asked_for_need_a_share_of_episodes_that_have_them():
    with pytest.raises(ConfigurationError, match=r"--retarget_times=3 has no effect with --retarget=0; add"):
        settings_of("toy_reach", retarget=0.0, retarget_times=3)


@pytest.mark.parametrize("env_type", [pytest.param(name, marks=pytest.mark.slow) for name in TASKS])
def test_late_changes_come_in_the_last_half_second_and_are_obeyed(env_type):
    settings = settings_of(env_type, retarget_late=1.0)
    for pair in settings.pairs()[::3]:
        touch = frames_of_the_way(settings, pair)
        episode = play_demonstration(settings, pair, with_images=False)
        changed = commands(episode)[1][0]
        assert touch - 0.5 * settings.env.fps - 1 <= changed < touch
        assert episode.success, pair


def test_the_share_of_late_changes_says_how_many_there_are():
    settings = settings_of("toy_reach", scenes=30, retarget_late=0.5)
    always = settings_of("toy_reach", scenes=30, retarget_late=1.0)
    never = settings_of("toy_reach", scenes=30)
    first = [
        np.mean([commands(play_demonstration(s, pair, with_images=False))[1][0] for pair in s.pairs()])
        for s in (never, settings, always)
    ]
    assert first[0] < first[1] < first[2]


def test_late_changes_need_a_share_of_episodes_that_have_them():
    with pytest.raises(ConfigurationError, match=r"--retarget_late=0\.5 has no effect with --retarget=0; add"):
        settings_of("toy_reach", retarget=0.0, retarget_late=0.5)


def test_a_dataset_counts_the_commands_and_passes_its_check_by_replaying_them(tmp_path):
    out = tmp_path / "dataset"
    settings = settings_of("toy_reach", retarget=0.5)
    record_demonstrations(settings, out, workers=0, show_progress=False)
    index = build_index(out)
    assert set(index["commands"]) == {1, 2}
    changed = index[index["commands"] == 2]
    assert (changed["final_target_id"] != changed["target_id"]).all()
    report = check_dataset(out, replays=len(index))
    assert report.problems == []
    assert report.episodes["replayed"].all()
    assert set(report.episodes["qc_problem"]) == {""}


def test_a_target_that_the_mask_source_does_not_find_leaves_the_command_as_it_was(monkeypatch):
    settings = settings_of("toy_reach")
    pair = settings.pairs()[0]
    with closing(make_environment(settings.env, with_images=False)) as env:

        def refuse(target_id):
            raise MaskMissingError(f"target {target_id} is not found")

        monkeypatch.setattr(env, "recommand", refuse)
        operator = settings.task_spec.make_operator(np.random.default_rng(0))
        episode = demonstrate(env, operator, pair, ChangesOfMind.drawn(ChangeOdds(1.0), (0,)))
    assert commands(episode) == [(0, pair.target_id)]
    assert episode.success


@pytest.mark.parametrize(
    ("env_type", "env"), [("excavator", {"task": "Clear-v0"}), ("fr5_grasp", {"retarget_frame": 25})]
)
def test_where_the_task_itself_changes_the_command_it_is_refused(env_type, env):
    with pytest.raises(ConfigurationError, match=r"--retarget=0\.5 has no meaning for .*; leave it out"):
        DemonstrationSettings.of(env_type, env, retarget=0.5)


def test_an_operator_that_does_not_tell_its_way_is_named_before_anything_is_recorded(monkeypatch, tmp_path):
    monkeypatch.delattr(ReachOperator, "approach_s")
    with pytest.raises(ConfigurationError, match=r"ReachOperator has no approach_s; add the property"):
        record_demonstrations(settings_of("toy_reach"), tmp_path / "d", workers=0, show_progress=False)
    assert not list(tmp_path.iterdir())


def test_a_run_that_was_started_before_there_were_changes_of_mind_goes_on(tmp_path):
    settings = settings_of("toy_reach", retarget=0.0)
    record = settings.as_record()
    assert [record.pop(name) for name in ("retarget", "retarget_times", "retarget_late")] == [0.0, 1, 0.0]
    assert DemonstrationSettings.from_record(record, source=tmp_path) == settings
