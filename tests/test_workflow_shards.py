"""Parts of rows and of data are put together to what one piece would be."""

import json
import runpy
import shutil
from pathlib import Path

import pytest

from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.provenance import EvaluationOrigin

from .evaluation.conftest import SCOOP as SCOOP_LINE
from .evaluation.conftest import line as metrics_line

ROOT = Path(__file__).parents[1]
PARTS = ("0-2", "2-3")
EPISODES = [metrics_line(SCOOP_LINE, number) for number in range(5)]


def write_parts(folder, **of_b):
    """Write the metrics of two parts, of scenes 0 and 1, and 2 to 4; `of_b` differs in the second's origin."""
    for name, part in ((PARTS[0], EPISODES[:2]), (PARTS[1], EPISODES[2:])):
        parts = [{**episode, "evaluation": name, "episode_ix": number} for number, episode in enumerate(part)]
        (folder / f"{name}.jsonl").write_text("".join(json.dumps(episode) + "\n" for episode in parts))
        origin = {"command": f"play {name}", "commit": "c", "modified": name == PARTS[1], "seconds": 2.0}
        origin |= {"policy": "p", "packages": {"mujoco": "3"}, **(of_b if name == PARTS[1] else {})}
        (folder / f"{name}.json").write_text(json.dumps(origin))
    return [folder / f"{name}.jsonl" for name in PARTS]


def test_parts_of_different_commits_say_so(tmp_path):
    shards = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))
    shards["merge_metrics"](write_parts(tmp_path, commit="d"), tmp_path / "whole.jsonl")
    merged = json.loads((tmp_path / "whole.json").read_text())
    assert merged["command"] == "play 0-2 && play 2-3  # parts by commits c, d"


@pytest.mark.parametrize("differs", [{"policy": "q"}, {"packages": {"mujoco": "4"}}])
def test_parts_of_another_policy_or_of_other_packages_are_not_put_together(tmp_path, differs):
    shards = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))
    with pytest.raises(Exception, match=f"{next(iter(differs))} of .*2-3.jsonl differs"):
        shards["merge_metrics"](write_parts(tmp_path, **differs), tmp_path / "whole.jsonl")
    assert {path.stem for path in tmp_path.iterdir()} == set(PARTS)


def test_a_part_that_two_runs_have_played_at_once_is_not_put_into_a_row(tmp_path):
    shards = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))
    parts = write_parts(tmp_path)
    twice = [json.loads(text) for text in parts[1].read_text().splitlines() for _ in range(2)]
    lines = [{**episode, "evaluation": "bc"[number % 2]} for number, episode in enumerate(twice)]
    parts[1].write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(Exception, match=r"2-3\.jsonl holds several evaluations"):
        shards["merge_metrics"](parts, tmp_path / "whole.jsonl")
    assert not (tmp_path / "whole.jsonl").exists()


def test_a_part_that_lacks_an_episode_is_not_put_into_a_row(tmp_path):
    shards = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))
    parts = write_parts(tmp_path)
    parts[1].write_text("".join(parts[1].read_text().splitlines(keepends=True)[:-1]))
    with pytest.raises(Exception, match=r"2-3\.jsonl holds 2 episodes, not as many as its name says"):
        shards["merge_metrics"](parts, tmp_path / "whole.jsonl")


def test_a_row_that_lands_says_how_its_policy_was_trained(tmp_path, monkeypatch):
    """Its training does not land, and paths of this machine mean nothing elsewhere."""
    shards = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))
    policy = tmp_path / "train" / "box" / "checkpoints" / "000005" / "pretrained_model"
    policy.mkdir(parents=True)
    settings = {"dataset": {"repo_id": "local/paired", "episodes": [0, 1]}, "batch_size": 16, "seed": 7}
    (policy / "train_config.json").write_text(json.dumps(settings))
    monkeypatch.chdir(tmp_path)
    parts = write_parts(tmp_path)
    for part in parts:
        origin = json.loads(part.with_suffix(".json").read_text())
        part.with_suffix(".json").write_text(json.dumps({**origin, "policy": str(policy)}))
    shards["merge_metrics"](parts, tmp_path / "whole.jsonl", keep_training=True)
    shutil.rmtree(policy)
    origin = EvaluationOrigin.read(tmp_path / "whole.jsonl")
    assert origin.policy == "train/box/checkpoints/000005/pretrained_model"
    assert (origin.training.name, origin.training.demonstrations, origin.training.seed) == ("box", 2, 7)


def test_a_row_without_parts_asks_for_another_start(tmp_path):
    shards = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))
    with pytest.raises(Exception, match="was being written when a run was stopped"):
        shards["merge_metrics"]([], tmp_path / "whole.jsonl")


@pytest.mark.parametrize(("given", "name"), [(3000, "003000"), ("last", "last"), ("003000", "003000")])
def test_a_checkpoint_is_called_as_lerobot_writes_it(given, name):
    assert runpy.run_path(str(ROOT / "workflows" / "shards.smk"))["step_name"](given) == name


def test_metrics_of_shards_are_put_together_in_their_order_and_read_as_one_evaluation(tmp_path):
    shards = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))
    episodes = EPISODES
    shards["merge_metrics"](write_parts(tmp_path), tmp_path / "whole.jsonl")
    whole = read_evaluation(tmp_path / "whole.jsonl")
    assert whole.of == 1
    assert [episode.scene_id for episode in whole.episodes.values()] == list(range(5))
    texts = (tmp_path / "whole.jsonl").read_text().splitlines()
    same = [{**json.loads(text), "evaluation": 0, "episode_ix": 0} for text in texts]
    assert same == [{**episode, "evaluation": 0, "episode_ix": 0} for episode in episodes]
    merged = json.loads((tmp_path / "whole.json").read_text())
    known = {"commit": "c", "policy": "p", "packages": {"mujoco": "3"}}
    assert merged == {"command": "play 0-2 && play 2-3", "modified": True, "seconds": 4.0, **known}
    shards["remove_parts"]([tmp_path / f"{name}.jsonl" for name in PARTS])
    assert {path.name for path in tmp_path.iterdir()} == {"whole.jsonl", "whole.json"}


@pytest.mark.parametrize(("count", "shards"), [(30, 7), (1, 1), (3, 5), (120, 30)])
def test_ranges_cover_all_scenes_once_and_are_nearly_equal(count, shards):
    ranges = runpy.run_path(str(ROOT / "workflows" / "shards.smk"))["ranges"](count, shards)
    assert [scene for first, number in ranges for scene in range(first, first + number)] == list(range(count))
    assert max(number for _, number in ranges) - min(number for _, number in ranges) <= 1
