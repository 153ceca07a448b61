import pytest

from lerobot_excav.envs.configs.metrics_log import MetricsLog
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.evaluation.episode import EpisodeKey
from lerobot_excav.evaluation.metrics import read_evaluation


def test_a_metrics_file_is_read_by_scene_and_target(metrics_file, metrics_line):
    evaluation = read_evaluation(
        metrics_file("m.jsonl", [metrics_line(3), metrics_line(4, retained_mass_kg=20)])
    )
    assert list(evaluation.episodes) == [EpisodeKey("test", 3, 3), EpisodeKey("test", 4, 0)]
    assert evaluation.episodes[EpisodeKey("test", 4, 0)].retained_mass_kg == 20.0
    assert evaluation.operator is None


def test_what_the_environment_logs_is_read(tmp_path, metrics_line):
    log = MetricsLog(tmp_path / "m.jsonl", n_envs=1)
    log.begin_batch([1000])
    metrics = {k: v for k, v in metrics_line(1000).items() if k not in ("episode_ix", "seed")}
    log.finish_episode(0, {"episode_metrics": metrics})
    assert list(read_evaluation(tmp_path / "m.jsonl").episodes) == [EpisodeKey("test", 1000, 0)]


def test_a_folder_stands_for_the_metrics_file_in_it(metrics_file, metrics_line, tmp_path):
    metrics_file("metrics.jsonl", [metrics_line(3)])
    assert read_evaluation(tmp_path).path == tmp_path / "metrics.jsonl"


def test_the_last_of_several_evaluations_in_a_file_counts(metrics_file, metrics_line):
    first = [metrics_line(i, retained_mass_kg=1.0) for i in range(3)]
    second = [metrics_line(i, retained_mass_kg=2.0) for i in range(2)]
    evaluation = read_evaluation(metrics_file("m.jsonl", first + second))
    assert evaluation.of == 2
    assert [episode.retained_mass_kg for episode in evaluation.episodes.values()] == [2.0, 2.0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"retained_mass_kg": None}, "retained_mass_kg=None is no float"),
        ({"target_success": 1}, "target_success=1 is no bool"),
        ({"scene_id": True}, "scene_id=True is no int"),
        ({"task": "Clear-v0"}, "task='Clear-v0'"),
        ({"scene_id": 1, "target_id": 1}, "test/1/1 occur twice"),
    ],
)
def test_a_line_that_cannot_be_used_is_named(metrics_file, metrics_line, changes, message):
    path = metrics_file("m.jsonl", [metrics_line(1), metrics_line(2, **changes)])
    with pytest.raises(DatasetError, match=rf"m\.jsonl:2.*{message}"):
        read_evaluation(path)


def test_a_missing_field_is_named(metrics_file, metrics_line):
    incomplete = metrics_line(1)
    del incomplete["spill_before_target_events"]
    with pytest.raises(DatasetError, match=r"m\.jsonl:1: lacks spill_before_target_events"):
        read_evaluation(metrics_file("m.jsonl", [incomplete]))


def test_a_file_of_the_first_version_is_read(metrics_file, metrics_line):
    first = metrics_line(3)
    del first["simulation_version"], first["fidelity"]
    (episode,) = read_evaluation(metrics_file("m.jsonl", [first])).episodes.values()
    assert (episode.simulation_version, episode.fidelity) == (1, "standard")


def test_a_file_from_before_there_was_noise_is_of_masks_without(metrics_file, metrics_line):
    lines = [metrics_line(3), metrics_line(4, mask_noise="shift", mask_noise_px=2)]
    episodes = [
        *read_evaluation(metrics_file("old.jsonl", lines[:1])).episodes.values(),
        *read_evaluation(metrics_file("new.jsonl", lines[1:])).episodes.values(),
    ]
    assert [episode.mask for episode in episodes] == ["correct", "correct, shift 2 px"]


@pytest.mark.parametrize(("text", "message"), [("", "empty"), ("{", "not JSON"), ("3", "a JSON object")])
def test_a_damaged_file_is_refused(tmp_path, text, message):
    (tmp_path / "m.jsonl").write_text(text)
    with pytest.raises(DatasetError, match=message):
        read_evaluation(tmp_path / "m.jsonl")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(DatasetError, match=r"--env\.metrics_path"):
        read_evaluation(tmp_path / "m.jsonl")


def test_seeds_of_a_run_must_show_the_same_scenes(make_run, metrics_line):
    with pytest.raises(ConfigurationError, match="other scenes or targets"):
        make_run("a", [metrics_line(1)], [metrics_line(2)])


@pytest.mark.parametrize(
    "changes",
    [
        {"mask_condition": "zero"},
        {"mask_noise": "erode"},
        {"mask_noise_px": 2},
        {"soil": "gravel"},
        {"fidelity": "fine"},
        {"simulation_version": 1},
    ],
)
def test_a_run_does_not_mix_conditions(make_run, metrics_line, changes):
    with pytest.raises(ConfigurationError, match="mixes mask conditions, kinds of mask noise"):
        make_run("a", [metrics_line(1), metrics_line(2, **changes)])
