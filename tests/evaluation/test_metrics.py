import pytest

from lerobot_excav.envs.configs.metrics_log import MetricsLog
from lerobot_excav.envs.tasks.measures import EpisodeKey
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.evaluation.metrics import read_evaluation


def test_a_metrics_file_is_read_by_scene_and_target(metrics_file, scoop_line):
    evaluation = read_evaluation(metrics_file("m.jsonl", [scoop_line(3), scoop_line(4, retained_mass_kg=20)]))
    assert list(evaluation.episodes) == [EpisodeKey("test", 3, 0, 3), EpisodeKey("test", 4, 0, 0)]
    assert evaluation.episodes[EpisodeKey("test", 4, 0, 0)].retained_mass_kg == 20.0
    assert (evaluation.task, evaluation.operator, evaluation.seed) == ("Scoop-v0", None, 3)


def test_what_the_environment_logs_is_read_also_by_its_folder(tmp_path, scoop_line):
    log = MetricsLog(tmp_path / "metrics.jsonl", n_envs=1)
    log.begin_batch([1000])
    metrics = {k: v for k, v in scoop_line(1000).items() if k not in ("episode_ix", "seed")}
    log.finish_episode(0, {"episode_metrics": metrics})
    evaluation = read_evaluation(tmp_path)
    assert evaluation.path == tmp_path / "metrics.jsonl"
    assert list(evaluation.episodes) == [EpisodeKey("test", 1000, 0, 0)]


def test_stages_of_a_scene_are_told_apart_and_a_file_without_them_is_of_stage_0(metrics_file, scoop_line):
    lines = [scoop_line(3), {**scoop_line(3, stage=4), "episode_ix": 4}]
    assert [key.stage for key in read_evaluation(metrics_file("m.jsonl", lines)).episodes] == [0, 4]
    earlier = {key: value for key, value in scoop_line(3).items() if key != "stage"}
    assert list(read_evaluation(metrics_file("e.jsonl", [earlier])).episodes) == [EpisodeKey("test", 3, 0, 3)]


def test_the_last_of_several_evaluations_in_a_file_counts(metrics_file, scoop_line):
    first = [scoop_line(i, retained_mass_kg=1.0) for i in range(3)]
    second = [scoop_line(i, retained_mass_kg=2.0) for i in range(2)]
    evaluation = read_evaluation(metrics_file("m.jsonl", first + second))
    assert evaluation.of == 2
    assert [episode.retained_mass_kg for episode in evaluation.episodes.values()] == [2.0, 2.0]


def log_of(path, scoop_line, n_envs=1):
    """A metrics log, and a function that ends its next batch in scenes from a number on."""
    log = MetricsLog(path, n_envs=n_envs)

    def play(first):
        log.begin_batch(range(first, first + n_envs))
        for i in range(n_envs):
            metrics = {k: v for k, v in scoop_line(first + i).items() if k not in ("episode_ix", "seed")}
            log.finish_episode(i, {"episode_metrics": metrics})

    return play


def scenes(path):
    return [key.scene_id for key in read_evaluation(path).episodes]


@pytest.mark.parametrize(
    "order",
    ["abab", "abba", "aba", "abaaa", "baaaab", "aabbba"],
)
def test_evaluations_that_wrote_at_the_same_time_are_not_mixed(tmp_path, scoop_line, order, caplog):
    path = tmp_path / "metrics.jsonl"
    logs = {name: log_of(path, scoop_line) for name in "ab"}
    for number, name in enumerate(order):
        logs[name](1000 + number)
    assert "is being written by another evaluation as well" in caplog.text
    with pytest.raises(
        DatasetError, match=r"wrote into \S* at the same time.* grep '\"evaluation\": \"\w+\"'"
    ) as error:
        read_evaluation(path)
    # The command in the message leaves one of them.
    key = str(error.value).split("grep '")[1].split("'")[0]
    (tmp_path / "one.jsonl").write_text("".join(x for x in path.read_text().splitlines(keepends=True) if key in x))
    name = order[-1] if key in path.read_text().splitlines()[-1] else "ab".replace(order[-1], "")
    assert scenes(tmp_path / "one.jsonl") == [1000 + i for i, each in enumerate(order) if each == name]


def test_evaluations_one_after_the_other_stay_apart_also_where_the_first_batch_is_missing(tmp_path, scoop_line, caplog):
    path = tmp_path / "metrics.jsonl"
    for first in (1000, 2000):
        play = log_of(path, scoop_line, n_envs=2)
        play(first)
        play(first + 2)
    assert scenes(path) == [2000, 2001, 2002, 2003]
    assert read_evaluation(path).of == 2
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:4] + lines[6:]))
    assert scenes(path) == [2002, 2003]
    assert not caplog.text


@pytest.mark.parametrize("order", [(0, 0, 1, 1, 2, 2), (0, 1, 2, 2, 3), (0, 1, 3, 2)])
def test_mixed_lines_of_earlier_versions_are_refused(metrics_file, scoop_line, order):
    lines = [scoop_line(number, episode_ix=ix) for number, ix in enumerate(order)]
    with pytest.raises(DatasetError, match="at the same time; give each a metrics_path of its own"):
        read_evaluation(metrics_file("m.jsonl", lines))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"retained_mass_kg": None}, "retained_mass_kg=None: input should be a valid number"),
        ({"retained_mass_kg": float("nan")}, "retained_mass_kg=nan: input should be a finite number"),
        ({"target_success": 1}, "target_success=1: input should be a valid boolean"),
        ({"scene_id": True}, "scene_id=True: input should be a valid integer"),
        ({"scene_id": 2.5}, r"scene_id=2\.5: input should be a valid integer"),
        ({"task": "FR5Grasp-v0"}, "task='FR5Grasp-v0', but the lines before are of 'Scoop-v0'"),
        ({"scene_id": 1, "target_id": 1, "commands": [[0, 1]]}, "test/1/0/1 occur twice"),
        ({"commands": []}, r"commands=\[\] must be pairs of frame and target"),
        ({"commands": [[0, 3]]}, r"begin with \[0, target_id=2\]"),
        ({"commands": [[0, 2], [9, 1], [9, 3]]}, "in the order of their frames"),
        ({"commands": [[0, 2], [9]]}, r"lacks commands\[1\]\[1\]"),
    ],
)
def test_a_line_that_cannot_be_used_is_named(metrics_file, scoop_line, changes, message):
    path = metrics_file("m.jsonl", [scoop_line(1), scoop_line(2, **changes)])
    with pytest.raises(DatasetError, match=rf"m\.jsonl:2: .*{message}"):
        read_evaluation(path)


def test_an_unknown_task_is_refused_with_those_that_are_known(metrics_file, scoop_line):
    with pytest.raises(DatasetError, match=r"m\.jsonl:1: task='Dance-v0' .* 'Scoop-v0', 'Clear-v0', 'FR5Grasp-v0'"):
        read_evaluation(metrics_file("m.jsonl", [scoop_line(1, task="Dance-v0")]))


@pytest.mark.parametrize("name", ["spill_before_target_events", "commands", "task"])
def test_a_missing_field_is_named(metrics_file, scoop_line, name):
    incomplete = {field: value for field, value in scoop_line(1).items() if field != name}
    with pytest.raises(DatasetError, match=rf"m\.jsonl:1: lacks {name}"):
        read_evaluation(metrics_file("m.jsonl", [incomplete]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("\udcff\udcfe", "not a metrics file"),
        (None, r"--env\.metrics_path"),
        ("", "empty"),
        ("{", "not JSON"),
        ("3", "the whole=3: input should be an obj"),
    ],
)
def test_a_missing_or_damaged_file_is_refused(tmp_path, text, message):
    if text is not None:
        (tmp_path / "m.jsonl").write_text(text, errors="surrogateescape")
    with pytest.raises(DatasetError, match=message):
        read_evaluation(tmp_path / "m.jsonl")


def test_seeds_of_a_run_must_show_the_same_scenes(make_run, scoop_line):
    with pytest.raises(ConfigurationError, match="other scenes or targets"):
        make_run("a", [scoop_line(1)], [scoop_line(2)])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mask_source": "detector"}, "mask sources: detector and oracle"),
        ({"mask_condition": "zero"}, "mask conditions: correct and zero"),
        ({"mask_noise": "erode"}, "kinds of mask noise: erode and none"),
        ({"mask_noise_px": 2}, "strengths of mask noise: 0 and 2"),
        ({"mask_snap": True}, "snapped masks and others"),
        ({"mask_dropout": 0.5}, "shares of frames at which masks drop out: 0.0 and 0.5"),
        ({"target_overlay": True}, "pictures with and without overlay"),
        ({"camera_every": 5}, "camera rates: 1 and 5"),
        ({"fps": 25}, "frame rates: 10 and 25"),
        ({"episode_length": 100}, "time limits: 100 and 200"),
        ({"soil": "gravel"}, "soils: gravel and sand"),
        ({"fidelity": "fine"}, "fidelities: fine and standard"),
        ({"pile": "ridge"}, "shapes of piles: heaps and ridge"),
        ({"density": "light"}, "densities: light and usual"),
        ({"simulation_version": 1}, "versions of the simulation: 1 and 5"),
    ],
)
def test_a_run_does_not_mix_conditions(make_run, scoop_line, changes, message):
    with pytest.raises(ConfigurationError, match=f"a mixes {message}"):
        make_run("a", [scoop_line(1), scoop_line(2, **changes)])
