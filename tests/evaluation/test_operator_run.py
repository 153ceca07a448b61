import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.environments import ENVIRONMENTS
from lerobot_excav.datasets.record.excavator_environment import EXCAVATOR
from lerobot_excav.datasets.record.rig import ExcavatorRig
from lerobot_excav.envs.tasks.scoop.simulation_version import SIMULATION_VERSION
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.operator_run import evaluate_operator
from lerobot_excav.evaluation.provenance import EvaluationOrigin

SETTINGS = DemonstrationSettings(scene_set="test", first_scene=1000, scenes=3, targets=1)


class StillEnv:
    """Ends after one frame, with the metrics of a scoop that moved `scene_id` kilograms."""

    task_description = "Stand still."

    def reset(self, *, seed=None, options=None):
        self.options = options
        return self._observation(), {"is_success": False, "task_state": np.zeros(8)}

    def step(self, action):
        metrics = {
            "simulation_version": SIMULATION_VERSION,
            "task": "Scoop-v0",
            "fps": 10,
            "episode_length": 200,
            "scene_set": "test",
            **self.options,
            "commands": [[0, self.options["target_id"]]],
            "mask_source": "oracle",
            "mask_condition": "correct",
            "mask_noise": "none",
            "mask_noise_px": 0,
            "target_overlay": False,
            "mask_missing_frames": 0,
            "frames": 1,
            "soil": "sand",
            "fidelity": "standard",
            "target_success": True,
            "is_success": True,
            "retained_mass_kg": float(self.options["scene_id"]),
            "residual_bucket_mass_kg": 0.0,
            "hard_target_contacts": 0,
            "spill_before_target_events": 0,
        }
        info = {"is_success": True, "task_state": np.zeros(8), "episode_metrics": metrics}
        return self._observation(), 0.0, True, False, info

    def close(self):
        pass

    def _observation(self):
        return {"agent_pos": np.zeros(8)}


class StillOperator:
    def reset(self, env):
        pass

    def act(self, env):
        return np.zeros(4, dtype=np.float32)


@dataclass(frozen=True)
class StillRig:
    def environment(self, settings):
        return StillEnv()

    def operator(self, rng):
        return StillOperator()


def evaluate(path, *, settings=SETTINGS, **options):
    evaluate_operator(settings, path, workers=0, rig=StillRig(), show_progress=False, **options)


def test_the_operators_file_is_read_like_that_of_a_policy(tmp_path):
    evaluate(tmp_path / "new" / "operator.jsonl")
    evaluation = read_evaluation(tmp_path / "new" / "operator.jsonl")
    assert evaluation.operator == "scripted"
    assert EvaluationOrigin.read(evaluation.path).packages["lerobot"]
    # lerobot-eval with seed 1000 shows scene 1000 + i with target (1000 + i) % 4.
    assert [str(key) for key in evaluation.episodes] == ["test/1000/0", "test/1001/1", "test/1002/2"]


@pytest.mark.slow
def test_the_scripted_operator_fills_the_box_without_pictures(tmp_path):
    evaluate_operator(
        replace(SETTINGS, scenes=1),
        tmp_path / "o.jsonl",
        workers=0,
        rig=ExcavatorRig(with_images=False),
        show_progress=False,
    )
    (episode,) = read_evaluation(tmp_path / "o.jsonl").episodes.values()
    assert episode.retained_mass_kg > 0.0


def test_an_episode_that_never_loads_is_written_too(tmp_path):
    rig, settings = ExcavatorRig(with_images=False), replace(SETTINGS, scenes=1, episode_length=1)
    evaluate_operator(settings, tmp_path / "o.jsonl", workers=0, rig=rig, show_progress=False)
    line = json.loads((tmp_path / "o.jsonl").read_text())
    assert (line["loading_onset_time_s"], line["is_success"]) == (None, False)


def test_successes_are_counted_on_the_bar(tmp_path, capsys):
    evaluate_operator(SETTINGS, tmp_path / "o.jsonl", workers=0, rig=StillRig(), show_progress=True)
    assert "3/3" in capsys.readouterr().err


def test_an_existing_file_is_not_overwritten(tmp_path):
    (tmp_path / "o.jsonl").write_text("mine")
    with pytest.raises(DatasetError, match="exists"):
        evaluate(tmp_path / "o.jsonl")
    assert (tmp_path / "o.jsonl").read_text() == "mine"


def test_an_interrupted_run_continues_to_the_same_file(tmp_path):
    evaluate(tmp_path / "whole.jsonl")
    whole = (tmp_path / "whole.jsonl").read_text()
    # The second line is torn in the middle.
    (tmp_path / "o.jsonl.partial").write_text(whole[: whole.index("\n") + 20])
    with pytest.raises(DatasetError, match="--resume"):
        evaluate(tmp_path / "o.jsonl")
    evaluate(tmp_path / "o.jsonl", resume=True)
    assert (tmp_path / "o.jsonl").read_text() == whole
    assert not (tmp_path / "o.jsonl.partial").exists()


def test_a_run_of_another_version_of_the_simulation_is_not_continued(tmp_path, monkeypatch):
    evaluate(tmp_path / "o.jsonl")
    (tmp_path / "o.jsonl").rename(tmp_path / "o.jsonl.partial")
    monkeypatch.setitem(ENVIRONMENTS, "excavator", replace(EXCAVATOR, simulation_version=99))
    with pytest.raises(ConfigurationError, match=f"simulation_version={SIMULATION_VERSION}, not 99"):
        evaluate(tmp_path / "o.jsonl", resume=True)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 3}, "operator_seed=0, not 3"),
        ({"first_scene": 7}, "scene_id=1000, not 7"),
        ({"fps": 5}, "fps=10"),
    ],
)
def test_continuing_with_another_setting_names_it(tmp_path, changes, message):
    evaluate(tmp_path / "o.jsonl")
    (tmp_path / "o.jsonl").rename(tmp_path / "o.jsonl.partial")
    with pytest.raises(ConfigurationError, match=message):
        evaluate(tmp_path / "o.jsonl", settings=replace(SETTINGS, **changes), resume=True)
