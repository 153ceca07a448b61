"""Metrics files of made-up evaluations."""

import json

import pytest

from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.run import Run

# How long an example takes says how busy the machine is, not whether the code is right.


def line(number, **changes):
    return {
        "episode_ix": number,
        "seed": number,
        "simulation_version": 2,
        "task": "Scoop-v0",
        "scene_set": "test",
        "scene_id": number,
        "target_id": number % 4,
        "mask_condition": "correct",
        "soil": "sand",
        "fidelity": "standard",
        "target_success": True,
        "is_success": True,
        "retained_mass_kg": 300.0,
        "residual_bucket_mass_kg": 1.5,
        "hard_target_contacts": 0,
        "spill_before_target_events": 0,
        "loading_onset_time_s": None,
        **changes,
    }


def grasp(number, **changes):
    return {
        "episode_ix": number,
        "seed": number,
        "simulation_version": 1,
        "task": "FR5Grasp-v0",
        "scene_set": "test",
        "scene_id": number,
        "target_id": number % 4,
        "final_target_id": number % 4,
        "mask_condition": "correct",
        "mask_noise": "none",
        "mask_noise_px": 0,
        "retarget_frame": None,
        "is_success": True,
        "episode_return": 800.0,
        "first_grasped_block": number % 4,
        "shown_block": number % 4,
        "target_in_tray": True,
        "blocks_in_tray": 1,
        "released": True,
        **changes,
    }


@pytest.fixture
def metrics_line():
    return line


@pytest.fixture
def grasp_line():
    return grasp


@pytest.fixture
def metrics_file(tmp_path):
    """Write a metrics file; returns its path."""

    def write(name, lines):
        path = tmp_path / name
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
