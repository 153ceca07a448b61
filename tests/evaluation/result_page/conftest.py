"""An experiment that was never run: its metrics, records, checkpoints and logs."""

import json

import numpy as np
import pytest

from lerobot_excav.evaluation.result_page.contents import read_contents
from lerobot_excav.evaluation.video import write_video

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


@pytest.fixture
def read_rows(tmp_path):
    """Read what stands on a page, from TOML after `metrics`."""

    def read(text, **options):
        path = tmp_path / "rows.toml"
        path.write_text(f'title = "t"\nmetrics = "{tmp_path}/test"\n{text}')
        return read_contents(path, **options)

    return read


@pytest.fixture
def write_evaluation(metrics_file, tmp_path):
    """Leave what lerobot-eval leaves: metrics, where they come from and, if wanted, videos."""

    def write(name, lines, checkpoint, videos=0):
        path = metrics_file(f"{name}/metrics.jsonl", lines)
        record = {
            "command": f"lerobot-eval --policy.path={checkpoint}/pretrained_model --seed=1000",
            "commit": "0123456789abcdef0123456789abcdef01234567",
            "modified": False,
            "packages": {"lerobot": "0.6.1", "mujoco": "4.0"},
            "policy": f"{checkpoint}/pretrained_model",
        }
        path.with_suffix(".json").write_text(json.dumps(record))
        for number in range(videos):
            write_clip(path.parent / "videos" / "fr5_grasp_0" / f"eval_episode_{number}.mp4")

    return write


def write_clip(path, frames=20, rate=50, height=24, width=32):
    """Write a video that brightens by 5 a frame."""
    write_video(
        path, [np.full((height, width, 3), 5 * number, dtype=np.uint8) for number in range(frames)], rate, crf=23
    )


@pytest.fixture
def finished(write_training, write_evaluation, grasp_line, tmp_path):
    """Run everything but the row `later`; returns what stands on the page."""
    last = write_training("paired", 1000, 2000)
    failure = {"is_success": False, "episode_return": 3.0, "first_grasped_block": -1}
    good = [grasp_line(i, seed=1000 + i) for i in range(10)]
    zero = [grasp_line(i, seed=1000 + i, mask_condition="zero", **failure) for i in range(5)]
    write_evaluation("test/paired", good, last, videos=2)
    write_evaluation("test/zero", zero, last)
    for step, successes in ((1000, 2), (2000, 4)):
        lines = [grasp_line(i, scene_set="val", is_success=i < successes) for i in range(4)]
        write_evaluation(f"val/paired/{step:06d}", lines, last.with_name(f"{step:06d}"))
    return contents(tmp_path)


def contents(tmp_path, **options):
    path = tmp_path / "rows.toml"
    path.write_text(ROWS.format(tmp=tmp_path))
    return read_contents(path, **options)
