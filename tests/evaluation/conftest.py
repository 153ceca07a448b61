"""Metrics files of evaluations, and checkpoints of trainings, that never were."""

import json
from datetime import datetime, timedelta
from functools import partial

import pytest

from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.run import Run

MASK = {"mask_source": "oracle", "mask_condition": "correct", "mask_noise": "none", "mask_noise_px": 0}
SHARED = {
    **{"scene_set": "test", **MASK, "target_overlay": False, "mask_missing": False, "mask_missing_frames": 0},
    **{"frames": 200, "fps": 10, "episode_length": 200, "is_success": True},
}
SCOOP = {
    **{"simulation_version": 5, "task": "Scoop-v0", "soil": "sand", "fidelity": "standard", "target_success": True},
    **{"retained_mass_kg": 300.0, "residual_bucket_mass_kg": 1.5, "hard_target_contacts": 0},
    **{"spill_before_target_events": 0, "loading_onset_time_s": None},
}
GRASP = {
    **{"simulation_version": 1, "task": "FR5Grasp-v0", "episode_return": 800.0, "target_in_tray": True},
    **{"blocks_in_tray": 1, "released": True},
}


def line(task, number, /, **changes):
    """A line of a metrics file; unless changed, a success in the scene and with the seed of its number."""
    target = number % 4
    place = {"episode_ix": number, "seed": number, "scene_id": number, "stage": 0, "target_id": target}
    place["commands"] = [[0, target]]
    grasped = {"first_grasped_block": target} if task is GRASP else {}
    return {**place, **SHARED, "shown_target_id": target, **task, **grasped, **changes}


scoop_line = pytest.fixture(lambda: partial(line, SCOOP))
grasp_line = pytest.fixture(lambda: partial(line, GRASP))


@pytest.fixture
def metrics_file(tmp_path):
    """Write a metrics file; returns its path."""

    def write(name, lines):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(json.dumps(entry) + "\n" for entry in lines))
        return path

    return write


@pytest.fixture
def make_run(metrics_file):
    """Write metrics files, one per seed, and read them as a run."""

    def make(label, *seeds):
        paths = [metrics_file(f"{label}{number}.jsonl", lines) for number, lines in enumerate(seeds)]
        return Run(label=label, evaluations=tuple(read_evaluation(path) for path in paths))

    return make


@pytest.fixture
def write_training(tmp_path):
    """Leave checkpoints at some steps, one every 10 minutes, and the log of a workflow; returns the last checkpoint."""

    def write(name, *steps, dataset=None):
        folder, start = tmp_path / "train" / name, datetime(2026, 1, 1, 12, 0, 0)
        log = [
            "# commit 0123456789abcdef",
            "$ lerobot-train --x=1",
            f"INFO {start} ot_train.py:597 Start offline training on a fixed dataset",
        ]
        data = {"root": f"{tmp_path}/data/pairs", "episodes": list(range(200)), "eval_split": 0.1975}
        config = {"dataset": {"repo_id": "local/x", **data, **(dataset or {})}, "batch_size": 16, "seed": 1000}
        for number, step in enumerate(steps, 1):
            checkpoint = folder / "checkpoints" / f"{step:06d}"
            (checkpoint / "pretrained_model").mkdir(parents=True)
            (checkpoint / "training_state").mkdir()
            (checkpoint / "training_state" / "training_step.json").write_text(json.dumps({"step": step}))
            (checkpoint / "pretrained_model" / "train_config.json").write_text(json.dumps(config))
            time = start + timedelta(minutes=10 * number)
            log.append(f"Training: 9%|# | 1/2INFO {time} ot_train.py:687 Checkpoint policy after step {step}")
        folder.with_name(f"{name}.log").write_text("\n".join(log))
        return checkpoint

    return write
