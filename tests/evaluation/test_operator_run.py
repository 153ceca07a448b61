import json
from types import SimpleNamespace

import pytest

from lerobot_excav.datasets.record.demonstration_settings import PlayedScenes
from lerobot_excav.envs.tasks.registry import task_spec
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.evaluation import operator_run
from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.operator_run import evaluate_operator
from lerobot_excav.evaluation.provenance import EvaluationOrigin

SCOOP = task_spec("task", "Scoop-v0")


def played(*, env=None, **changes):
    settings = SCOOP.make_settings(scene_set="test", **(env or {}))
    return PlayedScenes(env=settings, **{"first_scene": 1000, "scenes": 3, "targets": 1, **changes})


def evaluate(path, *, settings=None, **options):
    evaluate_operator(settings or played(), path, **{"workers": 0, "show_progress": False, **options})


@pytest.fixture
def still(monkeypatch, scoop_line):
    """Let an operator play that moves a kilogram in no time."""

    def play(settings, pair, *, with_images):
        assert not with_images
        chosen = {name: value for name, value in settings.env.as_dict().items() if value is not None}
        metrics = scoop_line(pair.scene_id, retained_mass_kg=1.0, **chosen, episode_length=200)
        del metrics["episode_ix"], metrics["seed"]
        return SimpleNamespace(success=True, metrics=metrics)

    monkeypatch.setattr(operator_run, "play_demonstration", play)


@pytest.mark.usefixtures("still")
def test_the_operators_file_is_read_like_that_of_a_policy(tmp_path, capsys):
    evaluate(tmp_path / "new" / "operator.jsonl", show_progress=True)
    evaluation = read_evaluation(tmp_path / "new" / "operator.jsonl")
    assert evaluation.operator == "scripted"
    # lerobot-eval with seed 1000 shows scene 1000 + i with target (1000 + i) % 4.
    assert [str(key) for key in evaluation.episodes] == ["test/1000/0/0", "test/1001/0/1", "test/1002/0/2"]
    assert EvaluationOrigin.read(evaluation.path).packages["lerobot"]
    assert "3/3" in capsys.readouterr().err


def test_an_episode_that_never_loads_is_written_too(tmp_path):
    evaluate(tmp_path / "o.jsonl", settings=played(scenes=1, env={"episode_length": 1}))
    line = json.loads((tmp_path / "o.jsonl").read_text())
    assert (line["loading_onset_time_s"], line["is_success"]) == (None, False)


def test_an_existing_file_is_not_overwritten(tmp_path):
    (tmp_path / "o.jsonl").write_text("mine")
    with pytest.raises(DatasetError, match="exists"):
        evaluate(tmp_path / "o.jsonl")
    assert (tmp_path / "o.jsonl").read_text() == "mine"


@pytest.mark.usefixtures("still")
def test_an_interrupted_run_continues_to_the_same_file(tmp_path):
    evaluate(tmp_path / "whole.jsonl")
    whole = (tmp_path / "whole.jsonl").read_text()
    # The second line is torn in the middle.
    (tmp_path / "o.jsonl.partial").write_text(whole[: whole.index("\n") + 20])
    with pytest.raises(DatasetError, match="--resume=true"):
        evaluate(tmp_path / "o.jsonl")
    evaluate(tmp_path / "o.jsonl", resume=True)
    assert (tmp_path / "o.jsonl").read_text() == whole
    assert not (tmp_path / "o.jsonl.partial").exists()


@pytest.mark.usefixtures("still")
@pytest.mark.parametrize("text", ["years of work", "years\nof work\n", '{"episode_ix": 0}\n', "3\n", "[]\n", "\n"])
def test_a_file_that_no_run_has_made_is_kept(tmp_path, text):
    mine = tmp_path / "o.jsonl.partial"
    mine.write_text(text)
    with pytest.raises(DatasetError, match=r"o\.jsonl\.partial holds something else .* choose another --metrics"):
        evaluate(tmp_path / "o.jsonl", resume=True)
    assert mine.read_text() == text


@pytest.mark.usefixtures("still")
def test_episodes_beyond_those_asked_for_are_kept(tmp_path):
    evaluate(tmp_path / "o.jsonl.partial")
    before = (tmp_path / "o.jsonl.partial").read_text()
    with pytest.raises(ConfigurationError, match="holds 3 episodes, and 2 are asked for"):
        evaluate(tmp_path / "o.jsonl", settings=played(scenes=2), resume=True)
    assert (tmp_path / "o.jsonl.partial").read_text() == before


@pytest.mark.usefixtures("still")
@pytest.mark.parametrize("resume", [False, True])
def test_a_second_process_is_kept_away(tmp_path, monkeypatch, resume):
    def second(*_, **__):
        with pytest.raises(DatasetError, match=r"another process is at work on \S*o\.jsonl\.partial"):
            evaluate(tmp_path / "o.jsonl", resume=resume)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(operator_run, "play_demonstration", second)
        with pytest.raises(KeyboardInterrupt):
            evaluate(tmp_path / "o.jsonl")
    evaluate(tmp_path / "o.jsonl", resume=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["o.json", "o.jsonl"]


@pytest.mark.usefixtures("still")
def test_a_file_that_appeared_meanwhile_is_kept(tmp_path, monkeypatch):
    play = operator_run.play_demonstration

    def write_too(*arguments, **options):
        (tmp_path / "o.jsonl").write_text("mine")
        return play(*arguments, **options)

    monkeypatch.setattr(operator_run, "play_demonstration", write_too)
    with pytest.raises(DatasetError, match="exists"):
        evaluate(tmp_path / "o.jsonl")
    assert (tmp_path / "o.jsonl").read_text() == "mine"
    assert len((tmp_path / "o.jsonl.partial").read_text().splitlines()) == 3


@pytest.mark.usefixtures("still")
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 3}, "operator_seed=0, not 3"),
        ({"first_scene": 7}, "scene_id=1000, not 7"),
        ({"env": {"fps": 5}}, "fps=10, not 5"),
        ({"env": {"soil": "gravel"}}, "soil='sand', not 'gravel'"),
    ],
)
def test_continuing_with_another_setting_names_it(tmp_path, changes, message):
    evaluate(tmp_path / "o.jsonl.partial")
    with pytest.raises(ConfigurationError, match=message):
        evaluate(tmp_path / "o.jsonl", settings=played(**changes), resume=True)


@pytest.mark.usefixtures("still")
def test_a_run_of_another_version_of_the_simulation_is_not_continued(tmp_path):
    evaluate(tmp_path / "o.jsonl.partial")
    partial = tmp_path / "o.jsonl.partial"
    partial.write_text(partial.read_text().replace('"simulation_version": 5', '"simulation_version": 1'))
    with pytest.raises(ConfigurationError, match="simulation_version=1, not 5"):
        evaluate(tmp_path / "o.jsonl", resume=True)
