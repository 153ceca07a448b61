import dataclasses

import pytest

from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings
from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.operator_run import evaluate_operator


@pytest.mark.slow
def test_the_operators_file_is_read_like_that_of_a_policy(tmp_path):
    settings = DemonstrationSettings(scene_set="test", first_scene=1000, scenes=2, targets=1)
    evaluate_operator(settings, tmp_path / "o" / "operator.jsonl", workers=0, show_progress=False)
    evaluation = read_evaluation(tmp_path / "o" / "operator.jsonl")
    assert evaluation.operator == "scripted"
    # lerobot-eval with seed 1000 shows scene 1000 + i with target (1000 + i) % 4.
    assert [str(key) for key in evaluation.episodes] == ["test/1000/0", "test/1001/1"]
    assert all(episode.retained_mass_kg > 0.0 for episode in evaluation.episodes.values())
    with pytest.raises(DatasetError, match="exists"):
        evaluate_operator(
            dataclasses.replace(settings, scenes=1), tmp_path / "o" / "operator.jsonl", workers=0
        )
