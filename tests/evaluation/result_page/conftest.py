"""An experiment that was never run: its metrics, records, checkpoints and logs."""

import json
from datetime import datetime, timedelta

import av
import numpy as np
import pytest

from lerobot_excav.evaluation.result_page.contents import read_contents

ROWS = """
title = "Does it obey?"
metrics = "{tmp}/test"
text = "Told before."

[[section]]
title = "The paper's table"
text = "About these."
reference = "paired"
rows = [
  {{ label = "paired", about = "paired", paper = {{ success = 96.0, episode_return = 658.0 }} }},
  {{ label = "zero", about = "paired", paper = {{ success = 2.0, episode_return = 0.0 }} }},
  {{ label = "later", about = "never run" }},
]

[[curve]]
label = "paired policy"
folder = "{tmp}/val/paired"

[[clips]]
label = "paired"
episodes = [0, 1]
"""

START = datetime(2026, 1, 1, 12, 0, 0)


@pytest.fixture
def write_training(tmp_path):
    """Leave what lerobot-train leaves: checkpoints at some steps, one every 10 minutes, and the log."""

    def write(name, *steps):
        folder = tmp_path / "train" / name
        log = [f"INFO {START} ot_train.py:597 Start offline training on a fixed dataset"]
        for number, step in enumerate(steps, 1):
            checkpoint = folder / "checkpoints" / f"{step:06d}"
            (checkpoint / "pretrained_model").mkdir(parents=True)
            (checkpoint / "training_state").mkdir()
            (checkpoint / "training_state" / "training_step.json").write_text(json.dumps({"step": step}))
            dataset = {"root": f"{tmp_path}/data/pairs", "episodes": list(range(200)), "eval_split": 0.1975}
            config = {"dataset": {"repo_id": "local/x", **dataset}, "batch_size": 16, "seed": 1000}
            (checkpoint / "pretrained_model" / "train_config.json").write_text(json.dumps(config))
            time = START + timedelta(minutes=10 * number)
            log.append(f"Training: 9%|# | 1/2INFO {time} ot_train.py:687 Checkpoint policy after step {step}")
        folder.with_name(f"{name}.log").write_text("\n".join(log))
        write_record(folder, "lerobot-train --x=1")
        return folder

    return write


@pytest.fixture
def read_rows(tmp_path):
    """Read what stands on a page, from TOML after `metrics`."""

    def read(text, **options):
        path = tmp_path / "rows.toml"
        path.write_text(f'title = "t"\nmetrics = "{tmp_path}/test"\n{text}')
        return read_contents(path, **options)

    return read


def write_record(folder, command):
    record = {
        "stage": folder.name,
        "command": command,
        "environment": {},
        "commit": "0123456789abcdef0123456789abcdef01234567",
        "modified": False,
        "packages": {"lerobot": "0.6.1", "mujoco": "4.0"},
        "attempts": [{"started": "2026-01-01T12:00:00+00:00", "wall_s": 60.0, "exit_code": 0}],
    }
    folder.with_name(f"{folder.name}.json").write_text(json.dumps(record))


@pytest.fixture
def write_evaluation(tmp_path):
    """Leave what lerobot-eval leaves: a metrics file and, if wanted, videos."""

    def write(name, lines, checkpoint, videos=0):
        folder = tmp_path / name
        folder.mkdir(parents=True)
        (folder / "metrics.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
        write_record(folder, f"lerobot-eval --policy.path={checkpoint}/pretrained_model --seed=1000")
        for number in range(videos):
            write_video(folder / "videos" / "fr5_grasp_0" / f"eval_episode_{number}.mp4")

    return write


def write_video(path, frames=20, rate=50):
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), mode="w") as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.width, stream.height, stream.pix_fmt = 32, 24, "yuv420p"
        for number in range(frames):
            image = np.full((24, 32, 3), 5 * number, dtype=np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode(None))


@pytest.fixture
def finished(write_training, write_evaluation, grasp_line, tmp_path):
    """Run everything but the row `later`; returns what stands on the page."""
    training = write_training("paired", 1000, 2000)
    last = training / "checkpoints" / "002000"
    failure = {"is_success": False, "episode_return": 3.0, "first_grasped_block": -1}
    good = [grasp_line(i, seed=1000 + i) for i in range(10)]
    zero = [grasp_line(i, seed=1000 + i, mask_condition="zero", **failure) for i in range(5)]
    write_evaluation("test/paired", good, last, videos=2)
    write_evaluation("test/zero", zero, last)
    for step, successes in ((1000, 2), (2000, 4)):
        lines = [grasp_line(i, scene_set="val", is_success=i < successes) for i in range(4)]
        write_evaluation(f"val/paired/{step:06d}", lines, training / "checkpoints" / f"{step:06d}")
    return contents(tmp_path)


def contents(tmp_path, **options):
    path = tmp_path / "rows.toml"
    path.write_text(ROWS.format(tmp=tmp_path))
    return read_contents(path, **options)
